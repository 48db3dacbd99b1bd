// WebGL2 renderer: exact shadows by stencil shadow volumes.

/** @typedef {import('./types.js').Camera} Camera */
/** @typedef {import('./types.js').Hit} Hit */
/** @typedef {import('./types.js').Light} Light */
/** @typedef {import('./types.js').Overlay} Overlay */
/** @typedef {import('./types.js').RendererOptions} RendererOptions */
/** @typedef {import('./types.js').Statistics} Statistics */
/** @typedef {import('./types.js').Style} Style */
/** @typedef {import('./types.js').View} View */
/** @typedef {import('./types.js').Vec3} Vec3 */
/** @typedef {import('./model.js').Model} Model */

/** The browser or the machine has no WebGL2; show pictures instead. */
export class WebGLMissing extends Error {}

/**
 * Draws a model with its shadows into a canvas. `set...` keeps state, `draw` draws it once; nothing
 * is drawn on its own, and nothing is computed twice while it does not change.
 */
export class Renderer {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Model} model
   * @param {RendererOptions} [options]
   */
  constructor(canvas, model, options = {}) {
    this.canvas = canvas;
    this.model = model;
    this.options = options;
    /** @type {(() => void) | null} called when the context is lost: nothing is drawn until restored */
    this.onlost = null;
    /** @type {(() => void) | null} called when it is restored: draw again */
    this.onrestored = null;
    /** @type {Statistics} */
    this.statistics = { milliseconds: 0, sides: 0, casters: 0, behind: 0, counts: 'stencil' };
  }

  /** @param {Light[]} lights none: night, ambient light alone */
  setLights(lights) {}

  /** @param {Camera} camera */
  setCamera(camera) {}

  /**
   * Which parts cast and which are drawn, one number per part (0 or 1); null: all.
   * @param {ArrayLike<number | boolean> | null} cast
   * @param {ArrayLike<number | boolean> | null} [show] by default as `cast`
   */
  setParts(cast, show = cast) {}

  /** @param {View[] | null} views drawn in their order; null: one of the whole canvas */
  setViews(views) {}

  /** @param {number | null} z of an endless ground plane that receives shadows [m] */
  setGround(z) {}

  /** @param {Overlay | null} overlay */
  setOverlay(overlay) {}

  /**
   * A section: surfaces are drawn where a x + b y + c z + d >= 0; what is cut off still casts.
   * @param {[number, number, number, number] | null} plane
   */
  setClip(plane) {}

  /** @param {Style} style changes what it names */
  setStyle(style) {}

  /** Draw one frame. Call it in the same task as `canvas.toBlob` for a screenshot. */
  draw() {}

  /**
   * Find what is seen at a place, in the view that is drawn there last.
   * @param {number} x
   * @param {number} y
   * @returns {Hit | null}
   */
  pick(x, y) {
    return null;
  }

  /**
   * Project a place to the canvas; null behind the eye.
   * @param {Vec3} place
   * @param {View} [view] by default the whole canvas
   * @returns {{x: number, y: number} | null}
   */
  project(place, view) {
    return null;
  }

  /**
   * Count the shadow volumes of a light at every pixel of the first view, at the pixels' centres.
   * @param {number} light
   * @returns {Int32Array} rows from the top; 0 where nothing is seen
   */
  readCounts(light) {
    return new Int32Array(0);
  }

  /** Free everything on the card. */
  dispose() {}
}
