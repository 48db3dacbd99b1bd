// Let pass what has a smooth normal, other than its face's.

#include "lamp.glsl"
#include "samples.glsl"

uniform PICTURE places;
uniform PICTURE faces;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 seen = texelFetch(places, pixel, which);
    if (seen.w == 0.0 || !is_smooth(seen.xyz, texelFetch(faces, pixel, which).xyz)) {
        discard;
    }
}
