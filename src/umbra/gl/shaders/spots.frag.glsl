// What the counts of some spots of the light add up to, if the count at its middle is the hard one,
// one less or one more. A texture holds 4 * DIGITS of them, see wedge.frag.glsl.

uniform sampler2D hard;
uniform sampler2D counts;
uniform int n_spots;  // of this texture

layout(location = 0) out vec4 hidden;  // spots that are hidden, by one less, as it is, one more
layout(location = 1) out vec4 sums;    // of counts, of their squares

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float middle = texelFetch(hard, pixel, 0).r, bias = 0.0;
    for (int d = 0; d < DIGITS; ++d) {
        bias = bias * BASE + 0.5 * BASE;
    }
    vec4 left = texelFetch(counts, pixel, 0) + bias;
    hidden = sums = vec4(0.0);
    for (int d = 0; d < DIGITS; ++d) {
        vec4 rest = floor(left / BASE);
        vec4 count = left - rest * BASE - 0.5 * BASE + middle;
        left = rest;
        vec4 used = vec4(lessThan(4.0 * float(d) + vec4(0.0, 1.0, 2.0, 3.0), vec4(n_spots)));
        hidden.x += dot(used, step(1.5, count));
        hidden.y += dot(used, step(0.5, count));
        hidden.z += dot(used, step(-0.5, count));
        sums.x += dot(used, count);
        sums.y += dot(used, count * count);
    }
}
