// What one silhouette edge takes from, or adds to, a hard count where a pixel sees: -s Q / area,
// as umbra/soft/coverage.py says; and whether it passes the light's middle within a pixel.
//
// IS_POINT or a direction; IS_SQUARE or a disc.

#include "picture.glsl"
#include "wedge_part.glsl"

uniform sampler2D keys;
uniform samplerBuffer edges;
uniform vec3 eye_high, eye_low;
uniform vec4 light;           // homogeneous, relative to the eye; a direction of length 1
uniform float radius;
uniform vec3 axis_u, axis_v;  // map the light's plane to the unit light
uniform vec3 axis_n;          // its normal

flat in int edge;

layout(location = 0) out vec4 taken;

const int TEXELS = 6;
const float PIXELS = 0.0625;  // a rasteriser's rounding, and some more on slopes
const float NEAREST = 1e-6;  // of the way to the light: nearer edges touch what is seen

vec3 find_end(int place, vec3 seen) {
    return ((texelFetch(edges, TEXELS * edge + place).xyz - eye_high) - eye_low) - seen;
}

void main() {
    float key = texelFetch(keys, ivec2(gl_FragCoord.xy), 0).r;
    if (key == 0.0) {
        discard;
    }
    vec3 seen = find_seen(gl_FragCoord.xy, key);
    vec3 u = axis_u, v = axis_v, n = axis_n;
    vec2 middle = vec2(0.0);
    float unit = radius;  // of the plane, where it has one
#ifdef IS_POINT
    vec3 way = light.xyz - seen;
    float square = dot(way, way);
#ifdef IS_SQUARE
    float depth = dot(n, way);
    if (abs(depth) <= 1e-6 * radius) {
        discard;
    }
    n /= depth;
    v *= depth < 0.0 ? -1.0 : 1.0;  // seen from its other side, the light is mirrored
    middle = vec2(dot(u, way), dot(v, way));
#else
    if (square <= radius * radius) {
        discard;
    }
    // What is seen of the ball is the disc where its tangents meet its plane.
    unit = radius * sqrt(square / (square - radius * radius));
    vec3 ahead = way * inversesqrt(square);
    u = abs(ahead.z) < 0.9 ? vec3(-ahead.y, ahead.x, 0.0) : vec3(0.0, -ahead.z, ahead.y);
    u = normalize(u);
    v = cross(ahead, u) / unit;
    u /= unit;
    n = way / square;
#endif
    const float LIMIT = 1.0;
#else
    const float LIMIT = 1e30;
#endif
    vec3 one = find_end(0, seen), two = find_end(1, seen);
    vec3 start = vec3(dot(u, one), dot(v, one), dot(n, one));
    vec3 end = vec3(dot(u, two), dot(v, two), dot(n, two));
    start.xy -= middle * start.z;
    end.xy -= middle * end.z;
    if (max(start.z, end.z) <= NEAREST || min(start.z, end.z) >= LIMIT) {
        discard;
    }
    // Clip strictly between what is seen and the light.
    float rise = end.z - start.z;
    float r0 = start.z < NEAREST ? (NEAREST - start.z) / rise : 0.0;
    float r1 = end.z < NEAREST ? (NEAREST - start.z) / rise : 1.0;
    r0 = start.z > LIMIT ? (LIMIT - start.z) / rise : r0;
    r1 = end.z > LIMIT ? (LIMIT - start.z) / rise : r1;
    vec3 from = mix(start, end, r0), to = mix(start, end, r1);
    vec2 a = from.xy / max(from.z, NEAREST), b = to.xy / max(to.z, NEAREST);
    vec3 line = cross(start, end);  // on which both lie, wound as from a to b
    float part = find_part(line, a, b);
    // A pixel's side, as the light's plane sees it move.
    float wide = length(across) * (is_perspective ? 1.0 / key : 1.0);
    float slack = PIXELS * wide / (unit * max(min(from.z, to.z), NEAREST));
    bool passes = part > 0.0 && abs(line.z) <= slack * length(line.xy);
    taken = vec4(line.z > 0.0 ? -part : part, passes ? 1.0 : 0.0, 0.0, 0.0);
}
