// Programs of what is drawn over surfaces: creases, lines, results.

import { END_AT_CUT, HEAD, MEASURE_CUT, PLACE } from "./shader_parts.js";

/** Creases, drawn a little nearer than the faces that meet there. */
export const CREASE = {
  vertex: `${HEAD}${PLACE}${MEASURE_CUT}
in vec4 place;
uniform float pixels;            // in a metre at distance 1, or anywhere in an orthographic view
uniform float weakest;           // size without lines, in six pixels a metre
uniform bool isPerspective;
uniform vec3 forward;
out float strength;
void main() {
  vec3 at = fromEye(place.xyz);
  float depth = dot(at, forward);
  vec3 lifted = isPerspective ? at * (1.0 - 4e-4) : at - 4e-4 * depth * forward;
  gl_Position = projection * vec4(lifted, 1.0);
  float size = pixels / (isPerspective ? max(depth, 1e-3) : 1.0) / 6.0;
  strength = clamp((size - weakest) / (1.0 - weakest), 0.0, 1.0);
  measureCut(at);
}`,
  fragment: `${HEAD}${END_AT_CUT}
in float strength;
uniform vec4 ink;
out vec4 color;
void main() {
  endAtCut();
  color = vec4(ink.rgb, ink.a * strength);
}`,
};

/** Lines as wide everywhere: an instance is a segment, a strip of two triangles. */
export const LINE = {
  vertex: `${HEAD}${PLACE}
in vec3 from, to;
uniform vec2 half_;              // half the viewport [pixels]
uniform float width;             // [pixels]
uniform bool isSky;              // as far away as the sky
uniform bool reverses;
vec4 lift(vec3 place) { return projection * vec4(fromEye(place) * (1.0 - 6e-4), 1.0); }
void main() {
  vec4 a = lift(from), b = lift(to);
  float near = 1e-3 * max(a.w, b.w);
  if (a.w < near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  if (b.w < near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 way = (b.xy / b.w - a.xy / a.w) * half_;
  vec2 along = way / max(length(way), 1e-6);
  bool isEnd = gl_VertexID > 1;
  vec2 aside = vec2(-along.y, along.x) * (gl_VertexID % 2 == 0 ? 0.5 : -0.5)
    + along * (isEnd ? 0.3 : -0.3); // a little longer: so bends have no gaps
  gl_Position = isEnd ? b : a;
  gl_Position.xy += aside * width / half_ * gl_Position.w;
  if (isSky) gl_Position.z = reverses ? 0.0 : gl_Position.w;
  // The near plane, drawn close to the model for its depths, does not cut what is before it.
  else if (reverses) gl_Position.z = min(gl_Position.z, gl_Position.w);
  else gl_Position.z = max(gl_Position.z, -gl_Position.w);
  if (max(a.w, b.w) <= 0.0) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`,
  fragment: `${HEAD}
uniform vec4 ink;
out vec4 color;
void main() { color = ink; }`,
};

/** Results on walls and roofs: a picture of squares on the faces, which have their own depth. */
export const PATCH = {
  vertex: `${HEAD}${PLACE}${MEASURE_CUT}
in vec3 place;
in vec2 spot;                    // in squares
in vec4 within;                  // the first and the last square of the surface
out vec2 at;
flat out vec4 rectangle;
void main() {
  vec3 from = fromEye(place);
  gl_Position = projection * vec4(from, 1.0);
  at = spot;
  rectangle = within;
  measureCut(from);
}`,
  fragment: `${HEAD}${END_AT_CUT}
in vec2 at;
flat in vec4 rectangle;
uniform sampler2D overlay;
uniform float opacity;
out vec4 color;
void main() {
  endAtCut();
  vec2 square = clamp(floor(at), rectangle.xy, rectangle.zw);
  vec4 laid = texelFetch(overlay, ivec2(square), 0);
  color = vec4(laid.rgb, laid.a * opacity);
}`,
};

/** Results at points: discs that face the eye, lifted off the surfaces on which they lie. */
export const DOT = {
  vertex: `${HEAD}${PLACE}${MEASURE_CUT}
in vec3 place;
in vec4 paint;
uniform float pixels;            // in a metre at distance 1, or anywhere in an orthographic view
uniform float size;              // of a disc [pixels]
uniform bool isPerspective;
uniform vec3 forward;
out vec4 ink;
void main() {
  vec3 at = fromEye(place);
  float depth = dot(at, forward);
  float lift = 1.5 * size / pixels; // in distances, or metres
  at = isPerspective ? at * max(1.0 - lift, 0.5) : at - lift * forward;
  gl_Position = projection * vec4(at, 1.0);
  gl_PointSize = size;
  ink = paint;
  measureCut(at);
}`,
  fragment: `${HEAD}${END_AT_CUT}
in vec4 ink;
uniform float opacity, size;
out vec4 color;
void main() {
  float from = length(gl_PointCoord - 0.5) * size;
  endAtCut();
  if (from > 0.5 * size) discard;
  vec3 linear = mix(ink.rgb / 12.92, pow((ink.rgb + 0.055) / 1.055, vec3(2.4)),
    step(0.04045, ink.rgb));
  color = vec4(mix(linear, vec3(0.012), step(0.5 * size - 1.5, from)), opacity);
}`,
};
