// The types that the renderer and the page share. Nothing here runs.
//
// Positions and directions are in the model's local frame: metres, x east, y north, z up as in
// the file; add `model.origin` for the model's own coordinates. Screen positions are CSS pixels
// from the canvas's upper left corner. Colours are sRGB, 0 to 1.

/** @typedef {[number, number, number]} Vec3 */

/**
 * A sun (direction toward it, of any length) or a lamp (position; nothing beyond its range [m]).
 * @typedef {{direction: Vec3, color?: Vec3, intensity?: number}} Sun
 * @typedef {{position: Vec3, range?: number, color?: Vec3, intensity?: number}} Lamp
 * @typedef {Sun | Lamp} Light
 */

/**
 * Perspective with `fov` (vertical, degrees) or orthographic with `height` (of the picture,
 * metres).
 * @typedef {object} Camera
 * @property {Vec3} eye
 * @property {Vec3} target
 * @property {Vec3} [up] by default [0, 0, 1]
 * @property {number} [fov] by default 50
 * @property {number} [height]
 * @property {number} [near] by default 0.1 m; nothing nearer is seen
 */

/**
 * One picture in the canvas. Rectangles are left, top, width, height in CSS pixels. With only a
 * `scissor` the view is a cut of the whole canvas (before and after under one swipe); with a
 * `viewport` it is a picture with its own aspect (side by side).
 * @typedef {object} View
 * @property {[number, number, number, number]} [viewport] by default the whole canvas
 * @property {[number, number, number, number]} [scissor] by default the viewport
 * @property {ArrayLike<number | boolean> | null} [cast] per part, whether it casts; null: all
 * @property {ArrayLike<number | boolean> | null} [show] per part, whether it is drawn; null: all
 * @property {Camera} [camera] by default that of `setCamera`
 */

/**
 * Results. `plan` is a picture laid from above on the ground plane and, where `onModel`, on all
 * faces
 * that look up; row 0 is its north edge, alpha 0 shows the surface. `patches` are squares on the
 * outward sides of walls and roofs. `dots` are discs at points, in pixels across.
 * @typedef {object} Overlay
 * @property {{image: TexImageSource, extent: [number, number, number, number], onModel?: boolean,
 *   smooth?: boolean}} [plan] extent: xmin, ymin, xmax, ymax [m]
 * @property {import('./patches.js').Patches} [patches]
 * @property {{positions: Float32Array, colors: Uint8Array, size: number}} [dots] positions (n, 3),
 *   colors (n, 4) sRGB and alpha
 * @property {number} [opacity] by default 1
 * @property {boolean} [shaded] whether light and shadow still show on a plan; by default true
 */

/**
 * A line in space, as wide everywhere, that the model hides; with `isSky` all of the model does.
 * @typedef {object} Line
 * @property {Vec3[]} places
 * @property {[number, number, number, number]} color sRGB and alpha, 0 to 1
 * @property {number} width [CSS pixels]
 * @property {boolean} [isSky]
 */

/**
 * @typedef {object} Style
 * @property {Vec3} [sky] at the zenith
 * @property {Vec3} [horizon]
 * @property {Vec3} [ground]
 * @property {Vec3} [edge] colour of creases
 * @property {boolean} [edges] by default true
 * @property {boolean} [background] sky and horizon; false: transparent canvas
 */

/**
 * @typedef {object} Part
 * @property {string} name
 * @property {string} kind
 * @property {string} layer
 * @property {string} label as in the file's reports; unique to an object
 * @property {Vec3} color linear RGB
 * @property {number} opacity 1: nothing is seen through it
 * @property {number} faces number of faces
 */

/** @typedef {{part: number, face: number, position: Vec3, normal: Vec3}} Hit part -1: the ground */

/**
 * @typedef {object} RendererOptions
 * @property {number} [samples] of MSAA, by default 4 (as many as the device has)
 * @property {number} [pixelRatio] by default devicePixelRatio, followed when it changes
 * @property {Style} [style]
 */

/**
 * Of the last `draw`.
 * @typedef {object} Statistics
 * @property {number} milliseconds of JavaScript
 * @property {number} sides
 * @property {number} casters drawn
 * @property {number} behind casters counted behind the surface (z-fail)
 */

export {};
