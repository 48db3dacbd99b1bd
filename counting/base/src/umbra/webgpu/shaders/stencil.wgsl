// The stencil as a picture of numbers: what wgpu's Python binding cannot copy.

@group(0) @binding(0) var stencil: texture_2d<u32>;

@vertex
fn fill(@builtin(vertex_index) number: u32) -> @builtin(position) vec4<f32> {
    return vec4(f32(number & 1u) * 4.0 - 1.0, f32(number >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn read(@builtin(position) at: vec4<f32>) -> @location(0) i32 {
    return i32(textureLoad(stencil, vec2<i32>(at.xy), 0).r);
}
