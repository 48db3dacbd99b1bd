// Sides and caps of shadow volumes.

#include "place.glsl"
#include "near.glsl"

uniform float before;  // the depth buffer's near plane volumes begin, for their distance there

invariant gl_Position;
out float gl_ClipDistance[1];

void main() {
    gl_Position = projection * find_place(gl_VertexID);
    // Where both planes are one, to the bit as the rasteriser clips surfaces.
    gl_ClipDistance[0] = find_distance(gl_Position) + before * gl_Position.w;
}
