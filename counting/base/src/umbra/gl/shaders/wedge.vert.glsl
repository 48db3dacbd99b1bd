// Penumbra wedges as polyhedra: an edge, and four rays from its ends away from the light.
//
// The rays are where the wedge's planes meet. An edge whose line meets the light has no
// planes; it fills the picture. Rays that all go down end at the bottom, below all that is seen. Faces are wound outward, and only backs are drawn: a
// polyhedron covers a pixel once, also with the eye in it.

uniform samplerBuffer edges;       // for each: its ends, the outward normals of four planes, more
uniform vec3 eye_high, eye_low;    // the eye in the scene's frame, in two parts
uniform mat4 projection;
uniform vec4 light;                // homogeneous, relative to the eye
uniform float reach;               // how long rays are; 0: to infinity
uniform float bottom;              // z relative to the eye, below all that is seen

invariant gl_Position;
flat out int edge;

#include "wedge_row.glsl"

const int CORNERS[24] = int[24](0, 2, 4, 0, 4, 1, 1, 5, 3, 1, 3, 0,
                                0, 3, 2, 1, 4, 5, 2, 3, 5, 2, 5, 4);

#ifdef REVERSED
const float FARTHEST = 0.0;
#else
const float FARTHEST = 1.0;
#endif

const float STEEPEST = -0.02;      // the slope of a ray that may end at the bottom

vec3 fetch(int place) {
    return texelFetch(edges, TEXELS * edge + place).xyz;
}

vec3 find_end(bool at_a) {
    return (fetch(at_a ? 0 : 1) - eye_high) - eye_low;
}

vec3 find_way(bool at_a, bool is_front) {
    vec3 way = normalize(cross(fetch(is_front ? 2 : 3), fetch(at_a ? 4 : 5)));
    return way * (dot(way, light.xyz - light.w * find_end(at_a)) > 0.0 ? -1.0 : 1.0);
}

void main() {
    edge = gl_VertexID / 24;
    int number = gl_VertexID % 24, corner = CORNERS[number];
    bool at_a = corner % 2 == 0 ? corner != 4 : corner == 3, is_front = corner % 2 == 0;
    if (fetch(2) == vec3(0.0)) {
        vec2 at = vec2(number == 2 ? 3.0 : -1.0, number == 1 ? 3.0 : -1.0);
        gl_Position = vec4(number < 3 ? at : vec2(0.0), FARTHEST, 1.0);
        return;
    }
    vec3 end = find_end(at_a);
    vec4 place = vec4(end, 1.0);
    if (corner > 1) {
        vec3 way = find_way(at_a, is_front);
        float slope = max(max(find_way(true, true).z, find_way(true, false).z),
                          max(find_way(false, true).z, find_way(false, false).z));
        if (slope < STEEPEST) {
            place = vec4(end + (bottom - end.z) / way.z * way, 1.0);
        } else {
            place = reach > 0.0 ? vec4(end + reach * way, 1.0) : vec4(way, 0.0);
        }
    }
    gl_Position = projection * place;
}
