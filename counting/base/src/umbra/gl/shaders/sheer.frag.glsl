// Which transmitting triangle is seen, where it is no hole and, HAS_BEFORE, lies behind what was
// seen before.

#include "picture.glsl"
#include "transmission.glsl"

uniform int first;         // number of the draw's first face
uniform sampler2D nearer;  // depth key and row of what was seen before; nothing lies behind -inf

layout(location = 0) out int face;

const float STEP = 1.0 / 1048576.0;  // of a key: what is nearer is as far

void main() {
    int row = gl_PrimitiveID;
    vec3 ray = find_ray(gl_FragCoord.xy);
    vec3 start = is_perspective ? vec3(0.0) : ray, way = is_perspective ? ray : forward;
    vec3 weights = find_sides(row, start, way);
    float total = weights.x + weights.y + weights.z;
    vec3 color;
    if (total == 0.0 || find_cover(row, weights / total, color) <= 0.0) {
        discard;
    }
#ifdef HAS_BEFORE
    vec3 a = find_corner(row, 0);
    vec3 normal = cross(find_corner(row, 1) - a, find_corner(row, 2) - a);
    float along = dot(normal, way), away = dot(normal, a - start);
    float key = is_perspective ? along / away : -away / along;
    vec2 hidden = texelFetch(nearer, ivec2(gl_FragCoord.xy), 0).xy;
    if (int(hidden.y) == row || key >= hidden.x - STEP * abs(hidden.x)) {
        discard;
    }
#endif
    face = first + row;
}
