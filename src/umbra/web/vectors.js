// Vectors of three numbers, planes and 4 x 4 matrices (row-major, in float64).

/** @typedef {ArrayLike<number>} Numbers */

/** @param {Numbers} a @param {Numbers} b @returns {Vec3} */
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/**
 * Return a + t b.
 * @param {Numbers} a
 * @param {Numbers} b
 * @param {number} t
 * @returns {Vec3}
 */
export const move = (a, b, t = 1) => [a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]];

/** @param {Numbers} a @param {Numbers} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** @param {Numbers} a @param {Numbers} b @returns {Vec3} */
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

/** @param {Numbers} a */
export const length = (a) => Math.hypot(a[0], a[1], a[2]);

/** @param {Numbers} a @param {Numbers} b */
export const measure = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

/** @param {Numbers} a @param {number} t @returns {Vec3} */
export const scale = (a, t) => [a[0] * t, a[1] * t, a[2] * t];

/** @param {Numbers} a @returns {Vec3} */
export const unit = (a) => scale(a, 1 / length(a));

/**
 * Multiply a 4 x 4 matrix and a homogeneous point.
 * @param {Numbers} m
 * @param {Numbers} p
 */
export function transform(m, p) {
  const out = [0, 0, 0, 0];
  for (let row = 0; row < 4; row++) {
    for (let k = 0; k < 4; k++) out[row] += m[4 * row + k] * p[k];
  }
  return out;
}
