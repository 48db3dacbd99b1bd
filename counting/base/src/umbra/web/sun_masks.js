// Which of a day's instants reach each pixel of a picture: masks of bits, by shadow volumes.
//
// Depth is drawn once. For each instant the volumes of its sun are counted in the stencil, and the
// faces and the ground that its light reaches add one bit where the count is 0. The sum of any
// instants is then one look at the bits, so that an interval can change without new volumes.

import { findRectangles } from "./canvas.js";
import { CUT_INK, INK, SUM } from "./hour_shaders.js";
import { CAP } from "./surface_shaders.js";
import { findUniforms } from "./uniforms.js";
import { move } from "./vectors.js";
import { FILL } from "./volume_shaders.js";

const BITS = 32; // of a texture: four bytes
const SEEN = [0, 1, 0, 0]; // ink of pixels that show a surface

/** @typedef {Pick<HTMLCanvasElement, 'width' | 'height' | 'clientWidth' | 'clientHeight'>} Sheet */

export class SunMasks {
  /**
   * @param {Renderer} renderer
   * @param {boolean} isSmooth whether sums are read between pixels, too
   */
  constructor(renderer, isSmooth) {
    const { device } = renderer,
      { gl } = device;
    this.renderer = renderer;
    this.device = device;
    this.filter = isSmooth ? gl.LINEAR : gl.NEAREST;
    /** @type {Sheet} */
    this.sheet = { width: 0, height: 0, clientWidth: 0, clientHeight: 0 };
    /** @type {{texture: WebGLTexture, frame: WebGLFramebuffer}[]} of 32 instants each */
    this.masks = [];
    this.sums = this.#makeTarget(null);
    /** @type {WebGLRenderbuffer | null} */
    this.depth = null;
    /** which instants are counted */
    this.isCounted = new Uint8Array(0);
  }

  /** @param {WebGLRenderbuffer | null} depth */
  #makeTarget(depth) {
    const { gl } = this.device,
      { width, height } = this.sheet;
    const texture = /** @type {WebGLTexture} */ (gl.createTexture()),
      frame = /** @type {WebGLFramebuffer} */ (gl.createFramebuffer());
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, Math.max(width, 1), Math.max(height, 1));
    for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_2D, which, this.filter);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    const kind = gl.DEPTH_STENCIL_ATTACHMENT;
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, kind, gl.RENDERBUFFER, depth);
    return { texture, frame };
  }

  /**
   * Begin with the renderer's views as they are now: draw depth, and forget all instants.
   * @param {number} ratio pixels in a CSS pixel
   * @param {number} count of instants
   */
  begin(ratio, count) {
    const { renderer, device } = this,
      { gl } = device,
      { canvas, clip, ground } = renderer;
    const wide = canvas.clientWidth || canvas.width,
      high = canvas.clientHeight || canvas.height;
    const width = Math.max(1, Math.round(wide * ratio)),
      height = Math.max(1, Math.round(high * ratio));
    if (width !== this.sheet.width || height !== this.sheet.height) {
      this.delete();
      this.sheet = { width, height, clientWidth: wide, clientHeight: high };
      this.depth = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, this.depth);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH32F_STENCIL8, width, height);
      this.sums = this.#makeTarget(this.depth);
    }
    while (this.masks.length < Math.max(1, Math.ceil(count / BITS)))
      this.masks.push(this.#makeTarget(this.depth));
    this.isCounted = new Uint8Array(count);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.masks[0].frame);
    this.#eachView((stage, sight, common) => {
      renderer.clear();
      stage.look(sight, common.cutsInto, ground);
      gl.disable(gl.STENCIL_TEST);
      gl.disable(gl.BLEND);
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(device.nearer);
      this.#drawInk(stage, common, "opaque", [0, 0, 0, 0]);
      if (clip)
        renderer.passes.drawCaps(stage, common, clip, renderer.size, move(...renderer.model.bounds));
    });
    gl.clearColor(0, 0, 0, 0);
    for (const { frame } of this.masks) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      gl.clear(gl.COLOR_BUFFER_BIT);
    }
  }

  /**
   * Draw each view's part of the sheet.
   * @param {(stage: import('./selection.js').Selection, sight: Sight, common: Record<string, any>) => void} act
   */
  #eachView(act) {
    const { renderer, device, sheet } = this,
      { gl } = device;
    gl.enable(gl.SCISSOR_TEST);
    for (const view of renderer.views) {
      const { viewport, scissor } = findRectangles(sheet, view);
      if (!(viewport[2] > 0 && viewport[3] > 0 && scissor[2] > 0 && scissor[3] > 0)) continue;
      const sight = renderer.findSight(view, sheet);
      const common = findUniforms(renderer, sight, device.setViewport(viewport));
      gl.scissor(...scissor);
      act(renderer.findStage(view), sight, common);
    }
    gl.disable(gl.SCISSOR_TEST);
  }

  /**
   * Draw faces and the ground in one ink.
   * @param {import('./selection.js').Selection} stage
   * @param {Record<string, any>} common
   * @param {'opaque' | 'lit'} what
   * @param {number[]} ink
   */
  #drawInk(stage, common, what, ink) {
    const { device, renderer } = this,
      { gl } = device;
    device.use(renderer.clip ? CUT_INK : INK).set({ ...common, ink });
    stage.seen.draw(what);
    // Suns are above: they reach a ground that is seen from above.
    if (!common.groundSize || (what === "lit" && common.facing < 0)) return;
    device.use(CAP).set({ ...common, ink });
    gl.bindVertexArray(renderer.passes.nothing);
    gl.drawArrays(gl.TRIANGLE_FAN, 0, common.groundSize);
  }

  /**
   * Add the bit of an instant where its sun is seen.
   * @param {number} k of the instant
   * @param {Vec3} direction toward the sun
   */
  count(k, direction) {
    const { renderer, device } = this,
      { gl } = device,
      { ground, clip } = renderer;
    const ink = [0, 0, 0, 0];
    ink[(k % BITS) >> 3] = 2 ** (k % 8) / 255;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.masks[Math.floor(k / BITS)].frame);
    gl.enable(gl.DEPTH_TEST);
    gl.clearStencil(0);
    this.#eachView((stage, sight, common) => {
      gl.stencilMask(255);
      gl.clear(gl.STENCIL_BUFFER_BIT);
      stage.look(sight, common.cutsInto, ground);
      stage.shadows.prepare({ direction }, sight, ground, Boolean(clip));
      stage.seen.listLit(stage.shadows.volumes.side);
      stage.shadows.count(sight, common);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR); // once, even where two faces lie in one place
      gl.depthFunc(device.notFarther);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE);
      this.#drawInk(stage, common, "lit", ink);
      gl.disable(gl.BLEND);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
      gl.disable(gl.STENCIL_TEST);
    });
    this.isCounted[k] = 1;
  }

  /**
   * Sum instants: in red how many of them reach a pixel, in steps of 1 / 255.
   * @param {number[]} instants
   */
  sum(instants) {
    const { device, renderer, sheet } = this,
      { gl } = device;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sums.frame);
    gl.viewport(0, 0, sheet.width, sheet.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.disable(gl.STENCIL_TEST);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(false);
    gl.depthFunc(gl.NOTEQUAL); // to the far plane
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    gl.bindVertexArray(renderer.passes.nothing);
    const behind = device.reverses ? 0 : 1;
    device.use(FILL).set({ fill: SEEN, behind });
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    this.masks.forEach(({ texture }, group) => {
      const wanted = instants
        .filter((k) => Math.floor(k / BITS) === group)
        .reduce((bits, k) => bits | (1 << (k % BITS)), 0);
      if (!wanted) return;
      gl.bindTexture(gl.TEXTURE_2D, texture);
      device.use(SUM).set({ masks: 0, wanted, behind });
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    });
    gl.disable(gl.BLEND);
  }

  /**
   * Read the sums of a rectangle; rows from the foot.
   * @param {number} x @param {number} y @param {number} wide @param {number} high [pixels]
   * @returns {Int16Array} -1 where nothing is seen
   */
  read(x, y, wide, high) {
    const { gl } = this.device;
    const bytes = new Uint8Array(4 * wide * high);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sums.frame);
    gl.readPixels(x, y, wide, high, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return Int16Array.from({ length: wide * high }, (_, k) => (bytes[4 * k + 1] ? bytes[4 * k] : -1));
  }

  delete() {
    const { gl } = this.device;
    for (const { texture, frame } of [...this.masks, this.sums]) {
      gl.deleteTexture(texture);
      gl.deleteFramebuffer(frame);
    }
    gl.deleteRenderbuffer(this.depth);
    this.masks = [];
  }
}
