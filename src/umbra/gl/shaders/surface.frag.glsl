// What is seen: normal, depth key, reflectance, and what shows before any light is switched
// on; or, of a transparent surface, its colour over what lies behind.

#include "color.glsl"

uniform samplerBuffer materials;  // three texels each
uniform isamplerBuffer owners;    // the material of each face
uniform sampler2D image;          // sRGB, decoded when fetched
uniform bool has_image;
uniform int first;                // number of the draw's first face
uniform vec3 forward;
uniform bool is_perspective;

uniform float ambient;            // on a white surface that looks up; half as much looking down

in vec3 at;
#ifdef HAS_NORMALS
in vec3 normal;
#endif
#ifdef HAS_UV
in vec2 uv;
#endif
#ifdef HAS_TINTS
in vec3 tint;
#endif

#ifdef IS_TRANSPARENT
layout(location = 0) out vec4 color;
#else
layout(location = 0) out vec4 light;
layout(location = 1) out vec4 out_normal;
layout(location = 2) out float key;
layout(location = 3) out vec4 albedo;
#endif

const float MASK = 1.0, BLEND = 2.0;
const float EVEN_LIGHT = 0.7;  // on transparent surfaces

void main() {
    int owner = 3 * texelFetch(owners, first + gl_PrimitiveID).r;
    vec4 body = texelFetch(materials, owner);
    vec4 own = texelFetch(materials, owner + 1);
    vec4 alpha = texelFetch(materials, owner + 2);
    vec4 texel = vec4(1.0);
#ifdef HAS_UV
    texel = has_image ? texture(image, uv) : texel;
    if (alpha.x == MASK && texel.a * body.a < alpha.y) {
        discard;
    }
#endif
    vec3 reflectance = body.rgb * texel.rgb;
#ifdef HAS_TINTS
    reflectance *= tint;
#endif

    // The side that is seen counts, however the face is wound.
    vec3 flat_normal = normalize(cross(dFdx(at), dFdy(at)));
    vec3 toward = is_perspective ? -at : -forward;
    flat_normal *= dot(flat_normal, toward) < 0.0 ? -1.0 : 1.0;
    vec3 seen_normal = flat_normal;
#ifdef HAS_NORMALS
    seen_normal = dot(normal, normal) > 0.0 ? normalize(normal) : flat_normal;
    seen_normal *= dot(seen_normal, flat_normal) < 0.0 ? -1.0 : 1.0;
#endif

#ifdef IS_TRANSPARENT
    float opacity = body.a * (alpha.x == BLEND ? texel.a : 1.0);
    color = vec4(opacity * (reflectance * (own.a > 0.5 ? 1.0 : EVEN_LIGHT) + own.rgb), opacity);
#else
    float depth = dot(at, forward);
    key = is_perspective ? 1.0 / depth : -depth;
    out_normal = vec4(seen_normal, 1.0);
    bool is_unlit = own.a > 0.5;
    albedo = vec4(is_unlit ? vec3(0.0) : pack(reflectance), 1.0);
    float sky = is_unlit ? 1.0 : ambient * (0.75 + 0.25 * seen_normal.z);
    light = vec4(own.rgb + reflectance * sky, 1.0);
#endif
}
