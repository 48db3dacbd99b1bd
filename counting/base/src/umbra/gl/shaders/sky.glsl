// What is behind everything.

uniform float rows;         // of the picture

vec3 find_sky(float y) {
    return mix(HORIZON, SKY, clamp((y - 0.5) / max(rows - 1.0, 1.0), 0.0, 1.0));
}
