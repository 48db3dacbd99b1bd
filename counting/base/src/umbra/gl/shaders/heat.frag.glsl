// Shadow counts as colours; a soft shade from aside leaves the forms to be seen.

#include "color.glsl"

const int COLORS = 9;

uniform sampler2D counts;
uniform sampler2D places;      // normals and depth keys
uniform float top;             // the count that takes the last colour
uniform vec3 palette[COLORS];  // sRGB; the first is of a count of 0
uniform vec3 aside;            // where the soft light comes from
uniform float soft;            // its share: a colour that is read against a key takes little

layout(location = 0) out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 seen = texelFetch(places, pixel, 0);
    if (seen.w == 0.0) {
        discard;
    }
    float count = max(texelFetch(counts, pixel, 0).r, 0.0);
    float place = clamp(count / top, 0.0, 1.0) * float(COLORS - 1);
    int low = min(int(place), COLORS - 2);
    vec3 found = mix(palette[low], palette[low + 1], place - float(low));
    float shade = 1.0 - soft + soft * dot(seen.xyz, aside);
    color = vec4(found * shade, 1.0);
}
