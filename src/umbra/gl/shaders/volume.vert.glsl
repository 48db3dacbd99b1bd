// Sides and caps of shadow volumes.

#include "place.glsl"

invariant gl_Position;
out float gl_ClipDistance[1];

void main() {
    gl_Position = projection * find_place(gl_VertexID);
    gl_ClipDistance[0] = gl_Position.z + gl_Position.w;  // the near plane, where it must clip
}
