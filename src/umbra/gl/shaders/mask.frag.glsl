// Let pass where the count is not 0: the stencil then marks what is in shadow.

uniform sampler2D counts;

void main() {
    if (texelFetch(counts, ivec2(gl_FragCoord.xy), 0).r == 0.0) {
        discard;
    }
}
