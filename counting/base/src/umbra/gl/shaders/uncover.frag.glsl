// What share of a light is seen: 1 - coverage, which is the hard count and what edges take of it.
//
// Where an edge passes the light's middle the count may stand on the other side than the
// edge, by the rasteriser's rounding. That is wrong by a whole, and of one edge half is taken
// there: what is left is -1/2 or 3/2. As coverage is continuous, what is nearest to it of the pixels
// beside that are in no doubt tells which is right: some may lie on another surface.

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
        float other = coverage + (coverage < 0.0 ? 1.0 : -1.0), own = 1.0, its = 1.0;
        for (int k = 0; k < 9; ++k) {
            ivec2 beside = clamp(pixel + ivec2(k % 3, k / 3) - 1, ivec2(0), last);
            if (texelFetch(parts, beside, 0).g == 0.0) {
                float near = clamp(find_coverage(beside), 0.0, 1.0);
                own = min(own, abs(clamp(coverage, 0.0, 1.0) - near));
                its = min(its, abs(other - near));
            }
        }
        coverage = its < own ? other : coverage;
    }
    share = 1.0 - clamp(coverage, 0.0, 1.0);
}
