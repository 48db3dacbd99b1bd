// What one light adds where it reaches: Lambert's cosine, range, attenuation, cone, picture.
//
// IS_POINT, IS_WEAKENING, IS_SPOT and HAS_IMAGE are defined as the light needs them: a software device
// takes every branch of every pixel.

#include "color.glsl"
#include "picture.glsl"

uniform sampler2D places;    // normals and depth keys
uniform sampler2D albedos;
uniform vec4 light;          // homogeneous, relative to the eye
uniform vec3 color;          // times the exposure
uniform vec3 attenuation;    // constant, linear, quadratic
uniform float fade;          // 1 / range², 0 without a range
uniform vec3 axis;
uniform vec2 cone;           // cosine of the half angle; 1 / (what the inner angle's is above it)
uniform sampler2D image;
uniform vec3 image_right, image_up;  // over the tangent of the half angle

layout(location = 0) out vec4 added;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 seen = texelFetch(places, pixel, 0);
    vec3 normal = seen.xyz;
    float key = seen.w;
    vec3 tint = color * unpack(texelFetch(albedos, pixel, 0).rgb);
#ifdef IS_POINT
    vec3 way = light.xyz - find_seen(gl_FragCoord.xy, key);
    float square = max(dot(way, way), 1e-30);
    float near = inversesqrt(square);
    way *= near;
    float amount = max(dot(normal, way), 0.0);
#ifdef IS_WEAKENING
    float weakened = attenuation.x + square * (near * attenuation.y + attenuation.z);
    amount *= max(1.0 - square * fade * (square * fade), 0.0) / max(weakened, 1e-12);
#endif
#else
    float amount = max(dot(normal, light.xyz), 0.0);
#endif
#ifdef IS_SPOT
    float along = -dot(way, axis);
    float rim = clamp((along - cone.x) * cone.y, 0.0, 1.0);
    amount *= rim * rim;
#endif
#ifdef HAS_IMAGE
    float ahead = max(along, 1e-30);
    vec2 spot = 0.5 + 0.5 * vec2(-dot(way, image_right), dot(way, image_up)) / ahead;
    tint *= texture(image, clamp(spot, 0.0, 1.0)).rgb;
#endif
    added = key == 0.0 ? vec4(0.0) : vec4(amount * tint, 0.0);
}
