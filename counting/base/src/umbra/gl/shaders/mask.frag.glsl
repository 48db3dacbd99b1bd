// Let pass where the count is not 0: the stencil then marks what is in shadow.

#include "samples.glsl"

uniform PICTURE counts;

void main() {
    if (texelFetch(counts, ivec2(gl_FragCoord.xy), which).r == 0.0) {
        discard;
    }
}
