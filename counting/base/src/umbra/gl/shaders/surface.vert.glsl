// The scene's own triangles.

#include "place.glsl"

invariant gl_Position;

void main() {
    gl_Position = projection * find_place(gl_VertexID);
}
