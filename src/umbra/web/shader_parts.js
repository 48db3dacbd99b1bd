// GLSL that several programs share. `place` turns local coordinates into clip space in the same way
// everywhere, so that a surface, its light cap and its lit pass have bit-identical depth.

export const HEAD = `#version 300 es
precision highp float;
precision highp int;
`;

export const PLACE = `
uniform mat4 projection;         // from coordinates relative to the eye
uniform vec3 eyeHigh, eyeLow;    // the eye in two parts: float32 alone would shake near it
invariant gl_Position;
vec3 fromEye(vec3 place) { return (place - eyeHigh) - eyeLow; }
`;

/** Surfaces end where the plane `cut`, relative to the eye, is below 0: vertex and fragment shader. */
export const MEASURE_CUT = `
uniform vec4 cut;
out float kept;
void measureCut(vec3 at) { kept = dot(cut.xyz, at) + cut.w; }
`;
export const END_AT_CUT = `
in float kept;
void endAtCut() { if (kept < 0.0) discard; }
`;

export const AMBIENT = `
const vec3 FROM_SKY = vec3(0.16525, 0.20510, 0.25176); // umbra.scene.exposure.FROM_SKY
const vec3 FROM_GROUND = vec3(0.10029, 0.10029, 0.09628); // and FROM_GROUND
vec3 findAmbient(float up) { return mix(FROM_GROUND, FROM_SKY, 0.5 + 0.5 * up); }
`;

// A smooth normal's faces turn from the light one by one, and their own edges would show as teeth:
// its light ends where the first of them may. A low sun's light is bent: see `exposeSun`.
export const LAMBERT = `
uniform float bend;              // power of the cosine
float findLambert(float cosine, float lean) {
  float share = max(cosine - lean, 0.0) / max(1.0 - lean, 0.01);
  return bend == 1.0 ? share : pow(share, bend);
}
`;

/** A triangle over the whole picture, at the far plane. */
export const COVER = `${HEAD}
uniform float behind;            // the far plane's depth
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, behind, 1.0);
}`;

/** How much of a ground is seen through the haze: about exp(-d^2), and quicker, of d hazes. */
export const HAZE = `
uniform float height, haze;      // haze: distance at which the ground fades into the horizon
float findClear(vec3 at) {       // x and y in hazes, and the weight to divide them by
  float weight = at.z * at.z, lift = height / haze;
  float far = dot(at.xy, at.xy) + weight * lift * lift; // d^2 is far / weight
  return weight * weight / (weight * weight + far * (weight + 0.5 * far));
}
`;
