// The ground plane's surface.

#include "picture.glsl"
#include "seen.glsl"

uniform float height;  // relative to the eye
uniform vec3 albedo;

uniform float ambient;

void main() {
    vec3 ray = find_ray(gl_FragCoord.xy);
    float key = is_perspective ? ray.z / height : (ray.z - height) / forward.z;
    float up = height < 0.0 ? 1.0 : -1.0;
    vec3 before = albedo * ambient * (0.75 + 0.25 * up);
    vec3 normal = vec3(0.0, 0.0, up), at = find_seen(gl_FragCoord.xy, key);
    store(Seen(albedo, before, at, normal, normal, key, 0.0, MATTE, normal));
}
