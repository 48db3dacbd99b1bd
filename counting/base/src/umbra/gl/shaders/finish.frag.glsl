// From linear light to the picture's sRGB, and the sky where nothing is seen. IS_LAID: layers that
// were laid over one another as they are shown.

#include "color.glsl"
#include "samples.glsl"
#include "sky.glsl"

uniform PICTURE light;
uniform PICTURE faces;  // how rough; UNLIT where colours are shown as they are

layout(location = 0) out vec4 color;

void main() {
    vec4 lit = texelFetch(light, ivec2(gl_FragCoord.xy), which);
#ifdef IS_LAID
    vec3 shown = lit.rgb;
#else
    bool is_unlit = texelFetch(faces, ivec2(gl_FragCoord.xy), which).w == UNLIT;
    vec3 shown = is_unlit ? lit.rgb : compress(lit.rgb);
#endif
    // What is transparent may stand before the sky: it has left its share of opacity.
    vec3 behind = find_sky(gl_FragCoord.y) * (1.0 - lit.a);
    color = vec4(encode(shown + behind), 1.0);
}
