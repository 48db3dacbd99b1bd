// The passes of a view besides its shadow volumes: surfaces, what is lit, sky, results, creases.

import { CELLS, CREASE, ENCODE, FILL, GROUND, RICH_SURFACE, SKY, SURFACE } from './shaders.js';
import { scale } from './vectors.js';

/** @typedef {import('./types.js').Overlay} Overlay */
/** @typedef {import('./types.js').Style} Style */
/** @typedef {import('./device.js').Device} Device */
/** @typedef {import('./device.js').Target} Target */
/** @typedef {import('./selection.js').Selection} Selection */
/** @typedef {import('./view.js').Sight} Sight */

/** Draws into the framebuffer that is bound. */
export class Passes {
  /** @param {Device} device */
  constructor(device) {
    const { gl } = device;
    this.device = device;
    this.nothing = gl.createVertexArray();
    this.plan = gl.createTexture();
    this.blank = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.blank);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    /** @type {Overlay | null} */
    this.overlay = null;
    /** @type {{array: WebGLVertexArrayObject | null, count: number, buffers: (WebGLBuffer | null)[]} | null} */
    this.cells = null;
  }

  /** @param {Overlay | null} overlay */
  setOverlay(overlay) {
    const { device } = this;
    const { gl } = device;
    this.overlay = overlay;
    this.deleteCells();
    if (overlay?.plan) {
      const filter = overlay.plan.smooth ? gl.LINEAR : gl.NEAREST;
      gl.bindTexture(gl.TEXTURE_2D, this.plan);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, overlay.plan.image);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    }
    if (overlay?.cells) {
      const { positions, colors, faces } = overlay.cells;
      const [place, color] = [device.makeBuffer(positions), device.makeBuffer(colors)];
      const indices = device.makeBuffer(faces, gl.ELEMENT_ARRAY_BUFFER);
      const array = device.makeArray(
        CELLS,
        { place: [place, 3, gl.FLOAT, 12, 0], color: [color, 4, gl.UNSIGNED_BYTE, 4, 0] },
        indices,
      );
      this.cells = { array, count: faces.length, buffers: [place, color, indices] };
    }
  }

  /**
   * Draw the surfaces and their depth.
   * @param {Selection} stage
   * @param {Record<string, any>} common
   * @param {Record<string, any>} light
   */
  drawSurfaces(stage, common, light) {
    const { device, overlay } = this;
    const { gl } = device;
    gl.disable(gl.STENCIL_TEST);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.depthFunc(device.nearer);
    gl.bindTexture(gl.TEXTURE_2D, overlay?.plan ? this.plan : this.blank);
    const onModel = overlay?.plan?.onModel ? common.plan : [0, 0, 0, 0];
    device.use(this.findSurface(light, common.isSection)).set({ ...common, ...light, plan: onModel });
    gl.bindVertexArray(stage.all);
    gl.drawElements(gl.TRIANGLES, stage.count, gl.UNSIGNED_INT, 0);
    if (common.groundSize) {
      device.use(GROUND).set({ ...common, ...light });
      gl.bindVertexArray(this.nothing);
      gl.drawArrays(gl.TRIANGLE_FAN, 0, common.groundSize);
    }
  }

  /**
   * Draw what a light shines on where the stencil is 0.
   * @param {Selection} stage
   * @param {Record<string, any>} common
   * @param {Record<string, any>} light
   */
  drawLit(stage, common, light) {
    const { device, overlay } = this;
    const { gl } = device;
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.depthFunc(device.notFarther);
    if (light.share === 0) {
      gl.enable(gl.BLEND);
      gl.blendFuncSeparate(gl.ONE, gl.ONE, gl.ZERO, gl.ONE);
    }
    gl.bindTexture(gl.TEXTURE_2D, overlay?.plan ? this.plan : this.blank);
    const onModel = overlay?.plan?.onModel ? common.plan : [0, 0, 0, 0];
    const program = device.use(this.findSurface(light, common.isSection)).set({ ...common, ...light, plan: onModel });
    gl.bindVertexArray(stage.lit);
    gl.enable(gl.CULL_FACE);
    gl.cullFace(gl.BACK);
    gl.drawElements(gl.TRIANGLES, stage.front, gl.UNSIGNED_INT, 0);
    if (stage.back) {
      program.set({ turn: -1 });
      gl.cullFace(gl.FRONT);
      gl.drawElements(gl.TRIANGLES, stage.back, gl.UNSIGNED_INT, 4 * stage.front);
    }
    gl.disable(gl.CULL_FACE);
    if (common.groundSize) {
      device.use(GROUND).set({ ...common, ...light });
      gl.bindVertexArray(this.nothing);
      gl.drawArrays(gl.TRIANGLE_FAN, 0, common.groundSize);
    }
    gl.disable(gl.BLEND);
  }

  /**
   * The program of the faces: a simple one where it can do.
   * @param {Record<string, any>} light
   * @param {boolean} isCut
   */
  findSurface(light, isCut) {
    return light.range > 0 || isCut || this.overlay?.plan?.onModel ? RICH_SURFACE : SURFACE;
  }

  /**
   * @param {Sight} sight
   * @param {Required<Style>} style
   */
  drawSky(sight, style) {
    const { device } = this;
    const { gl } = device;
    const half = sight.isPerspective ? sight.half : 0.4;
    device.use(SKY).set({
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
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /**
   * Draw creases and coloured cells over the surfaces.
   * @param {Selection} stage
   * @param {Sight} sight
   * @param {Record<string, any>} common
   * @param {Required<Style>} style
   */
  drawOver(stage, sight, common, style) {
    const { device } = this;
    const { gl } = device;
    gl.depthMask(false);
    gl.depthFunc(device.nearer);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    if (this.cells) {
      device.use(CELLS).set(common);
      gl.bindVertexArray(this.cells.array);
      gl.drawElements(gl.TRIANGLES, this.cells.count, gl.UNSIGNED_INT, 0);
    }
    if (style.edges) {
      const pixels = sight.rows / 2 / sight.half;
      device.use(CREASE).set({ ...common, pixels, ink: [...style.edge, 0.65] });
      gl.bindVertexArray(stage.creases);
      gl.drawElements(gl.LINES, stage.creaseCount, gl.UNSIGNED_INT, 0);
    }
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
   * Read the stencil wherever something is seen. It cannot be read itself: each of its bits adds its
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

  deleteCells() {
    const { gl } = this.device;
    if (!this.cells) return;
    gl.deleteVertexArray(this.cells.array);
    for (const buffer of this.cells.buffers) gl.deleteBuffer(buffer);
    this.cells = null;
  }

  delete() {
    const { gl } = this.device;
    this.deleteCells();
    gl.deleteVertexArray(this.nothing);
    gl.deleteTexture(this.plan);
    gl.deleteTexture(this.blank);
  }
}
