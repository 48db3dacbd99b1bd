#version 330 core
// A skinned vertex and its normal: each moves by the mean of its joints' matrices.

uniform samplerBuffer rest;         // place and normal of each vertex
uniform isamplerBuffer joints;      // four each
uniform samplerBuffer influences;
uniform samplerBuffer pulls;        // three rows of each joint's matrix

out vec4 place;
out vec4 normal;

void main() {
    ivec4 joint = 3 * texelFetch(joints, gl_VertexID);
    vec4 share = texelFetch(influences, gl_VertexID);
    vec4 rows[3];
    for (int row = 0; row < 3; ++row) {
        rows[row] = vec4(0.0);
        for (int k = 0; k < 4; ++k) {
            rows[row] += share[k] * texelFetch(pulls, joint[k] + row);
        }
    }
    vec4 at = vec4(texelFetch(rest, 2 * gl_VertexID).xyz, 1.0);
    vec3 out_of = texelFetch(rest, 2 * gl_VertexID + 1).xyz;
    place = vec4(dot(rows[0], at), dot(rows[1], at), dot(rows[2], at), 1.0);
    vec3 a = rows[0].xyz, b = rows[1].xyz, c = rows[2].xyz;
    vec3 turned = vec3(dot(cross(b, c), out_of), dot(cross(c, a), out_of), dot(cross(a, b), out_of));
    normal = vec4(normalize(turned), 0.0);
}
