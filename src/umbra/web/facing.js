// Which instants' suns stand before the side of each face that a view sees: bits of faces as inks.
//
// Attached shadow is a matter of a face and a sun, not of a pixel. So faces are drawn once for 32
// instants, and each instant needs its volumes alone.

import { CUT_FACING, FACING } from "./hour_shaders.js";
import { findPlace } from "./shadows.js";

/** Instants of an ink: four bytes. */
export const BITS = 32;
/** @param {number} instants */
export const countGroups = (instants) => Math.max(1, Math.ceil(instants / BITS));
const PLACE = 12; // bytes of a vertex, before those of its inks

export class FacingFaces {
  /** @param {Device} device */
  constructor(device) {
    const { gl } = device;
    this.device = device;
    this.buffer = gl.createBuffer();
    this.words = new Uint32Array(0);
    this.count = 0;
    /** @type {(WebGLVertexArrayObject | null)[]} of 32 instants each */
    this.arrays = [];
    this.stride = 0;
  }

  /**
   * List the faces that a view sees.
   * @param {Model} model
   * @param {import('./seen.js').SeenFaces} seen
   * @param {Vec3[]} directions toward the suns
   */
  list({ faces, faceCount: n, places, planes }, { opaque, sides, count }, directions) {
    const { gl } = this.device,
      groups = countGroups(directions.length),
      words = PLACE / 4 + groups;
    if (words * 4 !== this.stride) this.#makeArrays(groups);
    if (this.words.length < 3 * count * words) this.words = new Uint32Array(3 * count * words);
    const inks = this.words,
      floats = new Float32Array(inks.buffer),
      suns = Float64Array.from(directions.flatMap((direction) => findPlace({ direction }).slice(0, 3))),
      bits = new Uint32Array(groups);
    let at = 0;
    for (let i = 0; i < count; i++) {
      const f = opaque[i],
        [x, y, z] = [planes[f], planes[n + f], planes[2 * n + f]];
      bits.fill(0);
      for (let k = 0; k < directions.length; k++) {
        // As volumes tell it, to the bit: a sun in the plane is at no side.
        const rise = x * suns[3 * k] + y * suns[3 * k + 1] + z * suns[3 * k + 2];
        if (rise * sides[f] > 0) bits[k >> 5] |= 1 << (k & 31);
      }
      for (let corner = 0; corner < 3; corner++) {
        const from = 3 * faces[3 * f + corner];
        for (let axis = 0; axis < 3; axis++) floats[at++] = places[from + axis];
        for (let group = 0; group < groups; group++) inks[at++] = bits[group];
      }
    }
    this.count = 3 * count;
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, inks, gl.STREAM_DRAW, 0, at);
  }

  /** @param {number} groups */
  #makeArrays(groups) {
    const { device, buffer } = this,
      { gl } = device;
    for (const array of this.arrays) gl.deleteVertexArray(array);
    this.stride = PLACE + 4 * groups;
    this.arrays = Array.from({ length: groups }, (_, group) =>
      device.makeArray(
        FACING,
        {
          place: [buffer, 3, gl.FLOAT, this.stride, 0],
          bits: [buffer, 4, gl.UNSIGNED_BYTE, this.stride, PLACE + 4 * group],
        },
        null,
      ),
    );
  }

  /**
   * Draw the listed faces where they are seen, in their inks of 32 instants.
   * @param {Record<string, any>} common
   * @param {number} group
   */
  draw(common, group) {
    const { device } = this,
      { gl } = device;
    device.use(common.isSection ? CUT_FACING : FACING).set(common);
    gl.bindVertexArray(this.arrays[group]);
    gl.drawArrays(gl.TRIANGLES, 0, this.count);
  }

  delete() {
    const { gl } = this.device;
    gl.deleteBuffer(this.buffer);
    for (const array of this.arrays) gl.deleteVertexArray(array);
  }
}
