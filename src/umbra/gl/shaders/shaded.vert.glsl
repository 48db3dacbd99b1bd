// The scene's own triangles with what their points carry.

#include "place.glsl"

uniform samplerBuffer normals;  // in the mesh's frame; 0 where a face is flat
uniform samplerBuffer uvs;
uniform samplerBuffer tints;

invariant gl_Position;
out vec3 at;      // relative to the eye
#ifdef HAS_NORMALS
out vec3 normal;
#endif
#ifdef HAS_UV
out vec2 uv;
#endif
#ifdef HAS_TINTS
out vec3 tint;
#endif

void main() {
    int point = gl_VertexID >> 1;
    ivec2 block = texelFetch(blocks, point >> BLOCK_BITS).xy;
    int stored = point + block.x;
    at = find_point(point);
#ifdef HAS_NORMALS
    normal = texelFetch(normals, stored).xyz;
    if (block.y >= 0) {
        // Normals move by the cofactors, which also hold for uneven scales and mirrors.
        vec3 a = texelFetch(transforms, 3 * block.y).xyz;
        vec3 b = texelFetch(transforms, 3 * block.y + 1).xyz;
        vec3 c = texelFetch(transforms, 3 * block.y + 2).xyz;
        normal = vec3(dot(cross(b, c), normal), dot(cross(c, a), normal), dot(cross(a, b), normal));
    }
#endif
#ifdef HAS_UV
    uv = texelFetch(uvs, stored).xy;
#endif
#ifdef HAS_TINTS
    tint = texelFetch(tints, stored).rgb;
#endif
    gl_Position = projection * vec4(at, 1.0);
}
