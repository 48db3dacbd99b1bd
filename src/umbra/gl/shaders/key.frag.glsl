// How far away what is seen is: the depth key of picture.glsl.

#ifdef IS_GROUND
#include "picture.glsl"
uniform float height;        // of the ground, relative to the eye
#else
uniform bool is_perspective;
#endif
uniform vec2 depths;         // of an orthographic view: nearest, and from there to the farthest

layout(location = 0) out float key;

void main() {
#ifdef IS_GROUND
    vec3 ray = find_ray(gl_FragCoord.xy);
    key = is_perspective ? ray.z / height : (ray.z - height) / forward.z;
#else
    key = is_perspective ? gl_FragCoord.w : -(depths.x + gl_FragCoord.z * depths.y);
#endif
}
