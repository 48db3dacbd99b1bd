// What one silhouette edge takes from, or adds to, a hard count where a pixel sees: s Q multiplicity
// / area, as umbra/soft/wedges.py says; and whether it passes the light's middle within a pixel. The
// silhouette is the one that the pixel's surface sees.
//
// IS_POINT or a direction; IS_SQUARE or a disc. HAS_SPOTS: the edge also adds to the counts of spots
// of the light, as umbra/soft/complexity.py says. A float holds DIGITS counts, in a base of BASE.

#include "picture.glsl"
#include "wedge_part.glsl"
#include "wedge_row.glsl"

uniform sampler2D keys;
uniform samplerBuffer edges;
uniform vec3 eye_high, eye_low;
uniform vec4 light;           // homogeneous, relative to the eye; a direction of length 1
uniform float radius;
uniform vec3 axis_u, axis_v;  // map the light's plane to the unit light
uniform vec3 axis_n;          // its normal

flat in int edge;

layout(location = 0) out vec4 taken;

const float PIXELS = 0.0625;  // a rasteriser's rounding, and some more on slopes
const float CONTACT = 2.0;  // radii; an edge that a pixel's side moves by more touches what is seen
const float NEAREST = 1e-6;  // of the way to the light: nearer edges touch what is seen

const float BEFORE = 1e-5;  // of its depth: so far before its surface a pixel is to see its own face

// The multiplicity along the faces that are seen from their outer side.
float find_multiplicity(vec3 start, float half_weight, float turn) {
    float one = sign(-dot(texelFetch(edges, TEXELS * edge + 6).xyz, start));
    float two = sign(-dot(texelFetch(edges, TEXELS * edge + 7).xyz, start));
    return half_weight * (one - turn * two);
}

#ifdef HAS_SPOTS
uniform vec4 spots_x[PICTURES * DIGITS], spots_y[PICTURES * DIGITS];
layout(location = 1) out vec4 counts[PICTURES];

void add_to_spots(vec3 line, vec2 a, vec2 b, float times) {
    bvec4 inside = bvec4(line.z > 0.0);
    vec4 sums[PICTURES];
    for (int k = 0; k < PICTURES; ++k) {
        vec4 sum = vec4(0.0);
        for (int d = DIGITS - 1; d >= 0; --d) {
            vec4 x = spots_x[k * DIGITS + d], y = spots_y[k * DIGITS + d];
            bvec4 left = greaterThan(a.x * y - a.y * x, vec4(0.0));
            bvec4 right = greaterThan(b.x * y - b.y * x, vec4(0.0));
            bvec4 beyond = greaterThan(line.x * x + line.y * y + line.z, vec4(0.0));
            sum = sum * BASE + vec4(notEqual(left, right)) * vec4(notEqual(beyond, inside));
        }
        sums[k] = sum;
    }
    // Strict compilers index outputs by constants alone: the last one is written again.
#define PUT(k) counts[min(k, PICTURES - 1)] = times * sums[min(k, PICTURES - 1)]
    PUT(0); PUT(1); PUT(2); PUT(3); PUT(4); PUT(5); PUT(6);
}
#endif

vec4 find_end(int place) {
    vec4 end = texelFetch(edges, TEXELS * edge + place);
    return vec4((end.xyz - eye_high) - eye_low, end.w);
}

void main() {
    vec4 at = texelFetch(keys, ivec2(gl_FragCoord.xy), 0);
    float key = at.r;
    if (key == 0.0) {
        discard;
    }
    vec3 seen = find_seen(gl_FragCoord.xy, key);
    vec4 first = find_end(0), second = find_end(1);
    vec3 before = BEFORE * (is_perspective ? 1.0 / key : length(seen)) * at.gba;
    float times = find_multiplicity(first.xyz - seen - before, first.w, second.w);
    if (times == 0.0) {
        discard;
    }
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
    vec3 one = first.xyz - seen, two = second.xyz - seen;
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
    if (part <= 0.0) {
        discard;
    }
    // How far a pixel's side moves the edge, where it passes nearest to the middle. Pixels beside
    // one that the edge touches may see all of the light or none, and tell nothing.
    vec2 run = b - a;
    float there = clamp(-dot(a, run) / max(dot(run, run), 1e-30), 0.0, 1.0);
    float away = 1.0 / mix(1.0 / max(from.z, NEAREST), 1.0 / max(to.z, NEAREST), there);
    float wide = length(across) * (is_perspective ? 1.0 / key : 1.0) / (unit * away);
    bool passes = wide < CONTACT && abs(line.z) <= PIXELS * wide * length(line.xy);
    // Wound along the faces that the surface sees, not those that the light does.
    times *= line.z > 0.0 ? 1.0 : -1.0;
    taken = vec4(times * part, passes ? 1.0 : 0.0, 0.0, 0.0);
#ifdef HAS_SPOTS
    add_to_spots(line, from.xy, to.xy, times);
#endif
}
