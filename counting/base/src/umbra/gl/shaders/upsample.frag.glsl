// A mask of fewer pixels laid over the picture: nearest, bilinear, or between pixels that
// belong to the same surface (joint). IS_LINEAR leaves a mask of 0 and 1 to the texture unit.

#include "picture.glsl"

uniform sampler2D mask;
uniform int channel;
uniform float low, high;    // between which what is lit lies
uniform float dark;         // what shadow multiplies by
uniform vec2 scale;         // pixels of the picture to one of the mask
uniform vec2 mask_size;
uniform vec2 middle;        // of the picture [pixels]; that of the mask lies on it
uniform bool is_smooth;
#ifdef IS_JOINT
uniform sampler2D places;      // normals and depth keys, of the picture
uniform sampler2D low_places;  // and of the mask
#endif

layout(location = 0) out vec4 color;

const float THICKNESS = 0.02;  // how far from a surface's plane, for its depth, a pixel may lie
const float FAINT = 1e-4;      // weight of a pixel of another surface: only where all are

float find_light(ivec2 pixel) {
    float value = texelFetch(mask, pixel, 0)[channel];
    return value >= low && value <= high ? 1.0 : 0.0;
}

vec2 find_place() {
    return (gl_FragCoord.xy - middle) / scale + 0.5 * mask_size;
}

void main() {
#ifdef IS_LINEAR
    color = vec4(mix(dark, 1.0, texture(mask, find_place() / mask_size)[channel]));
    return;
#endif
    vec2 place = find_place() - 0.5;
    ivec2 last = ivec2(mask_size) - 1;
    if (!is_smooth) {
        color = vec4(mix(dark, 1.0, find_light(clamp(ivec2(floor(place + 0.5)), ivec2(0), last))));
        return;
    }
    ivec2 base = ivec2(floor(place));
    vec2 part = place - vec2(base);
#ifdef IS_JOINT
    vec4 seen = texelFetch(places, ivec2(gl_FragCoord.xy), 0);
    vec3 point = find_seen(gl_FragCoord.xy, seen.w);
    float far = is_perspective ? dot(point, forward) : length(point);
#endif
    float sum = 0.0, weights = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 corner = ivec2(k & 1, k >> 1);
        ivec2 pixel = clamp(base + corner, ivec2(0), last);
        vec2 near = mix(1.0 - part, part, vec2(corner));
        float weight = near.x * near.y;
#ifdef IS_JOINT
        vec4 other = texelFetch(low_places, pixel, 0);
        bool alike = other.w != 0.0 && seen.w != 0.0 && dot(other.xyz, seen.xyz) > 0.9;
        if (alike) {
            vec3 apart = find_seen((vec2(pixel) + 0.5 - 0.5 * mask_size) * scale + middle, other.w) - point;
            alike = abs(dot(apart, seen.xyz)) < THICKNESS * far;
        }
        weight *= alike ? 1.0 : FAINT;
#endif
        sum += weight * find_light(pixel);
        weights += weight;
    }
    color = vec4(mix(dark, 1.0, sum / max(weights, 1e-12)));
}
