// The ground plane's surface.

#include "picture.glsl"
#include "seen.glsl"

uniform float height;  // relative to the eye
uniform vec3 albedo;

#include "ambient.glsl"

void main() {
    vec3 ray = find_ray(gl_FragCoord.xy);
    float key = is_perspective ? ray.z / height : (ray.z - height) / forward.z;
    // The side that is seen: parallel rays all come from one, wherever they begin.
    float up = (is_perspective ? height : forward.z) < 0.0 ? 1.0 : -1.0;
    vec3 normal = vec3(0.0, 0.0, up), at = find_seen(gl_FragCoord.xy, key);
    vec3 before = albedo * find_ambient(normal);
    store(Seen(albedo, before, at, normal, normal, key, 0.0, MATTE, normal));
}
