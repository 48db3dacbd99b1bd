// How far away what is seen is: the depth key of picture.glsl, and the unit normal of the side that
// is seen.

#include "picture.glsl"
#ifdef IS_GROUND
uniform float height;        // of the ground, relative to the eye
#endif
uniform vec2 depths;         // of an orthographic view: nearest, and from there to the farthest

layout(location = 0) out vec4 place;

void main() {
#ifdef IS_GROUND
    vec3 ray = find_ray(gl_FragCoord.xy);
    float key = is_perspective ? ray.z / height : (ray.z - height) / forward.z;
#else
    float key = is_perspective ? gl_FragCoord.w : -(depths.x + gl_FragCoord.z * depths.y);
#endif
    vec3 seen = find_seen(gl_FragCoord.xy, key);
    vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
    vec3 ahead = is_perspective ? seen : forward;
    place = vec4(key, dot(normal, ahead) > 0.0 ? -normal : normal);
}
