// A picture, or a share of it.

uniform sampler2D picture;
uniform float share;

layout(location = 0) out vec4 color;

void main() {
    color = share * texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
}
