// The sky where nothing is seen, in shadow as in light.

#include "color.glsl"
#include "sky.glsl"

layout(location = 0) out vec4 lit;
layout(location = 1) out vec4 dark;

void main() {
    vec4 color = vec4(encode(find_sky(gl_FragCoord.y)), 1.0);
    lit = color;
    dark = color;
}
