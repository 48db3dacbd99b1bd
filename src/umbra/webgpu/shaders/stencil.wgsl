// The stencil as a picture of numbers, which wgpu's Python binding cannot copy; and what is not 0, added
// up over the points of a light.

@group(0) @binding(0) var stencil: texture_2d<u32>;
@group(0) @binding(1) var sum: texture_2d<f32>;

@vertex
fn fill(@builtin(vertex_index) number: u32) -> @builtin(position) vec4<f32> {
    return vec4(f32(number & 1u) * 4.0 - 1.0, f32(number >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn read(@builtin(position) at: vec4<f32>) -> @location(0) i32 {
    return i32(textureLoad(stencil, vec2<i32>(at.xy), 0).r);
}

@fragment
fn add() -> @location(0) f32 {
    return 1.0;  // where the stencil test passes
}

@fragment
fn add_float(@builtin(position) at: vec4<f32>) -> @location(0) f32 {
    return select(0.0, 1.0, abs(textureLoad(sum, vec2<i32>(at.xy), 0).r) > 0.5);
}
