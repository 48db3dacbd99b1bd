// Surfaces in the colours of their hours of sun.

import { CUT_HOUR_SURFACE, HOUR_GROUND, HOUR_SURFACE } from "./hour_shaders.js";

/**
 * @typedef {object} HourLayer
 * @property {import('./sun_masks.js').SunMasks} masks whose sums are shown
 * @property {number} most instants of a whole sum
 * @property {number[][]} colors of no sun, then from the first instant to all, sRGB 0 to 255
 */

export class HourPass {
  /** @param {Device} device */
  constructor(device) {
    this.device = device;
    this.ramp = device.gl.createTexture();
    /** @type {number[][] | null} on the card */
    this.colors = null;
  }

  /**
   * Draw faces and ground, and their depth.
   * @param {import('./selection.js').Selection} stage
   * @param {Record<string, any>} common
   * @param {HourLayer} layer
   * @param {WebGLVertexArrayObject | null} nothing
   */
  draw(stage, common, { masks, most, colors }, nothing) {
    const { device } = this,
      { gl } = device,
      { width, height } = gl.canvas;
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.ramp);
    if (colors !== this.colors) this.#setColors(colors);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, masks.sums.texture);
    gl.disable(gl.STENCIL_TEST);
    gl.disable(gl.BLEND);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.depthFunc(device.nearer);
    const uniforms = { ...common, sums: 0, ramp: 1, picture: [width, height], most };
    const program = device.use(common.isSection ? CUT_HOUR_SURFACE : HOUR_SURFACE).set(uniforms);
    stage.seen.draw("opaque", (side) => program.set({ side }));
    if (!common.groundSize) return;
    device.use(HOUR_GROUND).set(uniforms);
    gl.bindVertexArray(nothing);
    gl.drawArrays(gl.TRIANGLE_FAN, 0, common.groundSize);
  }

  /** @param {number[][]} colors */
  #setColors(colors) {
    const { gl } = this.device;
    this.colors = colors;
    const bytes = Uint8Array.from(colors.flatMap((rgb) => [...rgb, 255]));
    gl.texImage2D(
      gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, colors.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes,
    );
    for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_2D, which, gl.NEAREST);
  }

  delete() {
    this.device.gl.deleteTexture(this.ramp);
  }
}
