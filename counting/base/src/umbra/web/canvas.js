// A canvas in its page: its pixels, and the rectangles of views in them.

/** @typedef {[number, number, number, number]} Rectangle left, lower end, width, height [pixels] */

/**
 * Fit a canvas to its place on the page; return whether it has any pixels.
 * @param {HTMLCanvasElement} canvas
 * @param {number} [ratio] pixels of the canvas in a CSS pixel
 */
export function fitCanvas(canvas, ratio = window.devicePixelRatio) {
  if (canvas.isConnected && canvas.clientWidth) {
    const columns = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const rows = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== columns) canvas.width = columns;
    if (canvas.height !== rows) canvas.height = rows;
  }
  return canvas.width > 0 && canvas.height > 0;
}

/**
 * Pixels of a canvas in a CSS pixel.
 * @param {Pick<HTMLCanvasElement, 'width' | 'clientWidth'>} canvas
 */
export const findRatio = (canvas) => (canvas.clientWidth ? canvas.width / canvas.clientWidth : 1);

/**
 * A view's rectangles in pixels from the lower left corner, as OpenGL's.
 * @param {import('./sun_masks.js').Sheet} canvas
 * @param {View} view
 */
export function findRectangles(canvas, view) {
  const ratio = findRatio(canvas);
  const { width, height } = canvas;
  /** @type {(r: ArrayLike<number>) => Rectangle} */
  const turn = (r) => {
    const [left, right] = [Math.round(r[0] * ratio), Math.round((r[0] + r[2]) * ratio)];
    const [top, foot] = [Math.round(r[1] * ratio), Math.round((r[1] + r[3]) * ratio)];
    return [left, height - foot, Math.max(right - left, 0), Math.max(foot - top, 0)];
  };
  /** @type {Rectangle} */
  const viewport = view.viewport ? turn(view.viewport) : [0, 0, width, height];
  const scissor = view.scissor ? turn(view.scissor) : viewport;
  return { viewport, scissor };
}

/**
 * A view's place on the page. Of it, not of whole pixels of the canvas, are pointers told: while
 * things move on a slow machine, the canvas has fewer pixels than the page.
 * @param {HTMLCanvasElement} canvas
 * @param {View} view
 * @returns {Rectangle} left, top, width, height [CSS pixels of the canvas]
 */
export function findPageRectangle(canvas, view) {
  if (view.viewport) return [...view.viewport];
  const { clientWidth, clientHeight, width, height } = canvas;
  return clientWidth ? [0, 0, clientWidth, clientHeight] : [0, 0, width, height];
}

/**
 * The part of a scissor that lies in a rectangle of the viewport.
 * @param {Rectangle} viewport
 * @param {Rectangle} scissor
 * @param {Rectangle} within
 * @returns {Rectangle}
 */
export function narrow(viewport, scissor, within) {
  const left = Math.max(scissor[0], viewport[0] + within[0]);
  const low = Math.max(scissor[1], viewport[1] + within[1]);
  const right = Math.min(scissor[0] + scissor[2], viewport[0] + within[0] + within[2]);
  const high = Math.min(scissor[1] + scissor[3], viewport[1] + within[1] + within[3]);
  return [left, low, Math.max(right - left, 0), Math.max(high - low, 0)];
}
