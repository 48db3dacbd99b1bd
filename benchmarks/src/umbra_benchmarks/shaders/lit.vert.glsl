#version 330 core
// Whether the light sees a face's front: asked once, so that all its edges agree.

uniform samplerBuffer places;   // place and normal of each vertex
uniform isamplerBuffer faces;
uniform vec4 light;             // homogeneous

out float is_lit;

vec3 find_corner(int corner) {
    return texelFetch(places, 2 * texelFetch(faces, 3 * gl_VertexID + corner).x).xyz;
}

void main() {
    vec3 a = find_corner(0), b = find_corner(1), c = find_corner(2);
    is_lit = dot(cross(b - a, c - a), light.xyz - light.w * a) > 0.0 ? 1.0 : 0.0;
}
