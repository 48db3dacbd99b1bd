// What is seen: normal, depth key, reflectance, and what shows before any light is switched
// on; or, of a transparent surface, its colour over what lies behind. IS_SOUND: the normals lean
// to the only side that can be seen.

#ifndef IS_TRANSPARENT
#include "seen.glsl"
#endif

uniform vec3 color;        // reflectance
uniform float opacity;
uniform vec3 emission;
uniform bool is_mask, is_blend;
uniform float cutoff;      // of a mask's alpha
uniform sampler2D image;   // sRGB, decoded when fetched
uniform float metallic, roughness;
uniform sampler2D gloss;   // green multiplies roughness, blue metallic
uniform sampler2D bumps;   // normals along u, against v, outward
uniform float bump_scale;
uniform vec3 forward;
uniform bool is_perspective;

#include "ambient.glsl"

in vec3 at;
#ifdef HAS_NORMALS
in vec3 normal;
#endif
#ifdef HAS_UV
in vec2 uv;
#endif
#ifdef HAS_TINTS
in vec3 tint;
#endif

#ifdef IS_TRANSPARENT
layout(location = 0) out vec4 shown;
#endif

#ifdef IS_UNLIT
const float EVEN_LIGHT = 1.0;
#else
const float EVEN_LIGHT = 0.7;  // on transparent surfaces
#endif

void main() {
    vec4 texel = vec4(1.0);
#ifdef HAS_UV
#ifdef HAS_IMAGE
    texel = texture(image, uv);
#endif
    if (is_mask && texel.a * opacity < cutoff) {
        discard;
    }
#endif
    vec3 reflectance = color * texel.rgb;
#ifdef HAS_TINTS
    reflectance *= tint;
#endif

    // The side that is seen counts, however the face is wound: x to the right and y upward turn
    // about what points to the eye.
    vec3 flat_normal = normalize(cross(dFdx(at), dFdy(at)));
    vec3 seen_normal = flat_normal;
#ifdef IS_SOUND
    seen_normal = normalize(normal);
#elif defined(HAS_NORMALS)
    seen_normal = dot(normal, normal) > 0.0 ? normalize(normal) : flat_normal;
    seen_normal *= dot(seen_normal, flat_normal) < 0.0 ? -1.0 : 1.0;
#endif

#ifdef HAS_BUMPS
    vec2 right = dFdx(uv), up = dFdy(uv);
    float turn = right.x * up.y - right.y * up.x < 0.0 ? -1.0 : 1.0;
    vec3 along = turn * (dFdx(at) * up.y - dFdy(at) * right.y);
    vec3 against = turn * (dFdx(at) * up.x - dFdy(at) * right.x);
    along -= seen_normal * dot(along, seen_normal);
    if (dot(along, along) > 0.0) {
        along = normalize(along);
        vec3 across = cross(seen_normal, along);
        across *= dot(across, against) < 0.0 ? -1.0 : 1.0;
        vec3 bend = 2.0 * texture(bumps, uv).xyz - 1.0;
        bend.xy *= bump_scale;
        seen_normal = normalize(along * bend.x + across * bend.y + seen_normal * bend.z);
    }
    flat_normal = seen_normal;  // its terminator is that of the faces
#endif

#ifdef IS_TRANSPARENT
    float alpha = opacity * (is_blend ? texel.a : 1.0);
    shown = vec4(alpha * (reflectance * EVEN_LIGHT + emission), alpha);
#else
    float depth = dot(at, forward);
    float key = is_perspective ? 1.0 / depth : -depth;
    vec3 eye = is_perspective ? -normalize(at) : -forward;
    float metal = 0.0, rough = MATTE;
#ifdef IS_UNLIT
    vec3 before = emission + reflectance;
    reflectance = vec3(0.0);
    rough = UNLIT;
#else
    vec3 even = find_ambient(seen_normal);
    vec3 before = emission + reflectance * even;
#ifdef IS_GLOSSY
    metal = metallic;
    rough = roughness;
#ifdef HAS_GLOSS
    vec2 factors = texture(gloss, uv).bg;
    metal *= factors.x;
    rough *= factors.y;
#endif
    before = emission + reflect_sky(reflectance, metal, rough, seen_normal, eye, even);
#endif
#endif
    store(Seen(reflectance, before, at, seen_normal, flat_normal, key, metal, rough, eye));
#endif
}
