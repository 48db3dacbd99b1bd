// Penumbra wedges as polyhedra: an edge, and four rays from its ends away from the light.
//
// The rays are where the wedge's planes meet. An edge whose line meets the light has no
// planes; it fills the picture. Faces are wound outward, and only backs are drawn: a
// polyhedron covers a pixel once, also with the eye in it.

uniform samplerBuffer edges;       // for each: its ends, the outward normals of four planes, more
uniform vec3 eye_high, eye_low;    // the eye in the scene's frame, in two parts
uniform mat4 projection;
uniform vec4 light;                // homogeneous, relative to the eye
uniform float reach;               // how long rays are; 0: to infinity

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

vec3 fetch(int place) {
    return texelFetch(edges, TEXELS * edge + place).xyz;
}

void main() {
    edge = gl_VertexID / 24;
    int number = gl_VertexID % 24, corner = CORNERS[number];
    bool at_a = corner % 2 == 0 ? corner != 4 : corner == 3;
    vec3 end = (fetch(at_a ? 0 : 1) - eye_high) - eye_low;
    vec3 side = fetch(corner % 2 == 0 ? 2 : 3);
    if (side == vec3(0.0)) {
        vec2 at = vec2(number == 2 ? 3.0 : -1.0, number == 1 ? 3.0 : -1.0);
        gl_Position = vec4(number < 3 ? at : vec2(0.0), FARTHEST, 1.0);
        return;
    }
    vec4 place = vec4(end, 1.0);
    if (corner > 1) {
        vec3 way = normalize(cross(side, fetch(at_a ? 4 : 5)));
        way *= dot(way, light.xyz - light.w * end) > 0.0 ? -1.0 : 1.0;
        place = reach > 0.0 ? vec4(end + reach * way, 1.0) : vec4(way, 0.0);
    }
    gl_Position = projection * place;
}
