// Sides and caps of shadow volumes.

#include "place.glsl"

invariant gl_Position;
#ifdef CLIP_NEAR
out float gl_ClipDistance[1];
#endif

void main() {
    gl_Position = projection * find_place(gl_VertexID);
#ifdef CLIP_NEAR
    gl_ClipDistance[0] = gl_Position.z + gl_Position.w;  // the near plane, while depth is clamped
#endif
}
