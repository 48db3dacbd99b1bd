// Which of a day's instants reach each pixel of a picture: masks of bits, by shadow volumes.
//
// Depth is drawn once, and which suns each seen face is turned to. For each instant the volumes of its
// sun are counted in the stencil, and one bit is added where the count is 0. The sum of any instants
// is then one look at both bits, so that an interval can change without new volumes.

import { findRectangles } from "./canvas.js";
import { BITS, FacingFaces } from "./facing.js";
import { CUT_INK, INK, SUM } from "./hour_shaders.js";
import { CAP } from "./surface_shaders.js";
import { findUniforms } from "./uniforms.js";
import { move } from "./vectors.js";
import { FILL } from "./volume_shaders.js";

const NO_INK = [0, 0, 0, 0],
  FULL_INK = [1, 1, 1, 1];
const SEEN = [0, 1, 0, 0]; // ink of pixels that show a surface

/** @typedef {{texture: WebGLTexture, frame: WebGLFramebuffer}} MaskTarget */
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
    /** @type {MaskTarget[]} of 32 instants each: where no volume hides the sun */
    this.masks = [];
    /** @type {MaskTarget[]} and where faces are turned to it */
    this.facing = [];
    this.faces = new FacingFaces(device);
    /** @type {Vec3[]} toward the instants' suns */
    this.directions = [];
    this.sums = this.#makeTarget(null);
    /** @type {WebGLRenderbuffer | null} */
    this.depth = null;
    /** which instants are counted */
    this.isCounted = new Uint8Array(0);
    /** instants in the order of their bits, and the bit of each */
    this.order = new Uint16Array(0);
    this.bits = new Uint16Array(0);
    /** of which masks it is known where faces are turned to their suns */
    this.isFaced = new Uint8Array(0);
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
    for (const which of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T])
      gl.texParameteri(gl.TEXTURE_2D, which, gl.CLAMP_TO_EDGE);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    const kind = gl.DEPTH_STENCIL_ATTACHMENT;
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, kind, gl.RENDERBUFFER, depth);
    return { texture, frame };
  }

  /**
   * Begin with the renderer's views as they are now: draw depth, and forget all instants.
   * @param {number} ratio pixels in a CSS pixel
   * @param {Vec3[]} directions toward the suns of the instants
   * @param {number[]} first instants that are summed soon: few masks hold them
   */
  begin(ratio, directions, first = []) {
    const { renderer, device } = this,
      { gl } = device,
      { canvas, clip, ground } = renderer;
    const wide = canvas.clientWidth || canvas.width,
      high = canvas.clientHeight || canvas.height;
    const width = Math.max(1, Math.round(wide * ratio)),
      height = Math.max(1, Math.round(high * ratio));
    if (width !== this.sheet.width || height !== this.sheet.height) {
      this.#deleteTargets();
      this.sheet = { width, height, clientWidth: wide, clientHeight: high };
      this.depth = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, this.depth);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH32F_STENCIL8, width, height);
      this.sums = this.#makeTarget(this.depth);
    }
    const groups = Math.max(1, Math.ceil(directions.length / BITS));
    this.order = Uint16Array.from(new Set([...first, ...directions.keys()]));
    this.bits = new Uint16Array(directions.length);
    this.order.forEach((k, bit) => (this.bits[k] = bit));
    this.isFaced = new Uint8Array(groups);
    for (const targets of [this.masks, this.facing])
      while (targets.length < groups) targets.push(this.#makeTarget(this.depth));
    this.isCounted = new Uint8Array(directions.length);
    this.directions = directions;
    this.#eachView((stage, sight, common) => {
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.masks[0].frame);
      renderer.clear();
      stage.look(sight, common.cutsInto, ground);
      gl.disable(gl.STENCIL_TEST);
      gl.disable(gl.BLEND);
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(device.nearer);
      device.use(clip ? CUT_INK : INK).set({ ...common, ink: NO_INK });
      stage.seen.draw("opaque");
      this.#drawGround(common, NO_INK);
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
   * Find where faces are turned to the suns of a mask.
   * @param {number} group
   */
  #face(group) {
    const { device, renderer } = this,
      { gl } = device,
      suns = Array.from(this.order.subarray(BITS * group, BITS * (group + 1)), (k) => this.directions[k]);
    this.isFaced[group] = 1;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.facing[group].frame);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    this.#eachView((stage, sight, common) => {
      stage.look(sight, common.cutsInto, renderer.ground);
      gl.disable(gl.BLEND);
      gl.enable(gl.DEPTH_TEST);
      gl.depthMask(false);
      gl.depthFunc(device.notFarther);
      gl.clear(gl.STENCIL_BUFFER_BIT);
      gl.enable(gl.STENCIL_TEST);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR); // the first of two faces that lie in one place
      this.faces.list(renderer.model, stage.seen, suns);
      this.faces.draw(common);
      // Suns are above: they reach a ground that is seen from above.
      if (common.facing > 0) this.#drawGround(common, FULL_INK);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
      gl.disable(gl.STENCIL_TEST);
    });
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

  /** @param {Record<string, any>} common @param {number[]} ink */
  #drawGround(common, ink) {
    const { device, renderer } = this,
      { gl } = device;
    if (!common.groundSize) return;
    device.use(CAP).set({ ...common, ink });
    gl.bindVertexArray(renderer.passes.nothing);
    gl.drawArrays(gl.TRIANGLE_FAN, 0, common.groundSize);
  }

  /**
   * Add the bit of an instant where no volume hides its sun.
   * @param {number} k its place among the directions
   */
  count(k) {
    const { renderer, device } = this,
      { gl } = device,
      { ground, clip } = renderer;
    const fill = [0, 0, 0, 0],
      bit = this.bits[k],
      group = Math.floor(bit / BITS);
    fill[(bit % BITS) >> 3] = 2 ** (bit % 8) / 255;
    gl.clearStencil(0);
    gl.stencilMask(255);
    if (!this.isFaced[group]) this.#face(group);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.masks[group].frame);
    this.#eachView((stage, sight, common) => {
      gl.clear(gl.STENCIL_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      stage.shadows.prepare({ direction: this.directions[k] }, sight, ground, Boolean(clip));
      stage.shadows.count(sight, common);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.disable(gl.DEPTH_TEST);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE);
      device.use(FILL).set({ fill, behind: 0 });
      gl.bindVertexArray(renderer.passes.nothing);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      gl.disable(gl.BLEND);
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
        .map((k) => this.bits[k])
        .filter((bit) => Math.floor(bit / BITS) === group)
        .reduce((bits, bit) => bits | (1 << (bit % BITS)), 0);
      if (!wanted) return;
      gl.activeTexture(gl.TEXTURE1);
      gl.bindTexture(gl.TEXTURE_2D, this.facing[group].texture);
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      device.use(SUM).set({ masks: 0, facing: 1, wanted, behind });
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

  /** Free everything on the card. */
  delete() {
    this.faces.delete();
    this.#deleteTargets();
  }

  #deleteTargets() {
    const { gl } = this.device;
    for (const { texture, frame } of [...this.masks, ...this.facing, this.sums]) {
      gl.deleteTexture(texture);
      gl.deleteFramebuffer(frame);
    }
    gl.deleteRenderbuffer(this.depth);
    this.masks = [];
    this.facing = [];
  }
}
