// The plane z = height without end: four sectors of rings, from below the eye to infinity.
//
// Each ring is twice as wide as the one within it. A rasteriser's depths are as exact as the
// largest depth of a triangle, which a ring keeps close to all others of its own.

uniform mat4 projection;
uniform float height;  // relative to the eye

invariant gl_Position;

const vec2 WAYS[4] = vec2[4](vec2(1, 0), vec2(0, 1), vec2(-1, 0), vec2(0, -1));

void main() {
    int part = gl_VertexID / 6, corner = gl_VertexID % 6;
    // Corners 0, 1, 2 and 0, 2, 3 of a quad: inner, outer, outer, inner.
    int place = corner < 3 ? corner : corner == 3 ? 0 : corner - 2;
    bool is_outer = place == 1 || place == 2;
    vec2 way = WAYS[(part + (place >= 2 ? 1 : 0)) % 4];
    int ring = part / 4 + (is_outer ? 1 : 0);  // 0 is the point below the eye
    if (ring == RINGS) {
        gl_Position = projection * vec4(way, 0.0, 0.0);
    } else {
        float radius = ring == 0 ? 0.0 : abs(height) * exp2(float(ring - 1));
        gl_Position = projection * vec4(radius * way, height, 1.0);
    }
}
