// Which face is seen.

uniform int first;  // number of the draw's first face
uniform int step;   // 1, or 0 where all that is drawn is one thing

layout(location = 0) out int face;

void main() {
    face = first + step * gl_PrimitiveID;
}
