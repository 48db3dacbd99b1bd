// What is seen: normal, depth key, reflectance, and what shows before any light is switched
// on. IS_LAYER: of a transparent surface, before what was drawn so far. IS_SOUND: the normals lean
// to the only side that can be seen.

#include "seen.glsl"
#include "texel.glsl"

uniform vec3 color;        // reflectance
uniform float opacity;
#ifdef IS_GLOWING
uniform vec3 emission;
#endif
uniform float cutoff;      // of a mask's alpha, in levels of 255
uniform vec2 wraps;        // of the texture, as texel.glsl has it
uniform sampler2D image;   // sRGB, decoded when fetched
uniform float metallic, roughness;
uniform sampler2D gloss;   // green multiplies roughness, blue metallic
uniform sampler2D bumps;   // normals along u, against v, outward
uniform float bump_scale;
uniform sampler2D glow;    // sRGB, multiplies emission
uniform sampler2D openings;  // red: what of the even light comes in
uniform float occlusion;
uniform vec4 seconds;      // 1 where gloss, bumps, glow, openings are placed by the second coordinates
uniform vec3 forward;
uniform bool is_perspective;

#include "ambient.glsl"

in vec3 at;
#ifdef HAS_NORMALS
centroid in vec3 normal;
#endif
#ifdef HAS_UV
in vec2 uv;
#endif
#ifdef HAS_UV2
in vec2 uv2;
#endif
#ifdef HAS_TINTS
in vec4 tint;
#endif
#ifdef HAS_TANGENTS
in vec4 tangent;
#endif

#ifdef IS_LAYER
uniform sampler2D behind;  // normals and depth keys of what was drawn before
uniform bool is_first;     // which is opaque: what is before nothing is seen, too
uniform float floor_height;  // of the ground, relative to the eye

const float STEP = 1.0 / 1048576.0;  // of a key: what is nearer is as far
#endif

#ifdef HAS_UV
// Where an image is placed: by the second coordinates if so asked.
vec2 find_uv(float second) {
#ifdef HAS_UV2
    return second > 0.0 ? uv2 : uv;
#else
    return uv;
#endif
}
#endif

#ifdef HAS_IMAGE
vec4 fetch_level(int col, int row) {
    vec4 texel = texelFetch(image, ivec2(col, row), 0);
    return vec4(texel.rgb, round(255.0 * texel.a));
}

// The texture between its four nearest texels, alpha in levels of 255, as transmission.glsl has it:
// what is seen of a mask is what casts.
vec4 find_texel() {
    ivec2 size = textureSize(image, 0), how = ivec2(wraps);
    vec2 place = uv * vec2(size) - 0.5;
    ivec2 one = ivec2(floor(place));
    vec2 share = place - floor(place);
    int left = wrap_texel(one.x, size.x, how.x), right = wrap_texel(one.x + 1, size.x, how.x);
    int above = wrap_texel(one.y, size.y, how.y), below = wrap_texel(one.y + 1, size.y, how.y);
    vec4 a = fetch_level(left, above), b = fetch_level(right, above);
    vec4 c = fetch_level(left, below), d = fetch_level(right, below);
    vec4 upper = a + share.x * (b - a), lower = c + share.x * (d - c);
    return upper + share.y * (lower - upper);
}
#endif

void main() {
    vec4 texel = vec4(vec3(1.0), 255.0);
    float alpha = opacity;
#ifdef HAS_IMAGE
#if defined(IS_MASK) || defined(IS_BLEND)
    texel = find_texel();
#else
    texel = texture(image, uv);
#endif
#endif
#ifdef HAS_ALPHA
    texel.a *= tint.a;
#endif
#ifdef IS_BLEND
    alpha = 1.0 - (255.0 - opacity * texel.a) / 255.0;
#endif
#ifdef IS_MASK
    if (texel.a < cutoff) {
        discard;
    }
#endif
    vec3 reflectance = color * texel.rgb;
#ifdef HAS_TINTS
    reflectance *= tint.rgb;
#endif

    // The side that is seen counts, however the face is wound: its normal points to the eye. Where
    // a face is seen nearly edge-on, a neighbouring pixel, or the middle of this one if only some
    // of its samples are covered, may be beyond the vanishing line: there all turns over.
    vec3 flat_normal = cross(dFdx(at), dFdy(at));
    vec3 ray = !is_perspective ? forward : dot(at, forward) < 0.0 ? -at : at;
    flat_normal = faceforward(flat_normal, ray, flat_normal);
    vec3 seen_normal = flat_normal;
    float side = 1.0;  // -1: the back of what the normals describe is seen
#ifdef IS_SOUND
    seen_normal = normal;
#elif defined(HAS_NORMALS)
    seen_normal = dot(normal, normal) > 0.0 ? normal : flat_normal;
    side = dot(seen_normal, flat_normal) < 0.0 ? -1.0 : 1.0;
    seen_normal *= side;
#endif
    seen_normal = normalize(seen_normal);

#ifdef HAS_BUMPS
    vec2 spot = find_uv(seconds.y), right = dFdx(spot), up = dFdy(spot);
    float turn = right.x * up.y - right.y * up.x < 0.0 ? -1.0 : 1.0;
    vec3 along = turn * (dFdx(at) * up.y - dFdy(at) * right.y);
    vec3 against = turn * (dFdx(at) * up.x - dFdy(at) * right.x);
#ifdef HAS_TANGENTS
    if (dot(tangent.xyz, tangent.xyz) > 0.0) {
        along = tangent.xyz;
        against = (tangent.w < 0.0 ? -side : side) * cross(seen_normal, along);
    }
#endif
    along -= seen_normal * dot(along, seen_normal);
    if (dot(along, along) > 0.0) {
        along = normalize(along);
        vec3 across = cross(seen_normal, along);
        across *= dot(across, against) < 0.0 ? -1.0 : 1.0;
        vec3 bend = 2.0 * texture(bumps, spot).xyz - 1.0;
        bend.xy *= side * bump_scale;  // what bulges in front is a dent behind
        seen_normal = normalize(along * bend.x + across * bend.y + seen_normal * bend.z);
    }
    flat_normal = seen_normal;  // its terminator is that of the faces
#endif

    float depth = dot(at, forward);
    float key = is_perspective ? 1.0 / depth : -depth;
#ifdef IS_LAYER
    float last = texelFetch(behind, ivec2(gl_FragCoord.xy), 0).w;
    // Of two surfaces in the ground's plane the model's own is in front.
    bool is_floor = is_first && abs(at.z - floor_height) < 2.0 * STEP * length(at);
    float least = is_floor ? last - 4.0 * STEP * abs(last) : last + STEP * abs(last);
    bool is_nearer = last == 0.0 ? is_first : key > least;
    if (alpha <= 0.0 || !is_nearer) {
        discard;
    }
#endif
    vec3 eye = is_perspective ? -normalize(at) : -forward;
    float metal = 0.0, rough = MATTE;
    vec3 glows = vec3(0.0);
#ifdef IS_GLOWING
    glows = emission;
#ifdef HAS_GLOW
    glows *= texture(glow, find_uv(seconds.z)).rgb;
#endif
#endif
#ifdef IS_UNLIT
    vec3 before = glows + reflectance;
    reflectance = vec3(0.0);
    rough = UNLIT;
#else
    vec3 even = find_ambient(seen_normal), reflected = reflectance * even;
#ifdef IS_GLOSSY
    metal = metallic;
    rough = roughness;
#ifdef HAS_GLOSS
    vec2 factors = texture(gloss, find_uv(seconds.x)).bg;
    metal *= factors.x;
    rough *= factors.y;
#endif
    reflected = reflect_sky(reflectance, metal, rough, seen_normal, eye, even);
#endif
#ifdef HAS_OPENINGS
    reflected *= 1.0 + occlusion * (texture(openings, find_uv(seconds.w)).r - 1.0);
#endif
    vec3 before = glows + reflected;
#endif
    store(Seen(reflectance, before, at, seen_normal, flat_normal, key, metal, rough, eye));
#ifdef IS_LAYER
    light.a = alpha;
#endif
}
