#version 330 core
// An edge between a lit and an unlit face, wound as in the lit one; how often it throws a side.

uniform samplerBuffer lit;
uniform isamplerBuffer edges;   // two vertices, two faces
uniform isamplerBuffer weights;

flat out ivec3 side;

void main() {
    ivec4 edge = texelFetch(edges, gl_VertexID);
    bool one = texelFetch(lit, edge.z).x > 0.5, two = texelFetch(lit, edge.w).x > 0.5;
    int times = one != two ? texelFetch(weights, gl_VertexID).x : 0;
    bool forward = (times > 0) == one;
    side = ivec3(forward ? edge.xy : edge.yx, abs(times));
}
