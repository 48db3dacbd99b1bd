// What one light adds where it reaches, or as much of it as a share says (HAS_SHARE).

#include "color.glsl"
#include "picture.glsl"
#include "lamp.glsl"
#include "samples.glsl"

uniform PICTURE places;      // normals and depth keys
uniform PICTURE albedos;
uniform sampler2D shares;    // what part of the light reaches each pixel

layout(location = 0) out vec4 added;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 seen = texelFetch(places, pixel, which);
    vec3 lamplight = find_lamplight(find_seen(gl_FragCoord.xy, seen.w), seen.xyz);
#ifdef HAS_SHARE
    lamplight *= texelFetch(shares, pixel, 0).r;
#endif
    vec3 albedo = unpack(texelFetch(albedos, pixel, which).rgb);
    added = seen.w == 0.0 ? vec4(0.0) : vec4(lamplight * albedo, 0.0);
}
