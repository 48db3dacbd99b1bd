// Lines in space, as wide everywhere, which the model hides.

import { LINE } from "./mark_shaders.js";

export class Lines {
  /** @param {Device} device */
  constructor(device) {
    this.device = device;
    this.buffer = device.gl.createBuffer();
    /** @type {WebGLVertexArrayObject | null} */
    this.array = null;
    /** @type {Line[] | null} */
    this.listed = null;
  }

  /**
   * Draw lines where nothing hides them.
   * @param {Line[]} lines
   * @param {Sight} sight
   * @param {Record<string, any>} common
   * @param {number} ratio pixels in a CSS pixel
   */
  draw(lines, sight, common, ratio) {
    const { device } = this,
      { gl } = device;
    if (!lines.length) return;
    if (lines !== this.listed) this.list(lines);
    const program = device.use(LINE).set(common);
    gl.depthMask(false);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    let first = 0;
    for (const {
      places,
      color: [r, g, b, alpha],
      width,
      isSky = false,
    } of lines) {
      const count = places.length - 1,
        { reverses } = device;
      gl.depthFunc(isSky ? device.notFarther : device.nearer);
      program.set({
        half_: [sight.columns, sight.rows].map((pixels) => (common.guard * pixels) / 2),
        width: width * ratio,
        isSky,
        reverses,
        ink: [r ** 2.2, g ** 2.2, b ** 2.2, alpha],
      });
      // A segment begins where the one before it ends.
      for (const name of ["from", "to"]) {
        const at = gl.getAttribLocation(program.program, name);
        gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 12, 12 * (first + (name === "to" ? 1 : 0)));
      }
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
      first += places.length;
    }
    gl.disable(gl.BLEND);
  }

  /**
   * Put the places of lines on the card.
   * @param {Line[]} lines
   */
  list(lines) {
    const { device } = this,
      { gl } = device;
    this.listed = lines;
    if (!this.array) {
      const segments =
        /** @type {[WebGLBuffer | null, number, number, number, number]} */
        ([this.buffer, 3, gl.FLOAT, 12, 0]);
      this.array = device.makeArray(LINE, { from: segments, to: segments }, null);
      gl.bindVertexArray(this.array);
      for (const name of ["from", "to"]) {
        gl.vertexAttribDivisor(gl.getAttribLocation(device.use(LINE).program, name), 1);
      }
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    const places = new Float32Array(lines.flatMap((line) => line.places.flat()));
    gl.bufferData(gl.ARRAY_BUFFER, places, gl.STREAM_DRAW);
  }

  delete() {
    const { gl } = this.device;
    gl.deleteVertexArray(this.array);
    gl.deleteBuffer(this.buffer);
  }
}
