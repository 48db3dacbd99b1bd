// Let pass where the mask is not that of light: the stencil then marks what is in shadow.

uniform sampler2D mask;
uniform int channel;
uniform float low, high;  // between which what is lit lies

void main() {
    float value = texelFetch(mask, ivec2(gl_FragCoord.xy), 0)[channel];
    if (value >= low && value <= high) {
        discard;
    }
}
