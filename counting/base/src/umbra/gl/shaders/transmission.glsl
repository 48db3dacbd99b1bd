// Light through triangles that are transparent or have holes: umbra/rays/transmission.py in
// float32, where rows, nodes and materials are described. Places are relative to the eye.

#include "texel.glsl"

uniform samplerBuffer sheer_nodes;
uniform samplerBuffer sheer_rows;
uniform samplerBuffer sheer_looks;
uniform samplerBuffer sheer_texels;
uniform int n_sheer_nodes;
uniform vec3 eye_high, eye_low;  // the eye in the scene's frame, in two parts

const float SHEER_TOUCH = 1.0 / 2097152.0;  // of the farthest corner: so near a point lies on a plane
const float MASK = 1.0, BLEND = 2.0;

vec3 find_corner(int row, int corner) {
    return (texelFetch(sheer_rows, 8 * row + corner).xyz - eye_high) - eye_low;
}

vec3 decode_srgb(vec3 srgb) {
    vec3 high = pow((srgb + 0.055) / 1.055, vec3(2.4));
    return mix(high, srgb / 12.92, lessThanEqual(srgb, vec3(0.04045)));
}

vec4 fetch_texel(int start, ivec2 size, int col, int row) {
    vec4 texel = texelFetch(sheer_texels, start + row * size.x + col);
    return vec4(decode_srgb(texel.rgb), round(255.0 * texel.a));
}

// How opaque a triangle is at weights of its corners, 0 in a hole; and its colour.
float find_cover(int row, vec3 weights, out vec3 color) {
    int look = 3 * int(texelFetch(sheer_rows, 8 * row + 1).w);
    vec4 base = texelFetch(sheer_looks, look), kind = texelFetch(sheer_looks, look + 1);
    vec4 image = texelFetch(sheer_looks, look + 2);
    vec4 first = texelFetch(sheer_rows, 8 * row + 5);
    vec4 second = texelFetch(sheer_rows, 8 * row + 6), third = texelFetch(sheer_rows, 8 * row + 7);
    color = base.rgb * (weights.x * first.rgb + weights.y * second.rgb + weights.z * third.rgb);
    float level = 255.0;
    if (image.x > 0.0) {
        vec4 uv = texelFetch(sheer_rows, 8 * row + 3);
        vec2 at = weights.x * uv.xy + weights.y * uv.zw
                  + weights.z * texelFetch(sheer_rows, 8 * row + 4).xy;
        ivec2 size = ivec2(image.xy), how = ivec2(image.zw);
        at = at * image.xy - 0.5;
        ivec2 one = ivec2(floor(at));
        vec2 share = at - floor(at);
        int left = wrap_texel(one.x, size.x, how.x), right = wrap_texel(one.x + 1, size.x, how.x);
        int above = wrap_texel(one.y, size.y, how.y), below = wrap_texel(one.y + 1, size.y, how.y);
        int start = 4096 * int(kind.z) + int(kind.w);
        vec4 a = fetch_texel(start, size, left, above), b = fetch_texel(start, size, right, above);
        vec4 c = fetch_texel(start, size, left, below), d = fetch_texel(start, size, right, below);
        // Between equal levels this gives that level, to the bit.
        vec4 upper = a + share.x * (b - a), lower = c + share.x * (d - c);
        vec4 texel = upper + share.y * (lower - upper);
        color *= texel.rgb;
        level = texel.a;
    }
    level *= first.a + weights.y * (second.a - first.a) + weights.z * (third.a - first.a);
    if (kind.x == MASK) {
        return level >= kind.y ? base.a : 0.0;
    }
    return kind.x == BLEND ? 1.0 - (255.0 - base.a * level) / 255.0 : base.a;
}

// Which side of a ray an edge passes; alike for both triangles that share it. A ray exactly through
// it is a hair aside.
float find_side(vec3 a, vec3 b, bool is_turned, vec3 way) {
    vec3 low = is_turned ? b : a, high = is_turned ? a : b;
    float side = dot(way, cross(low, high));
    side = side == 0.0 ? 1e-30 * dot(vec3(0.61, 0.57, 0.33), cross(way, high - low)) : side;
    return is_turned ? -side : side;
}

// Sides on which a ray from a place passes the edges of a triangle: weights of its corners.
vec3 find_sides(int row, vec3 place, vec3 way) {
    vec4 first = texelFetch(sheer_rows, 8 * row);
    int flags = int(first.w);
    vec3 a = ((first.xyz - eye_high) - eye_low) - place;
    vec3 b = find_corner(row, 1) - place, c = find_corner(row, 2) - place;
    return vec3(find_side(b, c, (flags & 2) != 0, way), find_side(c, a, (flags & 4) != 0, way),
                find_side(a, b, (flags & 1) != 0, way));
}

// Whether a ray passes all edges on one side; an edge that it meets belongs to one of its two.
bool is_inside(int row, vec3 sides) {
    int flags = int(texelFetch(sheer_rows, 8 * row).w);
    bvec3 turned = bvec3((flags & 2) != 0, (flags & 4) != 0, (flags & 1) != 0);
    // A side is negated where it is turned: asked as it was found, it is at least 0 or not.
    bvec3 within;
    for (int k = 0; k < 3; ++k) {
        within[k] = turned[k] ? !(-sides[k] >= 0.0) : sides[k] >= 0.0;
    }
    return all(within) || !any(within);
}

bool is_crossed(int row, vec3 place, vec4 lamp, vec3 way, out vec3 weights) {
    vec3 a = find_corner(row, 0), b = find_corner(row, 1), c = find_corner(row, 2);
    vec3 normal = cross(b - a, c - a);
    float here = dot(normal, place - a), there = dot(normal, lamp.xyz - lamp.w * a);
    float coarse = max(max(length(a), length(b)), max(length(c), length(place)));
    float touch = SHEER_TOUCH * length(normal) * (coarse + length(eye_high));
    if (abs(here) <= touch || abs(there) <= lamp.w * touch || (here > 0.0) == (there > 0.0)) {
        return false;
    }
    weights = find_sides(row, place, way);
    float total = weights.x + weights.y + weights.z;
    if (total == 0.0 || !is_inside(row, weights)) {
        return false;
    }
    weights /= total;
    return true;
}

float invert(float x) {
    return abs(x) < 1e-30 ? (x < 0.0 ? -1e30 : 1e30) : 1.0 / x;
}

// What is left of a light at a place, and how many triangles hide it.
vec4 trace_light(vec3 place, vec4 lamp) {
    vec4 found = vec4(1.0, 1.0, 1.0, 0.0);
    vec3 way = lamp.xyz - lamp.w * place;
    vec3 inverse = vec3(invert(way.x), invert(way.y), invert(way.z));
    float farthest = lamp.w > 0.0 ? 1.0 : 1e30;
    float slack = SHEER_TOUCH * (length(eye_high) + length(place));
    for (int node = 0; node < n_sheer_nodes;) {
        vec4 low = texelFetch(sheer_nodes, 2 * node), high = texelFetch(sheer_nodes, 2 * node + 1);
        vec3 one = (((low.xyz - eye_high) - eye_low) - slack - place) * inverse;
        vec3 two = (((high.xyz - eye_high) - eye_low) + slack - place) * inverse;
        vec3 enter = min(one, two), leave = max(one, two);
        float near = max(max(enter.x, enter.y), max(enter.z, 0.0));
        float far = min(min(leave.x, leave.y), min(leave.z, farthest));
        if (near > far * 1.00001) {
            node = int(low.w);
            continue;
        }
        ++node;
        int row = int(high.w);
        vec3 weights, color;
        if (row >= 0 && is_crossed(row, place, lamp, way, weights)) {
            float cover = find_cover(row, weights, color);
            found.rgb *= (1.0 - cover) * (1.0 - cover * (1.0 - color));
            found.a += cover >= 1.0 ? 1.0 : 0.0;
#ifdef IS_TRANSMITTED
            if (cover >= 1.0) {
                break;  // a picture need not know how many hide the light
            }
#endif
        }
    }
    return found;
}
