// One triangle over the whole picture; IS_FAR puts it behind everything. ARE_MANY: rectangles instead,
// one for each of some lamps.

#if defined(IS_FAR) && !defined(REVERSED)
const float DEPTH = 1.0;
#else
const float DEPTH = 0.0;
#endif

#ifdef ARE_MANY
#include "many.glsl"
uniform vec4 rectangles[MOST_LAMPS];  // left, bottom, right, top
flat out int lamp_number;

void main() {
    lamp_number = gl_VertexID / 6;
    int corner = gl_VertexID % 6;
    vec4 sides = rectangles[lamp_number];
    vec2 at = vec2(corner == 1 || corner == 2 || corner == 4 ? sides.z : sides.x,
                   corner == 2 || corner >= 4 ? sides.w : sides.y);
    gl_Position = vec4(at, DEPTH, 1.0);
}
#else
void main() {
    vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(at, DEPTH, 1.0);
}
#endif
