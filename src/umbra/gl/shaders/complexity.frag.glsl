// What share of a light is seen, from the counts of its spots: umbra/soft/complexity.py.
//
// Where an edge passes the light's middle the hard count may stand on the other side than the edge,
// by the rasteriser's rounding, and is then wrong by one. As coverage is continuous on a surface,
// what is near tells which is right.

#include "picture.glsl"

uniform sampler2D hard;
uniform sampler2D parts;   // sums of what edges take; how many pass the light's middle
uniform sampler2D hidden;  // spots that are hidden, by one less than the hard count, as it is, one more
uniform sampler2D sums;    // of counts, of their squares
uniform sampler2D keys;    // depth keys, normals
uniform float n_spots;

layout(location = 0) out float share;

const float BETTER = 0.1;
const float ENOUGH = 5.0;  // pixels of eight
const float ALIKE = 0.9;     // normals of one surface
const float APART = 2e-3;    // of its depth: how far from its plane what is near may lie

float find_coverage(ivec2 pixel, int more) {
    vec2 sum = texelFetch(sums, pixel, 0).xy;
    float k = float(more), dark = texelFetch(hidden, pixel, 0)[more + 1];
    float total = sum.x + k * n_spots, square = sum.y + k * (2.0 * sum.x + k * n_spots);
    float mean = texelFetch(hard, pixel, 0).r + texelFetch(parts, pixel, 0).r + k;
    float spread = square - total * total / n_spots;
    if (spread <= 0.5 / n_spots) {  // all spots are alike
        return total <= n_spots ? clamp(mean, 0.0, 1.0) : 1.0;
    }
    float slope = (total - total * dark / n_spots) / spread;
    return clamp(dark / n_spots + slope * (mean - total / n_spots), 0.0, 1.0);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(parts, 0) - 1;
    float coverage = find_coverage(pixel, 0);
    if (texelFetch(parts, pixel, 0).g > 0.0) {
        vec3 counted = texelFetch(hidden, pixel, 0).xyz;
        // No count is below 0: one more only where some are, one less only where none would be.
        int more = counted.z < n_spots ? 1 : counted.y < n_spots ? 0 : -1;
        vec4 here = texelFetch(keys, pixel, 0);
        float near = 0.0, weight = 0.0;
        for (int k = 0; k < 9; ++k) {
            ivec2 other = clamp(pixel + ivec2(k % 3, k / 3) - 1, ivec2(0), last);
            vec4 there = texelFetch(keys, other, 0);
            vec3 seen = find_seen(gl_FragCoord.xy + vec2(other - pixel), there.r);
            if (k != 4 && there.r != 0.0 && dot(here.gba, there.gba) > ALIKE
                && abs(dot(here.gba, seen - find_seen(gl_FragCoord.xy, here.r))) < APART * length(seen)) {
                near += find_coverage(other, 0);
                weight += 1.0;
            }
        }
        near = weight >= ENOUGH ? near / weight : coverage;
        float other = find_coverage(pixel, more);
        if (abs(other - near) < abs(coverage - near) - BETTER) {
            coverage = other;
        }
    }
    share = 1.0 - coverage;
}
