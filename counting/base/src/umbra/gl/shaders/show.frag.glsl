// A finished picture, drawn larger or as it is.

uniform sampler2D picture;
uniform vec2 corner, size;  // of the place that it fills, in pixels

layout(location = 0) out vec4 color;

void main() {
    color = vec4(texture(picture, (gl_FragCoord.xy - corner) / size).rgb, 1.0);
}
