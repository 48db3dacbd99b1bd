// Programs of hours of sun: bits of instants, their sums, and surfaces in the colours of hours.

import { COVER, END_AT_CUT, HAZE, HEAD, MEASURE_CUT, PLACE } from "./shader_parts.js";

/**
 * Faces in one ink.
 * @param {boolean} isCut whether they end at a section
 */
const makeInk = (isCut) => ({
  vertex: `${HEAD}${PLACE}${isCut ? MEASURE_CUT : ""}
layout(location = 0) in vec3 place;
void main() {
  vec3 at = fromEye(place);
  gl_Position = projection * vec4(at, 1.0);
  ${isCut ? "measureCut(at);" : ""}
}`,
  fragment: `${HEAD}${isCut ? END_AT_CUT : ""}
uniform vec4 ink;
out vec4 color;
void main() {
  ${isCut ? "endAtCut();" : ""}
  color = ink;
}`,
});
export const INK = makeInk(false);
export const CUT_INK = makeInk(true);

/**
 * Faces each in an ink of its own, which no interpolation rounds.
 * @param {boolean} isCut whether they end at a section
 */
const makeFacing = (isCut) => ({
  vertex: `${HEAD}${PLACE}${isCut ? MEASURE_CUT : ""}
layout(location = 0) in vec3 place;
layout(location = 1) in vec4 bits;
flat out vec4 ink;
void main() {
  ink = bits;
  vec3 at = fromEye(place);
  gl_Position = projection * vec4(at, 1.0);
  ${isCut ? "measureCut(at);" : ""}
}`,
  fragment: `${HEAD}${isCut ? END_AT_CUT : ""}
flat in vec4 ink;
out vec4 color;
void main() {
  ${isCut ? "endAtCut();" : ""}
  color = ink;
}`,
});
export const FACING = makeFacing(false);
export const CUT_FACING = makeFacing(true);

/** How many of the wanted bits are set in both of each pixel's four bytes, in steps of 1 / 255. */
export const SUM = {
  vertex: COVER,
  fragment: `${HEAD}
uniform sampler2D masks, facing;
uniform int wanted;
out vec4 color;
uint read(sampler2D picture) {
  uvec4 bytes = uvec4(round(texelFetch(picture, ivec2(gl_FragCoord.xy), 0) * 255.0));
  return bytes.r | bytes.g << 8 | bytes.b << 16 | bytes.a << 24;
}
void main() {
  uint bits = read(masks) & read(facing) & uint(wanted);
  bits -= (bits >> 1) & 0x55555555u;
  bits = (bits & 0x33333333u) + ((bits >> 2) & 0x33333333u);
  bits = (bits + (bits >> 4)) & 0x0f0f0f0fu;
  color = vec4(float((bits * 0x01010101u) >> 24) / 255.0, 0.0, 0.0, 0.0);
}`,
};

const HOURS = `
uniform sampler2D sums, ramp;    // in steps of 1 / 255; colours from no sun to sun at all instants
uniform vec2 picture;            // size in pixels
uniform float most;              // instants
vec3 findHours() {
  vec2 at = gl_FragCoord.xy / picture, step = 1.0 / picture;
  vec4 sum = texture(sums, at);
  // Of a pixel whose middle shows no surface a part may: its hours are those of a neighbour.
  if (sum.g < 0.5) sum = texture(sums, at + vec2(0.0, -step.y));
  if (sum.g < 0.5) sum = texture(sums, at + vec2(step.x, 0.0));
  if (sum.g < 0.5) sum = texture(sums, at + vec2(-step.x, 0.0));
  if (sum.g < 0.5) sum = texture(sums, at + vec2(0.0, step.y));
  float lit = 255.0 * sum.r / max(sum.g, 0.5); // of a coarse sum between pixels, some may show none
  float last = float(textureSize(ramp, 0).x - 1);
  // The first colour is that of no instant at all.
  float color = lit < 0.5 ? 0.0 : 1.0 + min(lit / most, 1.0) * (last - 1.0);
  return texelFetch(ramp, ivec2(int(color + 0.5), 0), 0).rgb;
}
`;

/**
 * Faces in the colours of their hours.
 * @param {boolean} isCut whether they end at a section
 */
const makeHourSurface = (isCut) => ({
  vertex: `${HEAD}${PLACE}${isCut ? MEASURE_CUT : ""}
layout(location = 0) in vec3 place;
layout(location = 1) in vec4 normal;
uniform float side;              // 1: fronts are seen, -1: backs
out float shade;
void main() {
  vec3 at = fromEye(place);
  gl_Position = projection * vec4(at, 1.0);
  // Slopes differ by less than half of one of eight steps of the colours, as in umbra's pictures.
  shade = mix(0.86, 1.0, 0.5 + 0.5 * dot(side * normal.xyz, vec3(-0.41, -0.54, 0.735))) / 0.98;
  ${isCut ? "measureCut(at);" : ""}
}`,
  fragment: `${HEAD}${isCut ? END_AT_CUT : ""}${HOURS}
in float shade;
out vec4 color;
void main() {
  ${isCut ? "endAtCut();" : ""}
  color = vec4(shade * findHours(), 1.0);
}`,
});
export const HOUR_SURFACE = makeHourSurface(false);
export const CUT_HOUR_SURFACE = makeHourSurface(true);

/** The ground in the colours of its hours, which fade into the horizon as the ground does. */
export const HOUR_GROUND = {
  vertex: `${HEAD}${PLACE}
uniform vec4 corners[5];
uniform float haze;
out vec3 at;
void main() {
  vec4 corner = corners[gl_VertexID];
  at = vec3(corner.xy / haze, corner.w);
  gl_Position = projection * corner;
}`,
  fragment: `${HEAD}${HAZE}${HOURS}
in vec3 at;
uniform vec3 horizon;
out vec4 color;
void main() { color = vec4(mix(horizon, findHours(), findClear(at)), 1.0); }`,
};
