// What is left of a light at each visible place, and how many triangles hide it.

#include "transmission.glsl"

uniform sampler2D places;  // relative to the eye; w is 0 where nothing is seen
uniform vec4 lamp;         // homogeneous, relative to the eye

layout(location = 0) out vec4 left;

void main() {
    vec4 place = texelFetch(places, ivec2(gl_FragCoord.xy), 0);
    left = place.w == 0.0 ? vec4(1.0, 1.0, 1.0, 0.0) : trace_light(place.xyz, lamp);
}
