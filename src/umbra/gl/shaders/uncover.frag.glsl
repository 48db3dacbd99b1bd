// What share of a light is seen: 1 - coverage, which is the hard count and what edges take of it.
//
// Where an edge passes the light's middle the count may stand on the other side than the
// edge, by the rasteriser's rounding. That is wrong by a whole, and of one edge half is taken
// there: what is left is -1/2 or 3/2. As coverage is continuous, what is near tells which is right.

uniform sampler2D counts;
uniform sampler2D parts;  // sums of what edges take; how many pass the light's middle

layout(location = 0) out float share;

const float NEAR = 0.1;

float find_coverage(ivec2 pixel) {
    return texelFetch(counts, pixel, 0).r + texelFetch(parts, pixel, 0).r;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(parts, 0) - 1;
    float coverage = find_coverage(pixel);
    // A count above 1 makes 3/2 by itself: casters overlap.
    bool is_suspect = abs(abs(coverage - 0.5) - 1.0) < NEAR && texelFetch(counts, pixel, 0).r < 1.5;
    if (is_suspect && texelFetch(parts, pixel, 0).g > 0.0) {
        float other = coverage + (coverage < 0.0 ? 1.0 : -1.0), sum = 0.0;
        for (int k = 0; k < 9; ++k) {
            ivec2 near = clamp(pixel + ivec2(k % 3, k / 3) - 1, ivec2(0), last);
            sum += k == 4 ? 0.0 : clamp(find_coverage(near), 0.0, 1.0) / 8.0;
        }
        coverage = abs(sum - other) < abs(sum - clamp(coverage, 0.0, 1.0)) ? other : coverage;
    }
    share = 1.0 - clamp(coverage, 0.0, 1.0);
}
