// Edges as strips of two triangles, so wide on the picture however far they are.

#include "place.glsl"
#include "near.glsl"

uniform isamplerBuffer edges;  // two vertex numbers each
uniform vec2 size;             // of the picture
uniform float width;           // in pixels

invariant gl_Position;

const float NEARER = 0.9985;   // toward the eye, so that its own faces do not hide an edge
const ivec2 CORNERS[6] = ivec2[6](ivec2(0, -1), ivec2(0, 1), ivec2(1, -1),
                                  ivec2(1, -1), ivec2(0, 1), ivec2(1, 1));

void main() {
    ivec2 ends = texelFetch(edges, gl_VertexID / 6).xy;
    ivec2 corner = CORNERS[gl_VertexID % 6];
    vec4 a = projection * vec4(NEARER * find_point(ends.x >> 1), 1.0);
    vec4 b = projection * vec4(NEARER * find_point(ends.y >> 1), 1.0);
    float before_a = find_distance(a), before_b = find_distance(b);
    if (before_a <= 0.0 && before_b <= 0.0) {
        gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
        return;
    }
    // What lies before the near plane has no place on the picture: cut it off.
    if (before_a < 0.0) {
        a = mix(a, b, before_a / (before_a - before_b));
    } else if (before_b < 0.0) {
        b = mix(b, a, before_b / (before_b - before_a));
    }
    vec2 along = (b.xy / b.w - a.xy / a.w) * size;
    float apart = length(along);
    along = apart > 0.0 ? along / apart : vec2(1.0, 0.0);
    vec4 end = corner.x == 0 ? a : b;
    end.xy += float(corner.y) * width * vec2(-along.y, along.x) / size * end.w;
    gl_Position = end;
}
