// A finished picture, where its own surfaces are, in a viewport of another framebuffer.

uniform sampler2D picture;
uniform vec2 corner;      // lower left of the viewport [pixels]
uniform bool is_mirrored;

layout(location = 0) out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy - corner);
    if (is_mirrored) {
        pixel.x = textureSize(picture, 0).x - 1 - pixel.x;
    }
    color = vec4(texelFetch(picture, pixel, 0).rgb, 1.0);
}
