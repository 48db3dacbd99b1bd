// Which instants' suns stand before the side of each face that a view sees: bits of faces as inks.
//
// Attached shadow is a matter of a face and a sun, not of a pixel. So faces are drawn once for 32
// instants, and each instant needs its volumes alone.

import { CUT_FACING, FACING } from "./hour_shaders.js";
import { findPlace } from "./shadows.js";

/** Instants of an ink: four bytes. */
export const BITS = 32;
const WORDS = 4; // of a vertex: three coordinates, and its ink

export class FacingFaces {
  /** @param {Device} device */
  constructor(device) {
    const { gl } = device;
    this.device = device;
    this.buffer = gl.createBuffer();
    this.words = new Uint32Array(0);
    this.count = 0;
    this.array = device.makeArray(
      FACING,
      {
        place: [this.buffer, 3, gl.FLOAT, 4 * WORDS, 0],
        bits: [this.buffer, 4, gl.UNSIGNED_BYTE, 4 * WORDS, 4 * (WORDS - 1)],
      },
      null,
    );
  }

  /**
   * List the faces that a view sees.
   * @param {Model} model
   * @param {import('./seen.js').SeenFaces} seen
   * @param {Vec3[]} directions toward the suns of at most 32 instants
   */
  list({ faces, faceCount: n, places, planes }, { opaque, sides, count }, directions) {
    const { gl } = this.device;
    if (this.words.length < 3 * count * WORDS) this.words = new Uint32Array(3 * count * WORDS);
    const inks = this.words,
      floats = new Float32Array(inks.buffer),
      suns = Float64Array.from(directions.flatMap((direction) => findPlace({ direction }).slice(0, 3)));
    let at = 0;
    for (let i = 0; i < count; i++) {
      const f = opaque[i],
        [x, y, z] = [planes[f], planes[n + f], planes[2 * n + f]];
      let bits = 0;
      for (let k = 0; k < directions.length; k++) {
        // As volumes tell it, to the bit: a sun in the plane is at no side.
        const rise = x * suns[3 * k] + y * suns[3 * k + 1] + z * suns[3 * k + 2];
        if (rise * sides[f] > 0) bits |= 1 << k;
      }
      for (let corner = 0; corner < 3; corner++) {
        const from = 3 * faces[3 * f + corner];
        for (let axis = 0; axis < 3; axis++) floats[at++] = places[from + axis];
        inks[at++] = bits;
      }
    }
    this.count = 3 * count;
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, inks, gl.STREAM_DRAW, 0, at);
  }

  /**
   * Draw the listed faces where they are seen, in their inks.
   * @param {Record<string, any>} common
   */
  draw(common) {
    const { device } = this,
      { gl } = device;
    device.use(common.isSection ? CUT_FACING : FACING).set(common);
    gl.bindVertexArray(this.array);
    gl.drawArrays(gl.TRIANGLES, 0, this.count);
  }

  delete() {
    const { gl } = this.device;
    gl.deleteBuffer(this.buffer);
    gl.deleteVertexArray(this.array);
  }
}
