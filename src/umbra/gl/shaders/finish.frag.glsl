// From linear light to the picture's sRGB, and the sky where nothing is seen.

#include "color.glsl"
#include "samples.glsl"
#include "sky.glsl"

uniform PICTURE light;

layout(location = 0) out vec4 color;

void main() {
    vec4 lit = texelFetch(light, ivec2(gl_FragCoord.xy), which);
    // What is transparent may stand before the sky: it has left its share of opacity.
    vec3 behind = find_sky(gl_FragCoord.y) * (1.0 - lit.a);
    color = vec4(encode(lit.rgb + behind), 1.0);
}
