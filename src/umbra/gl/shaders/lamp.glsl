// What one light brings to a surface that it reaches: range, attenuation, cone, picture.
//
// IS_POINT, IS_WEAKENING, IS_SPOT, IS_BENT and HAS_SLIDE are defined as the light needs them: a software device
// takes every branch of every pixel. ARE_MANY: each rectangle of the picture has its own light.

#ifdef ARE_MANY
#include "many.glsl"
uniform vec4 lamps[4 * MOST_LAMPS];
flat in int lamp_number;
#define lamp lamps[4 * lamp_number]
#define lamp_color lamps[4 * lamp_number + 1].rgb
#define fade lamps[4 * lamp_number + 1].a
#define attenuation lamps[4 * lamp_number + 2].xyz
#define axis lamps[4 * lamp_number + 3].xyz
#define cone vec2(lamps[4 * lamp_number + 2].w, lamps[4 * lamp_number + 3].w)
#define bend lamps[4 * lamp_number + 3].w
#else
uniform vec4 lamp;           // homogeneous, relative to the eye
uniform vec3 lamp_color;     // times the exposure
uniform vec3 attenuation;    // constant, linear, quadratic
uniform float fade;          // 1 / range², 0 without a range
uniform vec3 axis;
uniform vec2 cone;           // cosine of the half angle; 1 / (what the inner angle's is above it)
uniform float bend;          // power of the cosine
#endif
uniform sampler2D slide;
uniform vec3 slide_right, slide_up;  // over the tangent of the half angle

// Toward the lamp, of any length.
vec3 find_way(vec3 place) {
#ifdef IS_POINT
    return lamp.xyz - place;
#else
    return lamp.xyz;
#endif
}

// Whether a unit normal is not that of the face, which may have any length.
bool is_smooth(vec3 normal, vec3 flat_normal) {
    float lean = dot(normal, flat_normal);
    return lean * abs(lean) < 0.99998 * dot(flat_normal, flat_normal);
}

// Whether a face is turned from the lamp whose smooth normal is not: near the terminator its own
// body alone shades it no more than the smooth surface would.
bool is_turned(vec3 place, vec3 normal, vec3 flat_normal) {
    vec3 way = find_way(place);
    return dot(flat_normal, way) <= 0.0 && dot(normal, way) > 0.0 && is_smooth(normal, flat_normal);
}

// What reaches a surface that faces the lamp; its place is relative to the eye.
vec3 find_radiance(vec3 place) {
    vec3 tint = lamp_color;
#ifdef IS_POINT
    vec3 way = lamp.xyz - place;
    float square = max(dot(way, way), 1e-30);
    float near = inversesqrt(square);
    float amount = 1.0;
#ifdef IS_WEAKENING
    float weakened = attenuation.x + square * (near * attenuation.y + attenuation.z);
    amount *= max(1.0 - square * fade * (square * fade), 0.0) / max(weakened, 1e-12);
#endif
#ifdef IS_SPOT
    float along = -dot(way, axis) * near;
    float rim = clamp((along - cone.x) * cone.y, 0.0, 1.0);
    amount *= rim * rim;
#endif
#ifdef HAS_SLIDE
    float ahead = max(along, 1e-30) / near;
    vec2 spot = 0.5 + 0.5 * vec2(-dot(way, slide_right), dot(way, slide_up)) / ahead;
    tint *= texture(slide, clamp(spot, 0.0, 1.0)).rgb;
#endif
    tint *= amount;
#endif
    return tint;
}

// How much brighter it makes a surface than by its cosine: a low sun's light is bent.
float find_bend(float cosine) {
#ifdef IS_BENT
    return pow(max(cosine, 1e-9), bend - 1.0);
#else
    return 1.0;
#endif
}

// The unit vector toward the lamp.
vec3 find_toward(vec3 place) {
#ifdef IS_POINT
    vec3 way = lamp.xyz - place;
    return way * inversesqrt(max(dot(way, way), 1e-30));
#else
    return lamp.xyz;
#endif
}
