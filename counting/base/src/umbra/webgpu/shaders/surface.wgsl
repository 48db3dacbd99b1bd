// The visible face of each pixel: faces of the scene, and the endless ground.

struct View {
    projection: mat4x4<f32>,
    near: vec2<f32>,  // factors of z and w: a clip distance
    height: f32,      // of the ground, relative to the eye
    side: f32,        // what a front face adds to a float count
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> vertices: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> corners: array<u32>;

struct Seen {
    @invariant @builtin(position) place: vec4<f32>,
    @location(0) @interpolate(flat, either) face: i32,
}

@vertex
fn draw_faces(@builtin(vertex_index) number: u32) -> Seen {
    return Seen(view.projection * vertices[corners[number]], i32(number / 3u));
}

const RINGS = 28u;   // each twice as wide as the one within it, the last to infinity
const GROUND = -2;

@vertex
fn draw_ground(@builtin(vertex_index) number: u32) -> Seen {
    let part = number / 6u;
    let corner = number % 6u;
    var place = corner;  // 0, 1, 2 and 0, 2, 3 of a quad: inner, outer, outer, inner
    if corner == 3u { place = 0u; }
    if corner > 3u { place = corner - 2u; }
    let is_outer = place == 1u || place == 2u;
    var turn = part % 4u;
    if place >= 2u { turn = (turn + 1u) % 4u; }
    var way = vec2(0.0, -1.0);
    if turn == 0u { way = vec2(1.0, 0.0); }
    if turn == 1u { way = vec2(0.0, 1.0); }
    if turn == 2u { way = vec2(-1.0, 0.0); }
    var ring = part / 4u;
    if is_outer { ring += 1u; }
    if ring == RINGS {
        return Seen(view.projection * vec4(way, 0.0, 0.0), GROUND);
    }
    var radius = 0.0;
    if ring > 0u { radius = abs(view.height) * exp2(f32(ring) - 1.0); }
    return Seen(view.projection * vec4(radius * way, view.height, 1.0), GROUND);
}

@fragment
fn show_face(seen: Seen) -> @location(0) i32 {
    return seen.face;
}
