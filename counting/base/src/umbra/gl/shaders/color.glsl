// Linear light as it is stored and as it is shown.

// Roughness of what only scatters, and of what shows its colour as it is.
const float MATTE = -1.0, UNLIT = -2.0;

const float COMPRESSED = 0.8, DESATURATION = 0.15;

// Reflectance goes into 8 bits as its root, which spares the dark tones and costs no power.
vec3 pack(vec3 albedo) {
    return sqrt(albedo);
}

vec3 unpack(vec3 stored) {
    return stored * stored;
}

// sRGB (IEC 61966-2-1) of light: a polynomial of its root, within 0.09 of 255 steps up to 1, and
// rising above.
vec3 encode(vec3 light) {
    vec3 root = sqrt(light);
    vec3 high = ((((0.51730231 * root - 1.62365709) * root + 2.03157354) * root
                  - 1.40273628) * root + 1.51795092) * root - 0.04010961;
    return mix(high, 12.92 * light, lessThanEqual(light, vec3(0.0031308)));
}

// What is brighter than a screen shows is compressed toward white, as umbra/cpu/shade.py says.
vec3 compress(vec3 light) {
    // It is shown as bright as shown / whole, and keeps whole / kept of its colour: one division.
    float bright = max(max(max(light.r, light.g), light.b), COMPRESSED), room = 1.0 - COMPRESSED;
    float whole = bright + room - COMPRESSED, shown = whole - room * room;
    float kept = whole + DESATURATION * (bright * whole - shown);
    float part = shown / (whole * bright * kept);
    return part * (whole * light + (kept - whole) * bright);
}

vec3 show(vec3 light) {
    return encode(compress(light));
}

vec3 decode(vec3 shown) {
    vec3 high = pow((shown + 0.055) / 1.055, vec3(2.4));
    return mix(high, shown / 12.92, lessThanEqual(shown, vec3(0.04045)));
}
