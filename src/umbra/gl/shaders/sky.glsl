// What is behind everything.

uniform vec3 sky, horizon;  // at the top of the picture and at its foot
uniform float rows;         // of the picture

vec3 find_sky(float y) {
    return mix(horizon, sky, clamp((y - 0.5) / max(rows - 1.0, 1.0), 0.0, 1.0));
}
