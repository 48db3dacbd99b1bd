// What a pixel sees, as it is stored until lights are laid over it or, AT_ONCE, as it is shown
// where the only light reaches it and where it does not. HAS_LAMP: there is such a light.

#include "color.glsl"
#ifdef HAS_LAMP
#include "lamp.glsl"
#endif

#ifdef AT_ONCE
layout(location = 0) out vec4 lit;  // both sRGB
layout(location = 1) out vec4 dark;
#else
layout(location = 0) out vec4 light;  // so far
layout(location = 1) out vec4 place;  // normal and depth key
layout(location = 2) out vec4 stored;
layout(location = 3) out vec4 face;   // its own normal
#endif

// Reflectance, glow and ambient light, place relative to the eye, normal, the face's own, depth key.
// An alpha of 0 marks, in shadow, what is turned from the lamp but for its smooth normal.
void store(vec3 albedo, vec3 before, vec3 at, vec3 normal, vec3 flat_normal, float key) {
#ifdef AT_ONCE
    dark = vec4(encode(before), 1.0);
#ifdef HAS_LAMP
    dark.a = is_turned(at, normal, flat_normal) ? 0.0 : 1.0;
    before += albedo * find_lamplight(at, normal);
#endif
    lit = vec4(encode(before), 1.0);
#else
    light = vec4(before, 1.0);
    place = vec4(normal, key);
    stored = vec4(pack(albedo), 1.0);
    face = vec4(flat_normal, 1.0);
#endif
}
