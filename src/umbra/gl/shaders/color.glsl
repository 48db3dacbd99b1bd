// Linear light as it is stored and as it is shown.

// Reflectance goes into 8 bits as its root, which spares the dark tones and costs no power.
vec3 pack(vec3 albedo) {
    return sqrt(albedo);
}

vec3 unpack(vec3 stored) {
    return stored * stored;
}

// sRGB (IEC 61966-2-1) by a sum of roots fitted to it, within 0.02 of 255 steps.
vec3 encode(vec3 light) {
    vec3 root = sqrt(light);
    vec3 fourth = sqrt(root);
    vec3 eighth = sqrt(fourth);
    vec3 high = 0.64237103 * root + 0.71210417 * fourth - 0.33686729 * eighth - 0.01756489 * light;
    return mix(high, 12.92 * light, vec3(lessThanEqual(light, vec3(0.0031308))));
}
