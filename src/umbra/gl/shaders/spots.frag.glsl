// By what edges change what the counts of some spots of the light add up to, if the count at its
// middle is the hard one, one less or one more. A texture holds 4 * DIGITS spots, see wedge.frag.glsl.

uniform sampler2D hard;
uniform sampler2D counts0, counts1, counts2, counts3, counts4, counts5, counts6;
uniform int n_spots;

layout(location = 0) out vec4 hidden;  // spots that are hidden, by one less, as it is, one more
layout(location = 1) out vec4 sums;    // of counts, of their squares

void add(vec4 left, int n, float middle) {
    float bias = 0.0;
    for (int d = 0; d < DIGITS; ++d) {
        bias = bias * BASE + 0.5 * BASE;
    }
    left += bias;
    for (int d = 0; d < DIGITS; ++d) {
        vec4 rest = floor(left / BASE);
        vec4 count = left - rest * BASE - 0.5 * BASE + middle;
        left = rest;
        vec4 used = vec4(lessThan(4.0 * float(d) + vec4(0.0, 1.0, 2.0, 3.0), vec4(n)));
        hidden.x += dot(used, step(1.5, count) - step(1.5, middle));
        hidden.y += dot(used, step(0.5, count) - step(0.5, middle));
        hidden.z += dot(used, step(-0.5, count) - step(-0.5, middle));
        sums.x += dot(used, count - middle);
        sums.y += dot(used, count * count - middle * middle);
    }
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float middle = texelFetch(hard, pixel, 0).r;
    hidden = sums = vec4(0.0);
#if PICTURES > 0
    add(texelFetch(counts0, pixel, 0), n_spots - 0 * 4 * DIGITS, middle);
#endif
#if PICTURES > 1
    add(texelFetch(counts1, pixel, 0), n_spots - 1 * 4 * DIGITS, middle);
#endif
#if PICTURES > 2
    add(texelFetch(counts2, pixel, 0), n_spots - 2 * 4 * DIGITS, middle);
#endif
#if PICTURES > 3
    add(texelFetch(counts3, pixel, 0), n_spots - 3 * 4 * DIGITS, middle);
#endif
#if PICTURES > 4
    add(texelFetch(counts4, pixel, 0), n_spots - 4 * 4 * DIGITS, middle);
#endif
#if PICTURES > 5
    add(texelFetch(counts5, pixel, 0), n_spots - 5 * 4 * DIGITS, middle);
#endif
#if PICTURES > 6
    add(texelFetch(counts6, pixel, 0), n_spots - 6 * 4 * DIGITS, middle);
#endif
}
