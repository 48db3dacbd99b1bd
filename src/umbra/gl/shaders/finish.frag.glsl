// From linear light to the picture's sRGB, and the sky where nothing is seen.

#include "color.glsl"

uniform sampler2D light;
uniform vec3 sky, horizon;  // at the top of the picture and at its foot
uniform vec2 size;

layout(location = 0) out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 lit = texelFetch(light, pixel, 0);
    // What is transparent may stand before the sky: it has left its share of opacity.
    float fade = 1.0 - clamp((gl_FragCoord.y - 0.5) / max(size.y - 1.0, 1.0), 0.0, 1.0);
    vec3 behind = mix(sky, horizon, fade) * (1.0 - lit.a);
    color = vec4(encode(clamp(lit.rgb + behind, 0.0, 1.0)), 1.0);
}
