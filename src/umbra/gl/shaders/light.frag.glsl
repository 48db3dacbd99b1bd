// What one light adds where it reaches, or as much of it as a share says (HAS_SHARE), and as
// triangles that transmit light leave of it (IS_TRANSMITTED).
//
// IS_SHOWN: the colour of the picture there, with what was before any light, where that is changed.
// IS_PLAIN: before the light there is only an even one.
// IS_TURNED: only to what is turned from it but for its smooth normal. SPARES_TURNED: to all else,
// without the share that the face itself hides below its horizon.

#include "color.glsl"
#include "gloss.glsl"
#include "ambient.glsl"
#include "picture.glsl"
#include "lamp.glsl"
#include "samples.glsl"
#ifdef IS_TRANSMITTED
#include "transmission.glsl"

uniform vec4 sheer_lamps[16];  // points of the light, as many as count
uniform int n_sheer_lamps;
#endif

uniform PICTURE places;      // normals and depth keys
uniform PICTURE albedos;
uniform PICTURE faces;       // their own normals
uniform PICTURE befores;     // glow and ambient light
uniform sampler2D shares;    // what part of the light reaches each pixel
uniform float extent;        // radius of the light, of a directional one as a sine

layout(location = 0) out vec4 added;

// What part of a disc is above the horizon, where its middle is so many radii above.
float find_rise(float above) {
    float x = clamp(above, -1.0, 1.0);
    return 0.5 + (x * sqrt(1.0 - x * x) + asin(x)) / 3.14159265;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 seen = texelFetch(places, pixel, which);
    if (seen.w == 0.0) {
        discard;
    }
    vec3 place = find_seen(gl_FragCoord.xy, seen.w);
    vec3 lamplight = find_radiance(place), toward = find_toward(place);
#ifdef HAS_SHARE
    lamplight *= texelFetch(shares, pixel, 0).r;
#endif
#if defined(IS_TURNED) || defined(SPARES_TURNED)
    vec3 flat_normal = texelFetch(faces, pixel, which).xyz;
    bool turned = is_turned(place, seen.xyz, flat_normal);
#ifdef IS_TURNED
    if (!turned) {
        discard;
    }
#else
    if (turned) {
        discard;
    }
    if (is_smooth(seen.xyz, flat_normal)) {
        vec3 visible = texelFetch(shares, pixel, 0).rrr;
        float rise = find_rise(dot(flat_normal, find_way(place)) / max(extent, 1e-6));
        lamplight *= min(1.0 / max(rise, 0.5), 1.0 / max(visible.r, 1e-6));
    }
#endif
#endif
    vec4 stored = texelFetch(albedos, pixel, which);
    vec3 albedo = unpack(stored.rgb);
    vec3 reflected = albedo * max(dot(seen.xyz, toward), 0.0);
#ifdef HAS_GLOSSY
    float rough = texelFetch(faces, pixel, which).w;
    if (rough >= 0.0) {
        vec3 eye = is_perspective ? -normalize(place) : -forward;
        reflected = reflect_light(albedo, stored.a, rough, seen.xyz, toward, eye);
    }
#endif
#ifdef IS_TRANSMITTED
    if (max(max(lamplight.r, lamplight.g), lamplight.b) * dot(reflected, vec3(1.0)) > 0.0) {
        vec3 left = vec3(0.0);
        for (int k = 0; k < n_sheer_lamps; ++k) {
            left += trace_light(place, sheer_lamps[k]).rgb;
        }
        lamplight *= left / float(n_sheer_lamps);
    }
#endif
    vec3 light = lamplight * reflected * find_bend(dot(seen.xyz, toward));
#ifdef IS_SHOWN
    if (max(max(light.r, light.g), light.b) <= 0.0) {
        discard;
    }
#ifdef IS_PLAIN
    vec3 before = albedo * find_ambient(seen.xyz);
#else
    vec3 before = texelFetch(befores, pixel, which).rgb;
#endif
    added = vec4(show(before + light), 1.0);
#else
    added = vec4(light, 0.0);
#endif
}
