// A layer as it is shown, to be laid over what is behind it.

#include "color.glsl"

uniform sampler2D light;  // on the layer, and its opacity
uniform sampler2D faces;  // how rough; UNLIT where colours are shown as they are

layout(location = 0) out vec4 shown;

void main() {
    vec4 lit = texelFetch(light, ivec2(gl_FragCoord.xy), 0);
    bool is_unlit = texelFetch(faces, ivec2(gl_FragCoord.xy), 0).w == UNLIT;
    shown = vec4(lit.a * (is_unlit ? lit.rgb : compress(lit.rgb)), lit.a);
}
