// What one asks of a picture: what is seen at a place, and how many volumes hold each pixel.

import { findPageRectangle, findRectangles, fitCanvas } from "./canvas.js";
import { SKYLIGHT } from "./passes.js";
import { Target } from "./targets.js";
import { findUniforms } from "./uniforms.js";
import { dot, move, scale } from "./vectors.js";

/**
 * Find what is seen at a place, in the view that is drawn there last.
 * @param {Renderer} renderer
 * @param {number} x
 * @param {number} y
 * @returns {Hit | null}
 */
export function pickPlace(renderer, x, y) {
  const { model, canvas, ground, clip } = renderer;
  const view = [...renderer.views].reverse().find((candidate) => {
    const [left, top, wide, high] = candidate.scissor ?? findPageRectangle(canvas, candidate);
    return x >= left && x < left + wide && y >= top && y < top + high;
  });
  if (!view) return null;
  const [left, top, wide, high] = findPageRectangle(canvas, view);
  const sight = renderer.findSight(view);
  const [across, down] = [(x - left) / wide, (y - top) / high];
  const { from, towards } = sight.findRay(across * sight.columns, down * sight.rows);
  const { show } = renderer.findStage(view);
  const reach = ground === null ? Infinity : (ground - from[2]) / towards[2];
  const isHeld = (/** @type {Vec3} */ point) => !clip || dot(clip, point) + clip[3] >= 0;
  const nearest = sight.cameraNear;
  for (const { face, part, distance } of model.trace(from, towards, { cast: show, every: true })) {
    const position = move(from, towards, distance);
    if (distance < nearest || !isHeld(position)) continue;
    if (reach > 0 && distance > reach) break;
    const outward = model.faceNormal(face);
    const normal = dot(outward, towards) > 0 ? scale(outward, -1) : outward;
    return { part, face, position, normal };
  }
  if (!(reach > nearest && reach < Infinity)) return null;
  return {
    part: -1,
    face: -1,
    position: move(from, towards, reach),
    normal: [0, 0, towards[2] < 0 ? 1 : -1],
  };
}

/**
 * Count the shadow volumes of a light, modulo 256, at the centres of the first view's pixels.
 * @param {Renderer} renderer
 * @param {number} light
 * @param {number} [times] how many times as large a picture is drawn, odd: by default so that the
 *   rasteriser's grid (1/16 pixel in software, 1/256 on cards) is finer than 1/64 pixel
 * @returns {Int32Array} rows from the top; 0 where nothing is seen
 */
export function readCounts(renderer, light, times) {
  const { device, passes } = renderer;
  const { gl } = device;
  fitCanvas(renderer.canvas, renderer.options.pixelRatio);
  const view = renderer.views[0];
  const { viewport } = findRectangles(renderer.canvas, view);
  times ??= 2 * Math.ceil(64 / 2 ** gl.getParameter(gl.SUBPIXEL_BITS)) - 1;
  const [columns, rows] = [times * viewport[2], times * viewport[3]];
  const sight = renderer.findSight(view);
  const stage = renderer.findStage(view, true);
  const target = new Target(device, columns, rows, 1, gl.RGBA8);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
  gl.disable(gl.SCISSOR_TEST);
  const common = findUniforms(renderer, sight, device.setViewport([0, 0, columns, rows]));
  renderer.clear();
  stage.look(sight, common.cutsInto, renderer.ground);
  passes.drawSurfaces(stage, common, SKYLIGHT);
  stage.shadows.prepare(renderer.lights[light], sight, renderer.ground, Boolean(renderer.clip));
  stage.shadows.count(sight, common);
  const bytes = passes.readStencil(columns, rows);
  target.delete();
  const [wide, tall] = [viewport[2], viewport[3]];
  const counts = new Int32Array(wide * tall);
  const middle = (times - 1) / 2;
  for (let row = 0; row < tall; row++) {
    const line = (rows - 1 - times * row - middle) * columns + middle;
    for (let column = 0; column < wide; column++) {
      counts[row * wide + column] = bytes[4 * (line + times * column)];
    }
  }
  return counts;
}
