enable clip_distances;

// Sides and caps of shadow volumes, by the arrays of `umbra.realtime.PlannedVolumes`.
//
// Depth is clamped here, at each pixel: wgpu's Python binding does not pass ``unclippedDepth`` on.

struct View {
    projection: mat4x4<f32>,
    near: vec2<f32>,  // factors of z and w: a clip distance
    height: f32,
    side: f32,        // what a front face adds to a float count
}

@group(0) @binding(0) var<uniform> view: View;

struct Volume {
    @invariant @builtin(position) place: vec4<f32>,
    @builtin(clip_distances) behind: array<f32, 1>,
    @location(0) depth: vec2<f32>,  // z and w, whatever z is drawn at
}

fn place_volume(vertex: vec4<f32>) -> Volume {
    let place = view.projection * vertex;
    return Volume(place, array<f32, 1>(dot(view.near, place.zw)), place.zw);
}

@vertex
fn draw_clipped(@location(0) vertex: vec4<f32>) -> Volume {
    return place_volume(vertex);
}

@vertex
fn draw_clamped(@location(0) vertex: vec4<f32>) -> Volume {
    var drawn = place_volume(vertex);
    drawn.place.z = 0.5 * drawn.place.w;  // where nothing is clipped
    return drawn;
}

fn clamp_depth(depth: vec2<f32>) -> f32 {
    return clamp(depth.x / depth.y, 0.0, 1.0);
}

struct Counted {
    @location(0) count: f32,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn count_in_stencil(@location(0) depth: vec2<f32>) -> @builtin(frag_depth) f32 {
    return clamp_depth(depth);
}

@fragment
fn count_in_floats(
    @location(0) depth: vec2<f32>, @builtin(front_facing) is_front: bool
) -> Counted {
    return Counted(select(-view.side, view.side, is_front), clamp_depth(depth));
}
