// What a pixel sees, as it is stored until lights are laid over it or, AT_ONCE, as it is shown
// where the only light reaches it and where it does not. HAS_LAMP: there is such a light.

#include "color.glsl"
#include "gloss.glsl"
#ifdef HAS_LAMP
#include "lamp.glsl"
#endif

#ifdef AT_ONCE
layout(location = 0) out vec4 lit;  // both sRGB
layout(location = 1) out vec4 dark;
#else
layout(location = 0) out vec4 light;  // so far
layout(location = 1) out vec4 place;  // normal and depth key
layout(location = 2) out vec4 stored; // reflectance, and how metallic
layout(location = 3) out vec4 face;   // its own normal, and how rough; -1 where matte
#endif

struct Seen {
    vec3 albedo;
    vec3 before;         // glow and ambient light
    vec3 at;             // relative to the eye
    vec3 normal;
    vec3 flat_normal;    // the face's own, of any length
    float key;           // of depth
    float metallic;
    float roughness;     // MATTE or UNLIT where nothing is reflected
    vec3 eye;            // unit vector to it
};

// An alpha of 0 marks, in shadow, what is turned from the lamp but for its smooth normal.
void store(Seen seen) {
#ifdef AT_ONCE
#ifdef IS_UNLIT
    lit = dark = vec4(encode(seen.before), 1.0);
    return;
#endif
#if defined(IS_GLOSSY) || defined(IS_GLOWING)
    dark = vec4(show(seen.before), 1.0);
#else
    dark = vec4(encode(seen.before), 1.0);  // ambient light is never bright
#endif
    vec3 shown = seen.before;
#ifdef HAS_LAMP
#ifdef HAS_NORMALS
    dark.a = is_turned(seen.at, seen.normal, seen.flat_normal) ? 0.0 : 1.0;
#endif
    vec3 toward = find_toward(seen.at);
#ifdef IS_GLOSSY
    vec3 reflected = reflect_light(
        seen.albedo, seen.metallic, seen.roughness, seen.normal, toward, seen.eye);
#else
    vec3 reflected = seen.albedo * max(dot(seen.normal, toward), 0.0);
#endif
    shown += reflected * find_radiance(seen.at) * find_bend(dot(seen.normal, toward));
#endif
    lit = vec4(show(shown), 1.0);
#else
    light = vec4(seen.before, 1.0);
    place = vec4(seen.normal, seen.key);
    stored = vec4(pack(seen.albedo), seen.metallic);
    face = vec4(normalize(seen.flat_normal), seen.roughness);
#endif
}
