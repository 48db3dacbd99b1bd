// One triangle over the whole picture; IS_FAR puts it behind everything.

#if defined(IS_FAR) && !defined(REVERSED)
const float DEPTH = 1.0;
#else
const float DEPTH = 0.0;
#endif

void main() {
    vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(at, DEPTH, 1.0);
}
