// Vectors of three numbers.

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
