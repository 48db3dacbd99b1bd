// Programs of surfaces, ground, sky and sections, and of the picture as a whole.

import { AMBIENT, COVER, END_AT_CUT, HAZE, HEAD, LAMBERT, MEASURE_CUT, PLACE } from "./shader_parts.js";

const RICH = "#define RICH\n";

// A picture from above, laid over what is drawn.
const LAID = `
uniform float share;             // of the sky's light
#ifdef RICH
uniform vec4 plan;               // corner, 1 / size; size 0: none
uniform vec3 eye;
uniform float opacity;
uniform bool isFlat;             // it hides light and shadow
uniform sampler2D overlay;
vec3 lay(vec2 place, vec3 radiance, vec3 light) {
  if (plan.z <= 0.0) return radiance;
  vec2 on = ((place + eye.xy) - plan.xy) * plan.zw;
  if (any(lessThan(on, vec2(0.0))) || any(greaterThan(on, vec2(1.0)))) return radiance;
  vec4 laid = texture(overlay, vec2(on.x, 1.0 - on.y));
  vec3 shown = isFlat ? laid.rgb * step(1e-6, share) : laid.rgb * light * 1.4;
  return mix(radiance, shown, laid.a * opacity);
}
#endif
`;

/**
 * Faces of the model under the sky and a sun; `share` is 1 for the sky's light. Nothing is left out
 * in the fragment shader, so that depth and stencil are tested before it runs.
 * @param {string} rich `RICH`: under lamps, with sections and results laid over them
 */
const makeSurface = (rich) => ({
  vertex: `${HEAD}${rich}${PLACE}${AMBIENT}${LAMBERT}
layout(location = 0) in vec3 place;
layout(location = 1) in vec4 normal; // w: sine of the widest angle to its faces' normals
layout(location = 2) in vec4 color;
uniform vec4 light;
uniform vec3 tint;               // of the light, times its exposure
uniform float share;
uniform float side;              // 1: fronts are seen, -1: backs
out vec4 seen;                   // radiance and opacity
#ifdef RICH
uniform vec4 cut;                // surfaces end where this plane is below 0; relative to the eye
out vec3 albedo, at, way;
out float kept, lean;
#else
vec3 albedo, at;
#endif
void main() {
  at = fromEye(place);
  gl_Position = projection * vec4(at, 1.0);
  albedo = color.rgb * color.rgb; // sent as its square root: finer steps in the dark
  vec3 toLight = light.xyz;
#ifdef RICH
  way = side * normal.xyz;
  lean = normal.w;
  kept = dot(cut.xyz, at) + cut.w;
  toLight = normalize(toLight - light.w * at);
#endif
  float cosine = dot(side * normal.xyz, toLight);
  seen.rgb = share * findAmbient(side * normal.z) + tint * findLambert(cosine, normal.w);
  seen = vec4(albedo * seen.rgb, color.a);
}`,
  fragment: `${HEAD}${rich}${AMBIENT}${LAMBERT}${LAID}
in vec4 seen;
out vec4 color;
#ifdef RICH
in vec3 albedo, at, way;
in float kept, lean;
uniform vec4 light;
uniform vec3 tint;
uniform float range;             // of a lamp; 0: the light is a sun
#endif
void main() {
  vec3 radiance = seen.rgb;
#ifdef RICH
  if (kept < 0.0) discard;
  if (range > 0.0) {
    vec3 toLight = light.xyz - at;
    float far = length(toLight), fade = max(1.0 - pow(far / range, 4.0), 0.0);
    vec3 normal = normalize(way);
    radiance = albedo * (share * findAmbient(normal.z)
      + tint * findLambert(dot(normal, toLight / far), lean) * fade);
  }
  float most = max(max(albedo.r, albedo.g), max(albedo.b, 1e-3));
  if (abs(way.z) > 0.02) radiance = lay(at.xy, radiance, radiance / most);
#endif
  color = vec4(radiance, seen.a);
}`,
});
export const SURFACE = makeSurface("");
export const RICH_SURFACE = makeSurface(RICH);

/**
 * What a view sees of the plane z = height, up to the horizon, as a fan.
 * @param {string} rich as of surfaces
 */
const makeGround = (rich) => ({
  vertex: `${HEAD}${PLACE}${AMBIENT}${LAMBERT}
uniform vec4 corners[5];         // homogeneous, relative to the eye
uniform float height, share, range;
uniform float facing;            // 1 where the ground is seen from above, -1 from below
uniform float haze;              // distance at which the ground fades into the horizon
uniform vec4 light;
uniform vec3 tint, albedo;
out vec3 at;                     // x and y in hazes, and the weight to divide them by
flat out vec3 level;             // radiance under the sky and a sun
void main() {
  vec4 corner = corners[gl_VertexID];
  at = vec3(corner.xy / haze, corner.w);
  vec3 sun = range > 0.0 ? vec3(0.0) : tint * findLambert(facing * light.z, 0.0);
  level = albedo * (share * findAmbient(facing) + sun);
  gl_Position = projection * corner;
}`,
  fragment: `${HEAD}${rich}${LAID}${HAZE}
in vec3 at;
flat in vec3 level;
uniform vec3 horizon;
out vec4 color;
#ifdef RICH
uniform vec4 light;
uniform vec3 tint, albedo;
uniform float range, facing;
#endif
void main() {
  vec3 radiance = level;
#ifdef RICH
  vec2 place = at.xy * (haze / at.z);
  if (range > 0.0) {
    vec3 toLight = light.xyz - vec3(place, height);
    float far = length(toLight), fade = max(1.0 - pow(far / range, 4.0), 0.0);
    radiance += albedo * tint * max(facing * toLight.z / far, 0.0) * fade;
  }
  radiance = lay(place, radiance, radiance / albedo);
#endif
  color = vec4(mix(share * horizon, radiance, findClear(at)), 1.0);
}`,
});
export const GROUND = makeGround("");
export const RICH_GROUND = makeGround(RICH);

/** Sky from zenith to horizon, behind everything. */
export const SKY = {
  vertex: `${HEAD}
uniform vec3 forward, right, up; // right and up to the edges of the picture
uniform float behind;            // the far plane's depth
uniform vec4 within;             // the part of the picture that is drawn
uniform float guard;             // times as large as the picture is the viewport
out vec3 way;
void main() {
  vec2 corner = vec2(gl_VertexID % 2 == 0 ? within.x : within.z,
    gl_VertexID < 2 ? within.y : within.w);
  way = forward + corner.x * right + corner.y * up;
  gl_Position = vec4(corner / guard, behind, 1.0);
}`,
  fragment: `${HEAD}
in vec3 way;
uniform vec3 zenith, horizon;
out vec4 color;
void main() {
  float rise = normalize(way).z;
  color = vec4(mix(horizon, zenith, sqrt(clamp(rise, 0.0, 1.0))), 1.0);
}`,
};

/** What a section cuts off a solid: counted in the stencil, front and back. */
export const CUT = {
  vertex: `${HEAD}${PLACE}${MEASURE_CUT}
layout(location = 0) in vec3 place;
void main() {
  vec3 at = fromEye(place);
  gl_Position = projection * vec4(at, 1.0);
  measureCut(at);
}`,
  fragment: `${HEAD}${END_AT_CUT}
out vec4 color;
void main() {
  endAtCut();
  color = vec4(1.0);
}`,
};

/** The plane of a section, as a fan. */
export const CAP = {
  vertex: `${HEAD}${PLACE}
uniform vec4 corners[5];
void main() { gl_Position = projection * corners[gl_VertexID]; }`,
  fragment: `${HEAD}
uniform vec4 ink;
out vec4 color;
void main() { color = ink; }`,
};

/** From linear light to sRGB, on the canvas. */
export const ENCODE = {
  vertex: COVER,
  fragment: `${HEAD}
uniform sampler2D picture;
out vec4 color;
void main() {
  vec4 linear = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
  // 1.055 x^(1 / 2.4) - 0.055 to 0.2 of 255, by roots: powers take software several times as long.
  vec3 root = sqrt(linear.rgb), fourth = sqrt(root), eighth = sqrt(fourth);
  vec3 curve = 0.662002687 * root + 0.684122060 * fourth - 0.323583601 * eighth
    - 0.0225411470 * linear.rgb;
  vec3 encoded = mix(12.92 * linear.rgb, curve, step(0.0031308, linear.rgb));
  color = vec4(encoded, linear.a);
}`,
};
