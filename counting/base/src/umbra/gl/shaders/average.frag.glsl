// A share of the linear light that a picture's samples show.

#include "color.glsl"
#include "samples.glsl"

uniform PICTURE picture;
uniform float share;

layout(location = 0) out vec4 light;

void main() {
    light = vec4(share * decode(texelFetch(picture, ivec2(gl_FragCoord.xy), which).rgb), 1.0);
}
