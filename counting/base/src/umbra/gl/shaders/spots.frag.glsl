// By what edges change what the counts of some spots of the light add up to, if the count at its
// middle is the hard one, one less or one more. A texture holds 4 * DIGITS spots, see wedge.frag.glsl.

uniform sampler2D hard;
uniform sampler2D counts0, counts1, counts2, counts3, counts4, counts5, counts6;
uniform int n_spots;

layout(location = 0) out vec4 hidden;  // spots that are hidden, by one less, as it is, one more
layout(location = 1) out vec4 sums;    // of counts, of their squares

void add(vec4 left, int picture, float middle) {
    int n = n_spots - picture * 4 * DIGITS;
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
    // Samplers are indexed by constants alone.
#define ADD(k, counts) if (k < PICTURES) add(texelFetch(counts, pixel, 0), k, middle)
    ADD(0, counts0);
    ADD(1, counts1);
    ADD(2, counts2);
    ADD(3, counts3);
    ADD(4, counts4);
    ADD(5, counts5);
    ADD(6, counts6);
}
