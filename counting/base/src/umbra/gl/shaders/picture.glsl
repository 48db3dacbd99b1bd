// From a pixel back to the place that is seen there, relative to the eye.
//
// A depth key is 1 / depth in perspective and -depth in an orthographic view, as on the CPU.

uniform vec3 corner, across, upward;  // ray of the pixel (0, 0), steps to the right and up
uniform vec3 forward;
uniform bool is_perspective;

vec3 find_ray(vec2 pixel) {
    return corner + pixel.x * across + pixel.y * upward;
}

vec3 find_seen(vec2 pixel, float key) {
    vec3 ray = find_ray(pixel);
    return is_perspective ? ray * (1.0 / key) : ray - key * forward;
}
