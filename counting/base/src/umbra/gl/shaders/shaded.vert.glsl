// The scene's own triangles with what their points carry. BY_POINT: drawn by numbers of points, of
// which a device keeps twice as many as of vertices of volumes.

#include "place.glsl"

uniform samplerBuffer normals;  // in the mesh's frame; 0 where a face is flat
uniform samplerBuffer uvs;
uniform samplerBuffer tints;
uniform samplerBuffer tangents;  // in the mesh's frame, and their hands
uniform samplerBuffer more_uvs;  // of images with a uv_set of 1

invariant gl_Position;
out vec3 at;      // relative to the eye
#ifdef HAS_NORMALS
centroid out vec3 normal;
#endif
#ifdef HAS_UV
out vec2 uv;
#endif
#ifdef HAS_UV2
out vec2 uv2;
#endif
#ifdef HAS_TINTS
out vec4 tint;
#endif
#ifdef HAS_TANGENTS
out vec4 tangent;
#endif

void main() {
#ifdef BY_POINT
    int point = gl_VertexID;
#else
    int point = gl_VertexID >> 1;
#endif
    ivec2 block = texelFetch(blocks, point >> BLOCK_BITS).xy;
    int stored = point + block.x;
    at = find_point(point);
    vec3 a = vec3(1.0, 0.0, 0.0), b = vec3(0.0, 1.0, 0.0), c = vec3(0.0, 0.0, 1.0);
    if (block.y >= 0) {
        a = texelFetch(transforms, 3 * block.y).xyz;
        b = texelFetch(transforms, 3 * block.y + 1).xyz;
        c = texelFetch(transforms, 3 * block.y + 2).xyz;
    }
    float mirror = dot(a, cross(b, c)) < 0.0 ? -1.0 : 1.0;
#ifdef HAS_NORMALS
    normal = texelFetch(normals, stored).xyz;
    // Normals move by the cofactors, which also hold for uneven scales.
    normal = vec3(dot(cross(b, c), normal), dot(cross(c, a), normal), dot(cross(a, b), normal));
    normal *= mirror;
#endif
#ifdef HAS_UV
    uv = texelFetch(uvs, stored).xy;
#endif
#ifdef HAS_UV2
    uv2 = texelFetch(more_uvs, stored).xy;
#endif
#ifdef HAS_TANGENTS
    vec4 way = texelFetch(tangents, stored);
    tangent = vec4(dot(a, way.xyz), dot(b, way.xyz), dot(c, way.xyz), mirror * way.w);
#endif
#ifdef HAS_TINTS
    tint = texelFetch(tints, stored);
#endif
    gl_Position = projection * vec4(at, 1.0);
}
