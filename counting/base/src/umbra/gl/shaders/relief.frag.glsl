// A surface of hours in their colours, with a contour between steps; nothing where there are none.

const int COLORS = 9;

uniform vec3 palette[COLORS];  // sRGB; the first is of no hours
uniform float top;             // the hours that take the last colour
uniform float step_hours;      // from line to line
uniform float opacity;
uniform vec3 aside;            // where the soft light comes from

in float hours;
in float open;
in vec3 at;

layout(location = 0) out vec4 color;

const float LEAST = 0.02;      // of a step

void main() {
    if (open < 0.999 || hours < LEAST * step_hours) {
        discard;
    }
    float place = clamp(hours / top, 0.0, 1.0) * float(COLORS - 1);
    int low = min(int(place), COLORS - 2);
    vec3 found = mix(palette[low], palette[low + 1], place - float(low));
    // Hours are whole steps: contours run half way, on the slopes between terraces.
    float steps = hours / step_hours;
    float apart = abs(fract(steps) - 0.5) / max(fwidth(steps), 1e-6);
    float line = steps > 0.25 ? 1.0 - smoothstep(0.5, 1.3, apart) : 0.0;
    vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
    float shade = 0.8 + 0.2 * abs(dot(normal, aside));
    color = vec4(mix(found * shade, vec3(0.12, 0.08, 0.16), 0.75 * line), mix(opacity, 1.0, line));
}
