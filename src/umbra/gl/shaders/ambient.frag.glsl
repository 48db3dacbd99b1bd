// The frame's first pass: what surfaces give off by themselves and what the sky lends them.

#include "color.glsl"

uniform sampler2D normals, keys, albedos, glows;
uniform float ambient;       // on a white surface that looks up; half as much looking down
uniform vec3 sky, horizon;   // behind everything, from the top of the picture to its foot
uniform vec2 size;

layout(location = 0) out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texelFetch(keys, pixel, 0).r == 0.0) {
        float fade = 1.0 - clamp((gl_FragCoord.y - 0.5) / max(size.y - 1.0, 1.0), 0.0, 1.0);
        color = vec4(mix(sky, horizon, fade), 1.0);
        return;
    }
    float upward = texelFetch(normals, pixel, 0).z;
    vec3 albedo = unpack(texelFetch(albedos, pixel, 0).rgb);
    color = vec4(texelFetch(glows, pixel, 0).rgb + albedo * ambient * (0.75 + 0.25 * upward), 1.0);
}
