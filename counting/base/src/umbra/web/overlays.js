// Results over the model on the card: a plan's picture, squares on walls and roofs, discs at
// points.

import { DOT, PATCH } from "./mark_shaders.js";

/**
 * Vertices of an overlay: those that are drawn at their fronts, then those at their backs.
 * @typedef {object} Laid
 * @property {WebGLVertexArrayObject | null} array
 * @property {number} outward
 * @property {number} inward
 * @property {(WebGLBuffer | null)[]} buffers
 */

export class Overlays {
  /** @param {Device} device */
  constructor(device) {
    const { gl } = device;
    this.device = device;
    this.plan = gl.createTexture();
    this.blank = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.blank);
    const none = new Uint8Array(4);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, none);
    /** @type {Overlay | null} */
    this.overlay = null;
    this.squares = gl.createTexture();
    /** @type {Laid | null} the faces of `overlay.patches` */
    this.patches = null;
    /** @type {Laid | null} */
    this.dots = null;
  }

  /** The picture that lies over a plan. */
  get texture() {
    return this.overlay?.plan ? this.plan : this.blank;
  }

  /** @param {Overlay | null} overlay */
  set(overlay) {
    const { device } = this;
    const { gl } = device;
    if (overlay?.patches !== this.overlay?.patches)
      this.patches = this.layPatches(overlay?.patches);
    this.dots = this.free(this.dots);
    this.overlay = overlay;
    if (overlay?.plan) {
      const filter = overlay.plan.smooth ? gl.LINEAR : gl.NEAREST;
      this.begin(this.plan, filter);
      const { image } = overlay.plan;
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
    }
    if (overlay?.patches) {
      const { wide, high, pixels } = overlay.patches,
        bytes = new Uint8Array(pixels.buffer);
      this.begin(this.squares, gl.NEAREST);
      gl.texImage2D(
        gl.TEXTURE_2D,
        0,
        gl.SRGB8_ALPHA8,
        wide,
        high,
        0,
        gl.RGBA,
        gl.UNSIGNED_BYTE,
        bytes,
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
    const { device } = this,
      { gl } = device;
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
   * Draw the squares of walls and roofs on their outward sides.
   * @param {Record<string, any>} common
   */
  drawPatches(common) {
    const { device } = this,
      { gl } = device;
    if (!this.patches) return;
    const { array, outward, inward } = this.patches;
    gl.bindTexture(gl.TEXTURE_2D, this.squares);
    gl.depthFunc(device.notFarther); // in the winding of the surface: bit-identical depth
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
   * Draw the discs of points; those behind something are seen faintly through it.
   * @param {Record<string, any>} common
   * @param {number} pixels in a metre at distance 1, or anywhere in an orthographic view
   */
  drawDots(common, pixels) {
    const { device, dots } = this,
      { gl } = device;
    if (!dots) return;
    const size = this.overlay?.dots?.size ?? 0;
    gl.bindVertexArray(dots.array);
    for (const opacity of [0.3, 1]) {
      gl.depthFunc(opacity < 1 ? gl.ALWAYS : device.nearer);
      device.use(DOT).set({ ...common, pixels, size, opacity });
      gl.drawArrays(gl.POINTS, 0, dots.outward);
    }
  }

  delete() {
    const { gl } = this.device;
    this.free(this.patches);
    this.free(this.dots);
    for (const texture of [this.plan, this.blank, this.squares]) gl.deleteTexture(texture);
  }
}
