#version 330 core
// Two triangles of vertex numbers for each side; an odd number is a point's far end.

layout(points) in;
layout(points, max_vertices = 24) out;

flat in ivec3 side[];
flat out int number;

void put(int vertex) {
    number = vertex;
    EmitVertex();
    EndPrimitive();
}

void main() {
    int a = 2 * side[0].x, b = 2 * side[0].y;
    for (int k = 0; k < min(side[0].z, 4); ++k) {
        put(b);
        put(a);
        put(a + 1);
        put(b);
        put(a + 1);
        put(b + 1);
    }
}
