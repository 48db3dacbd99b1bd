// The passes of a view besides its shadow volumes: surfaces, what is lit, sky, results, creases.

import {
  CREASE, DOT, ENCODE, FILL, GROUND, PATCH, RICH_SURFACE, SKY, SURFACE,
} from './shaders.js';
import { scale } from './vectors.js';

/** @typedef {import('./types.js').Overlay} Overlay */
/** @typedef {import('./types.js').Style} Style */
/** @typedef {import('./device.js').Device} Device */
/** @typedef {import('./device.js').Target} Target */
/** @typedef {import('./selection.js').Selection} Selection */
/** @typedef {import('./view.js').Sight} Sight */

/**
 * Vertices of an overlay: those that are drawn at their fronts, then those at their backs.
 * @typedef {object} Laid
 * @property {WebGLVertexArrayObject | null} array
 * @property {number} outward
 * @property {number} inward
 * @property {(WebGLBuffer | null)[]} buffers
 */

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
    this.squares = gl.createTexture();
    /** @type {Laid | null} the faces of `overlay.patches` */
    this.patches = null;
    /** @type {Laid | null} */
    this.dots = null;
  }

  /** @param {Overlay | null} overlay */
  setOverlay(overlay) {
    const { device } = this;
    const { gl } = device;
    if (overlay?.patches !== this.overlay?.patches) this.patches = this.layPatches(overlay?.patches);
    this.dots = this.free(this.dots);
    this.overlay = overlay;
    if (overlay?.plan) {
      const filter = overlay.plan.smooth ? gl.LINEAR : gl.NEAREST;
      this.begin(this.plan, filter);
      const { image } = overlay.plan;
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
    }
    if (overlay?.patches) {
      const { wide, high, pixels } = overlay.patches, bytes = new Uint8Array(pixels.buffer);
      this.begin(this.squares, gl.NEAREST);
      gl.texImage2D(
        gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, wide, high, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes,
      );
    }
    if (overlay?.dots) {
      const { positions, colors } = overlay.dots;
      const buffers = [device.makeBuffer(positions), device.makeBuffer(colors)];
      const array = device.makeArray(
        DOT,
        { place: [buffers[0], 3, gl.FLOAT, 12, 0], paint: [buffers[1], 4, gl.UNSIGNED_BYTE, 4, 0] },
        null,
      );
      this.dots = { array, outward: positions.length / 3, inward: 0, buffers };
    }
  }

  /**
   * Bind a texture that takes a picture.
   * @param {WebGLTexture | null} texture
   * @param {number} filter
   */
  begin(texture, filter) {
    const { gl } = this.device;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  }

  /**
   * Put the faces of patches on the card.
   * @param {import('./patches.js').Patches} [patches]
   * @returns {Laid | null}
   */
  layPatches(patches) {
    const { device } = this, { gl } = device;
    this.free(this.patches);
    if (!patches) return null;
    const { vertices, outward, inward } = patches.makeVertices();
    const buffer = device.makeBuffer(vertices);
    const array = device.makeArray(
      PATCH,
      {
        place: [buffer, 3, gl.FLOAT, 36, 0],
        spot: [buffer, 2, gl.FLOAT, 36, 12],
        within: [buffer, 4, gl.FLOAT, 36, 20],
      },
      null,
    );
    return { array, outward, inward, buffers: [buffer] };
  }

  /**
   * Free what an overlay has on the card.
   * @param {Laid | null} laid
   */
  free(laid) {
    const { gl } = this.device;
    gl.deleteVertexArray(laid?.array ?? null);
    for (const buffer of laid?.buffers ?? []) gl.deleteBuffer(buffer);
    return null;
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
   * Draw results, creases and points over the surfaces.
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
    const pixels = sight.rows / 2 / sight.half;
    if (this.patches) this.drawPatches(this.patches, common);
    if (style.edges) {
      device.use(CREASE).set({ ...common, pixels, ink: [...style.edge, 0.65] });
      gl.bindVertexArray(stage.creases);
      gl.drawElements(gl.LINES, stage.creaseCount, gl.UNSIGNED_INT, 0);
    }
    if (this.dots) {
      const size = this.overlay?.dots?.size ?? 0;
      gl.bindVertexArray(this.dots.array);
      // Points behind something are seen faintly through it.
      for (const opacity of [0.3, 1]) {
        gl.depthFunc(opacity < 1 ? gl.ALWAYS : device.nearer);
        device.use(DOT).set({ ...common, pixels, size, opacity });
        gl.drawArrays(gl.POINTS, 0, this.dots.outward);
      }
    }
    gl.disable(gl.BLEND);
  }

  /**
   * Draw the squares of walls and roofs on their outward sides.
   * @param {Laid} patches
   * @param {Record<string, any>} common
   */
  drawPatches({ array, outward, inward }, common) {
    const { device } = this, { gl } = device;
    gl.bindTexture(gl.TEXTURE_2D, this.squares);
    gl.depthFunc(device.notFarther); // in the winding of the surface: its depth to the last bit
    gl.enable(gl.CULL_FACE);
    device.use(PATCH).set(common);
    gl.bindVertexArray(array);
    gl.cullFace(gl.BACK);
    gl.drawArrays(gl.TRIANGLES, 0, outward);
    gl.cullFace(gl.FRONT);
    gl.drawArrays(gl.TRIANGLES, outward, inward);
    gl.disable(gl.CULL_FACE);
    gl.depthFunc(device.nearer);
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

  delete() {
    const { gl } = this.device;
    this.free(this.patches);
    this.free(this.dots);
    gl.deleteVertexArray(this.nothing);
    for (const texture of [this.plan, this.blank, this.squares]) gl.deleteTexture(texture);
  }
}
