// A surface in one light and ambient light, drawn at once.

uniform samplerBuffer colors;  // of each face
uniform vec4 light;            // homogeneous, relative to the eye
uniform float ambient;         // share
uniform vec3 direct;           // share and colour
uniform float white;           // 1 draws white instead
uniform float alpha;           // to leave in the target's alpha
uniform vec3 forward;
uniform bool is_perspective;

in vec3 at;

layout(location = 0) out vec4 color;
#ifdef HAS_PLACE
layout(location = 1) out vec4 place;  // normal and depth key
#endif

void main() {
    vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
    vec3 toward = is_perspective ? -at : -forward;
    normal *= dot(normal, toward) < 0.0 ? -1.0 : 1.0;
    vec3 amount = ambient + direct * max(dot(normal, normalize(light.xyz - light.w * at)), 0.0);
    color = vec4(mix(texelFetch(colors, gl_PrimitiveID).rgb * amount, vec3(1.0), white), alpha);
#ifdef HAS_PLACE
    float depth = dot(at, forward);
    place = vec4(normal, is_perspective ? 1.0 / depth : -depth);
#endif
}
