// How glossy surfaces reflect: glTF's metallic-roughness model, as umbra/cpu/gloss.py says it.

const float DIELECTRIC = 0.04;  // what reflects head-on what is no metal
const float LEAST = 0.045;      // roughness
const float TINY = 1e-9;

// Of a light of intensity 1, times the cosine; unit vectors outward, to the light, to the eye.
vec3 reflect_light(vec3 albedo, float metallic, float roughness, vec3 normal, vec3 toward, vec3 eye) {
    vec3 middle = toward + eye;
    middle /= max(length(middle), TINY);
    float lit = max(dot(normal, toward), 0.0), to_eye = max(dot(normal, eye), 1e-4);
    float to_half = dot(normal, middle), between = max(dot(eye, middle), 0.0);
    float alpha = max(roughness, LEAST) * max(roughness, LEAST), square = alpha * alpha;
    float sharp = to_half * to_half * (square - 1.0) + 1.0;
    float spread = square / max(sharp * sharp, TINY);
    float masked = 0.5 / max(lit * sqrt(to_eye * to_eye * (1.0 - square) + square)
                             + to_eye * sqrt(lit * lit * (1.0 - square) + square), TINY);
    vec3 head_on = mix(vec3(DIELECTRIC), albedo, metallic);
    float rest = 1.0 - between;
    vec3 fresnel = head_on + (1.0 - head_on) * rest * rest * rest * rest * rest;
    return lit * ((1.0 - fresnel) * (1.0 - metallic) * albedo + fresnel * spread * masked);
}

// Of the sky in a direction that rises by a sine, as blurred as a mirror is rough.
vec3 find_dome(float up, float roughness) {
    float above = clamp(0.5 + 0.5 * up / (0.05 + 0.95 * roughness), 0.0, 1.0);
    return mix(BOUNCE, mix(HORIZON, SKY, clamp(up, 0.0, 1.0)), above);
}

// Of an even ambient light, and of the sky.
vec3 reflect_sky(vec3 albedo, float metallic, float roughness, vec3 normal, vec3 eye, vec3 ambient) {
    float to_eye = max(dot(normal, eye), 0.0);
    vec3 mirrored = 2.0 * to_eye * normal - eye;
    vec4 fit = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float low = min(fit.x * fit.x, exp2(-9.28 * to_eye)) * fit.x + fit.y;
    vec3 shown = mix(vec3(DIELECTRIC), albedo, metallic) * (fit.z - 1.04 * low) + fit.w + 1.04 * low;
    vec3 matte = (1.0 - shown) * (1.0 - metallic) * albedo;
    return matte * ambient + shown * find_dome(mirrored.z, roughness);
}
