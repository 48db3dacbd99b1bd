// What share of a light is seen, from the counts of its spots: umbra/soft/complexity.py.
//
// Where an edge passes the light's middle the hard count may stand on the other side than the edge,
// by the rasteriser's rounding, and is then wrong by one. As coverage is continuous on a surface,
// what is near tells which is right. IS_DOUBTED draws these pixels alone, again.

#include "picture.glsl"

uniform sampler2D hard;
uniform sampler2D parts;   // sums of what edges take; how many pass the light's middle
uniform sampler2D hidden;  // of spots.frag.glsl
uniform sampler2D sums;
uniform sampler2D keys;    // depth keys, normals
uniform float n_spots;

layout(location = 0) out float share;

const float BETTER = 0.1;
const float ALIKE = 0.9;   // normals of one surface
const float APART = 2e-3;  // of its depth: how far from its plane what is near may lie

// Spots that are hidden, if the hard count is one less, as it is, or one more.
vec3 count_hidden(ivec2 pixel, float middle) {
    return texelFetch(hidden, pixel, 0).xyz + n_spots * step(vec3(1.5, 0.5, -0.5), vec3(middle));
}

float find_coverage(ivec2 pixel, int more) {
    float middle = texelFetch(hard, pixel, 0).r, k = middle + float(more);
    vec2 sum = texelFetch(sums, pixel, 0).xy;
    float dark = count_hidden(pixel, middle)[more + 1];
    float total = sum.x + k * n_spots;
    float square = sum.y + 2.0 * float(more) * sum.x + k * k * n_spots;
    float mean = texelFetch(parts, pixel, 0).r + k;
    float spread = square - total * total / n_spots;
    if (spread <= 0.5 / n_spots) {  // all spots are alike
        return total <= n_spots ? clamp(mean, 0.0, 1.0) : 1.0;
    }
    float slope = (total - total * dark / n_spots) / spread;
    return clamp(dark / n_spots + slope * (mean - total / n_spots), 0.0, 1.0);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#ifdef IS_DOUBTED
    if (texelFetch(parts, pixel, 0).g == 0.0) {
        discard;
    }
    float coverage = find_coverage(pixel, 0);
    ivec2 last = textureSize(parts, 0) - 1;
    vec3 counted = count_hidden(pixel, texelFetch(hard, pixel, 0).r);
    // No count is below 0: one more only where some are, one less only where none would be.
    int more = counted.z < n_spots ? 1 : counted.y < n_spots ? 0 : -1;
    vec4 here = texelFetch(keys, pixel, 0);
    float other = find_coverage(pixel, more), own = 1.0, its = 1.0;
    for (int k = 0; k < 9; ++k) {
        ivec2 beside = clamp(pixel + ivec2(k % 3, k / 3) - 1, ivec2(0), last);
        vec4 there = texelFetch(keys, beside, 0);
        vec3 seen = find_seen(gl_FragCoord.xy + vec2(beside - pixel), there.r);
        vec3 apart = seen - find_seen(gl_FragCoord.xy, here.r);
        if (there.r != 0.0 && texelFetch(parts, beside, 0).g == 0.0
            && dot(here.gba, there.gba) > ALIKE
            && abs(dot(here.gba, apart)) < APART * length(seen)) {
            float near = find_coverage(beside, 0);
            own = min(own, abs(coverage - near));
            its = min(its, abs(other - near));
        }
    }
    share = 1.0 - (its < own - BETTER ? other : coverage);
#else
    share = 1.0 - find_coverage(pixel, 0);
#endif
}
