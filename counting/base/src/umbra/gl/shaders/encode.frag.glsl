// Linear light as it is shown.

#include "color.glsl"

uniform sampler2D light;

layout(location = 0) out vec4 color;

void main() {
    color = vec4(encode(texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb), 1.0);
}
