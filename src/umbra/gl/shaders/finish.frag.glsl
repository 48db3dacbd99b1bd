// From linear light to the picture's sRGB.

#include "color.glsl"

uniform sampler2D light;

layout(location = 0) out vec4 color;

void main() {
    vec3 linear = texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb;
    color = vec4(encode(clamp(linear, 0.0, 1.0)), 1.0);
}
