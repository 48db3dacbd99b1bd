// Sides and caps of shadow volumes.

#include "place.glsl"

uniform vec4 near_plane;  // that was asked for, while depth is clamped at another

invariant gl_Position;
out float gl_ClipDistance[1];

void main() {
    vec4 place = find_place(gl_VertexID);
    gl_Position = projection * place;
    gl_ClipDistance[0] = dot(near_plane, place);
}
