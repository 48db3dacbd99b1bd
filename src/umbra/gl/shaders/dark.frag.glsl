// The picture as it is in shadow.

#include "samples.glsl"

uniform PICTURE dark;

layout(location = 0) out vec4 color;

void main() {
    color = texelFetch(dark, ivec2(gl_FragCoord.xy), which);
}
