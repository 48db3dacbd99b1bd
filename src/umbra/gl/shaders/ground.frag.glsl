// The ground plane's surface.

#include "color.glsl"
#include "picture.glsl"

uniform float height;  // relative to the eye
uniform vec3 albedo;

uniform float ambient;

layout(location = 0) out vec4 light;
layout(location = 1) out vec4 place;  // normal and depth key
layout(location = 2) out vec4 out_albedo;

void main() {
    vec3 ray = find_ray(gl_FragCoord.xy);
    float key = is_perspective ? ray.z / height : (ray.z - height) / forward.z;
    place = vec4(0.0, 0.0, height < 0.0 ? 1.0 : -1.0, key);
    out_albedo = vec4(pack(albedo), 1.0);
    light = vec4(albedo * ambient * (0.75 + 0.25 * place.z), 1.0);
}
