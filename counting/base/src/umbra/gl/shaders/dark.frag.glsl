// The picture as it is in shadow; SPARES_TURNED: but where its alpha is 0.

#include "samples.glsl"

uniform PICTURE dark;

layout(location = 0) out vec4 color;

void main() {
    vec4 shown = texelFetch(dark, ivec2(gl_FragCoord.xy), which);
#ifdef SPARES_TURNED
    if (shown.a < 0.5) {
        discard;
    }
#endif
    color = vec4(shown.rgb, 1.0);
}
