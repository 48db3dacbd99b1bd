// The mean of samples as it is shown: by sRGB itself, as `decode` reads them. Samples that differ by
// a step of 255 would differ by two in a mean that is encoded less exactly.

uniform sampler2D light;

layout(location = 0) out vec4 color;

void main() {
    vec3 mean = texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb;
    vec3 high = 1.055 * pow(mean, vec3(1.0 / 2.4)) - 0.055;
    color = vec4(mix(high, 12.92 * mean, lessThanEqual(mean, vec3(0.0031308))), 1.0);
}
