// Which component is seen.

uniform isamplerBuffer components;  // of each face of the list

layout(location = 0) out int component;

void main() {
    component = texelFetch(components, gl_PrimitiveID).r;
}
