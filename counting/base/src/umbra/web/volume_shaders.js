// Programs of shadow volumes and their counts.

import { COVER, HEAD, PLACE } from "./shader_parts.js";

/** Sides and caps of shadow volumes. */
export const VOLUME = {
  vertex: `${HEAD}${PLACE}
in vec4 place;                   // w: 1 the vertex, 0 its far end
uniform vec4 light;              // homogeneous, relative to the eye
uniform float bottom;            // relative to the eye
uniform bool isCut;              // at the bottom, or else at infinity
uniform float tip;               // weight of ends at infinity: 0, or a little in parallel views
uniform bool isClamped;          // depth is written by the fragment shader, clamped
out vec2 depth;
void main() {
  vec3 at = fromEye(place.xyz);
  vec4 end = vec4(at, 1.0);
  if (place.w == 0.0) {
    vec3 away = light.w * at - light.xyz;
    // at + away * (bottom - at.z) / away.z, times -away.z, which is positive
    end = isCut ? vec4((at.z - bottom) * away - away.z * at, -away.z) : vec4(away + tip * at, tip);
  }
  gl_Position = projection * end;
  depth = gl_Position.zw;
  if (isClamped) gl_Position.z = 0.0;
}`,
  fragment: `${HEAD}
out vec4 color;
void main() { color = vec4(1.0); }`,
};

/** The same with depth clamped between near and far plane, for orthographic views. */
export const CLAMPED_VOLUME = {
  vertex: VOLUME.vertex,
  fragment: `${HEAD}
in vec2 depth;
uniform bool reverses;
out vec4 color;
void main() {
  float z = depth.x / depth.y;
  gl_FragDepth = clamp(reverses ? z : 0.5 + 0.5 * z, 0.0, 1.0);
  color = vec4(1.0);
}`,
};

/** One value everywhere, for what the stencil chooses. */
export const FILL = {
  vertex: COVER,
  fragment: `${HEAD}
uniform vec4 fill;
out vec4 color;
void main() { color = fill; }`,
};
