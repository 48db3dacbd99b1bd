// The passes of a view besides its shadow volumes: surfaces, what is lit, sky, results, creases.

import { CREASE } from "./mark_shaders.js";
import { CAP, CUT, ENCODE, GROUND, RICH_GROUND } from "./surface_shaders.js";
import { RICH_SURFACE, SKY, SURFACE } from "./surface_shaders.js";
import { FILL } from "./volume_shaders.js";
import { Lines } from "./lines.js";
import { Overlays } from "./overlays.js";
import { WEAKEST } from "./selection.js";
import { cross, dot, move, scale, subtract, unit } from "./vectors.js";

/** @typedef {import('./selection.js').Selection} Selection */

const INK = [0.045, 0.05, 0.065, 1]; // of what a section cuts, linear
const NO_PLAN = [0, 0, 0, 0];

/** The light of the sky alone. */
export const SKYLIGHT = { light: [0, 0, 1, 0], tint: [0, 0, 0], range: 0, bend: 1 };

/** Draws into the framebuffer that is bound. */
export class Passes {
  /** @param {Device} device */
  constructor(device) {
    const { gl } = device;
    this.device = device;
    this.nothing = gl.createVertexArray();
    this.overlays = new Overlays(device);
    this.lines = new Lines(device);
  }

  /**
   * Draw the surfaces under the sky and a light, as if nothing cast a shadow, and their depth.
   * @param {Selection} stage
   * @param {Record<string, any>} common
   * @param {Record<string, any>} light
   */
  drawSurfaces(stage, common, light) {
    const { device } = this;
    const { gl } = device;
    gl.disable(gl.STENCIL_TEST);
    gl.disable(gl.BLEND);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.depthFunc(device.nearer);
    this.drawFaces(stage, common, light, false);
  }

  /**
   * Draw surfaces under the sky alone where the stencil is not 0.
   * @param {Selection} stage
   * @param {Record<string, any>} common
   */
  drawShadow(stage, common) {
    const { device } = this;
    const { gl } = device;
    gl.stencilFunc(gl.NOTEQUAL, 0, 255);
    gl.depthFunc(device.notFarther);
    this.drawFaces(stage, common, SKYLIGHT, true);
  }

  /**
   * Add a further light where the stencil is 0.
   * @param {Selection} stage
   * @param {Record<string, any>} common
   * @param {Record<string, any>} light
   */
  addLight(stage, common, light) {
    const { device } = this;
    const { gl } = device;
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.depthFunc(device.notFarther);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.ONE, gl.ONE, gl.ZERO, gl.ONE);
    this.drawFaces(stage, common, { ...light, share: 0 }, true);
    gl.disable(gl.BLEND);
  }

  /**
   * Draw faces and ground, tested and blended as is set.
   * @param {Selection} stage
   * @param {Record<string, any>} common
   * @param {Record<string, any>} light
   * @param {boolean} isLit only the faces that the listed light reaches, with the ground
   */
  drawFaces(stage, common, light, isLit) {
    const { device, overlays } = this;
    const { gl } = device;
    gl.bindTexture(gl.TEXTURE_2D, overlays.texture);
    const plan = overlays.overlay?.plan?.onModel ? common.plan : NO_PLAN;
    const program = this.useSurface({ ...common, ...light, plan });
    stage.seen.draw(isLit ? "lit" : "opaque", (side) => program.set({ side }));
    if (!common.groundSize) return;
    const isRich = light.range > 0 || common.plan[2] > 0;
    device.use(isRich ? RICH_GROUND : GROUND).set({ ...common, ...light });
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLE_FAN, 0, common.groundSize);
  }

  /**
   * Use the program of the faces: a simple one where it can do.
   * @param {Record<string, any>} uniforms
   */
  useSurface(uniforms) {
    const isRich = uniforms.range > 0 || uniforms.isSection || uniforms.plan[2] > 0;
    return this.device.use(isRich ? RICH_SURFACE : SURFACE).set(uniforms);
  }

  /**
   * Fill what a section cuts of solids: a ray that enters one through the cut leaves it once more
   * often than it enters.
   * @param {Selection} stage
   * @param {Record<string, any>} common
   * @param {number[]} plane
   * @param {number} size of the model [m]
   * @param {Vec3} corners the sum of its lowest and its highest corner
   */
  drawCaps(stage, common, plane, size, corners) {
    const { device } = this,
      { gl } = device;
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.ALWAYS, 0, 255);
    gl.stencilOpSeparate(gl.FRONT, gl.KEEP, gl.KEEP, gl.DECR_WRAP);
    gl.stencilOpSeparate(gl.BACK, gl.KEEP, gl.KEEP, gl.INCR_WRAP);
    gl.colorMask(false, false, false, false);
    gl.depthMask(false);
    gl.depthFunc(gl.ALWAYS);
    device.use(CUT).set(common);
    stage.seen.draw("solid");
    gl.colorMask(true, true, true, true);
    gl.depthMask(true);
    gl.depthFunc(device.nearer);
    gl.stencilFunc(gl.NOTEQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
    device
      .use(CAP)
      .set({ ...common, "corners[0]": findSquare(plane, size, corners, common.eye), ink: INK });
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLE_FAN, 0, 4);
    gl.disable(gl.STENCIL_TEST);
    gl.clear(gl.STENCIL_BUFFER_BIT);
  }

  /**
   * Draw what one sees through: in full light, as nothing is known of the light behind it.
   * @param {Selection} stage
   * @param {Record<string, any>} common
   * @param {Light[]} lights
   */
  drawPanes(stage, common, lights) {
    const { device } = this,
      { gl } = device;
    gl.depthMask(false);
    gl.depthFunc(device.nearer);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.bindTexture(gl.TEXTURE_2D, this.overlays.blank);
    const share = (lights.length ? 2 : 1) * common.share;
    const program = this.useSurface({ ...common, ...SKYLIGHT, share, plan: NO_PLAN });
    stage.seen.draw("panes", (side) => program.set({ side }));
    gl.disable(gl.BLEND);
  }

  /**
   * @param {Sight} sight
   * @param {Record<string, any>} common
   * @param {Required<Style>} style
   */
  drawSky(sight, common, style) {
    const { device } = this;
    const { gl } = device;
    const half = sight.isPerspective ? sight.half : 0.4;
    const within = common.groundSize ? sight.findSky(common.height) : [-1, -1, 1, 1];
    if (!within) return;
    device.use(SKY).set({
      ...common,
      within,
      forward: sight.forward,
      right: scale(sight.right, half * sight.aspect),
      up: scale(sight.up, half),
      behind: device.reverses ? 0 : 1,
      zenith: style.sky,
      horizon: style.horizon,
    });
    gl.depthMask(false);
    gl.depthFunc(gl.EQUAL);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  /**
   * Draw results, creases and points over the surfaces.
   * @param {Selection} stage
   * @param {Sight} sight
   * @param {Record<string, any>} common
   * @param {Required<Style>} style
   * @param {boolean} hasResults whether the overlay's patches and points are drawn
   */
  drawOver(stage, sight, common, style, hasResults) {
    const { device } = this;
    const { gl } = device;
    gl.depthMask(false);
    gl.depthFunc(device.nearer);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const pixels = sight.rows / 2 / sight.half;
    if (hasResults) this.overlays.drawPatches(common);
    if (style.edges) {
      stage.listCreases(sight, pixels);
      device.use(CREASE).set({ ...common, pixels, weakest: WEAKEST, ink: [...style.edge, 0.65] });
      gl.bindVertexArray(stage.creases);
      gl.drawElements(gl.LINES, stage.creaseCount, gl.UNSIGNED_INT, 0);
    }
    if (hasResults) this.overlays.drawDots(common, pixels);
    gl.disable(gl.BLEND);
  }

  /**
   * Encode a resolved picture as sRGB.
   * @param {Target} target
   */
  encode(target) {
    const { device } = this;
    const { gl } = device;
    gl.bindTexture(gl.TEXTURE_2D, target.texture);
    device.use(ENCODE).set({ picture: 0, behind: 0 });
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /**
   * Read the stencil wherever something is seen. It cannot be read itself: each of its bits adds
   * its
   * value to the picture.
   * @param {number} columns
   * @param {number} rows
   * @returns {Uint8Array} in the first of each four bytes; rows from the foot
   */
  readStencil(columns, rows) {
    const { device } = this;
    const { gl } = device;
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.bindVertexArray(this.nothing);
    gl.enable(gl.STENCIL_TEST);
    gl.depthFunc(gl.NOTEQUAL); // to the far plane
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    for (let bit = 1; bit < 256; bit *= 2) {
      gl.stencilFunc(gl.EQUAL, bit, bit);
      device.use(FILL).set({ fill: [bit / 255, 0, 0, 0], behind: device.reverses ? 0 : 1 });
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.disable(gl.BLEND);
    gl.disable(gl.STENCIL_TEST);
    const bytes = new Uint8Array(4 * columns * rows);
    gl.readPixels(0, 0, columns, rows, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return bytes;
  }

  delete() {
    const { gl } = this.device;
    gl.deleteVertexArray(this.nothing);
    this.overlays.delete();
    this.lines.delete();
  }
}

/**
 * The corners of a square in a plane, over all of a model, homogeneous and relative to the eye.
 * @param {number[]} plane
 * @param {number} size of the model [m]
 * @param {Vec3} corners the sum of its lowest and its highest corner
 * @param {Vec3} eye
 */
function findSquare(plane, size, corners, eye) {
  const normal = unit(plane),
    middle = scale(corners, 0.5);
  const off = (dot(plane, middle) + plane[3]) / Math.hypot(plane[0], plane[1], plane[2]);
  const centre = subtract(move(middle, normal, -off), eye);
  const along = unit(cross(normal, Math.abs(normal[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  const across = cross(normal, along);
  return [
    [1, 1],
    [-1, 1],
    [-1, -1],
    [1, -1],
  ].flatMap(([a, b]) => {
    return [...move(move(centre, along, a * size), across, b * size), 1];
  });
}
