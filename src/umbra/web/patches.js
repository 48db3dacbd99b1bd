// Results on walls and roofs. Each sampled surface is a grid of squares in its own plane, and a
// square shows one sample. All grids lie side by side in one picture, which is laid on the faces.

import { inflate, unpack } from "./packed.js";

/**
 * The grids as `pack_grids` of writers/packing.py packs them.
 * @typedef {object} Packed
 * @property {string} grids per surface two axes (3 + 3), where its first square begins along them
 *   (2) and the side of its squares [m]; in coordinates about `origin`
 * @property {string} grid_shape squares along the two axes of each surface
 * @property {string} grid_samples sample of each square, row after row, surface after surface
 */

const ROW = 9; // numbers of a surface
const GAP = 1.02; // of the picture's width, for what is left free at the end of its shelves

const isLittle = new Uint8Array(new Uint32Array([1]).buffer)[0] === 1;

/**
 * Pack a colour as a picture keeps it in memory.
 * @param {number} r @param {number} g @param {number} b @param {number} a 0 to 255
 */
export const packColor = (r, g, b, a = 255) =>
  (isLittle ? (a << 24) | (b << 16) | (g << 8) | r : (r << 24) | (g << 16) | (b << 8) | a) >>> 0;

/** The grids of a model's sampled surfaces, and their picture. */
export class Patches {
  /**
   * @param {Model} model whose faces know their surfaces
   * @param {Float32Array} grids
   * @param {Int32Array} shape
   * @param {Int32Array} samples of squares
   * @param {Vec3} shift from the model's coordinates to those of the grids [m]
   */
  constructor(model, grids, shape, samples, shift) {
    this.model = model;
    this.grids = grids;
    this.shape = shape;
    this.samples = samples;
    this.shift = shift;
    const count = grids.length / ROW;
    this.first = new Uint32Array(count);
    for (let s = 1; s < count; s++) {
      this.first[s] = this.first[s - 1] + shape[2 * s - 2] * shape[2 * s - 1];
    }
    const { corners, wide, high } = arrange(shape);
    this.corners = corners;
    this.wide = wide;
    this.high = high;
    /** RGBA of the picture, row 0 first. */
    this.pixels = new Uint32Array(wide * high);
  }

  /**
   * Unpack a model's grids.
   * @param {Model} model
   * @param {Packed} packed
   * @param {number[]} origin of their coordinates, in the model's own [m]
   */
  static async read(model, packed, origin) {
    const shift = /** @type {Vec3} */ (model.origin.map((value, k) => value - origin[k]));
    const grids = new Float32Array(await inflate(packed.grids));
    const [shape, samples] = [await unpack(packed.grid_shape), await unpack(packed.grid_samples)];
    return new Patches(model, grids, shape, samples, shift);
  }

  /**
   * The unit normal of a surface, outward.
   * @param {number} surface
   * @returns {Vec3}
   */
  normal(surface) {
    const [ax, ay, az, bx, by, bz] = this.grids.subarray(ROW * surface, ROW * surface + 6);
    return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
  }

  /**
   * Where a place lies among the squares of a surface, along its two axes.
   * @param {number} surface
   * @param {ArrayLike<number>} point of the model
   * @returns {[number, number]}
   */
  flatten(surface, point) {
    const at = ROW * surface,
      { grids, shift } = this;
    const along = (/** @type {number} */ axis, /** @type {number} */ start) => {
      let sum = grids[at + start];
      for (let k = 0; k < 3; k++) sum += grids[at + axis + k] * (point[k] + shift[k]);
      return sum / grids[at + 8];
    };
    return [along(0, 6), along(3, 7)];
  }

  /**
   * The sample that a place of a surface shows.
   * @param {number} surface
   * @param {ArrayLike<number>} point
   */
  find(surface, point) {
    const [columns, rows] = this.shape.subarray(2 * surface, 2 * surface + 2);
    const [u, v] = this.flatten(surface, point);
    const column = Math.max(0, Math.min(columns - 1, Math.floor(u)));
    const row = Math.max(0, Math.min(rows - 1, Math.floor(v)));
    return this.samples[this.first[surface] + row * columns + column];
  }

  /**
   * Whether a face's own front, by its winding, is its surface's outward side.
   * @param {number} face
   */
  isOutward(face) {
    const [x, y, z] = this.model.faceNormal(face),
      normal = this.normal(this.model.surface[face]);
    return x * normal[0] + y * normal[1] + z * normal[2] > 0;
  }

  /**
   * Paint all squares.
   * @param {ArrayLike<number>} colors of the samples, as `packColor` packs them
   */
  paint(colors) {
    const { pixels, wide, corners, shape, samples } = this;
    let square = 0;
    for (let s = 0; s < this.first.length; s++) {
      const [columns, rows] = [shape[2 * s], shape[2 * s + 1]];
      for (let row = 0; row < rows; row++) {
        const start = (corners[2 * s + 1] + row) * wide + corners[2 * s];
        for (let column = 0; column < columns; column++) {
          pixels[start + column] = colors[samples[square++]];
        }
      }
    }
  }

  /**
   * The sampled faces as vertices: place, position in the picture, and its surface's rectangle
   * there.
   * Those whose fronts are outward come first.
   */
  makeVertices() {
    const { model, shape, corners } = this,
      { faces, places, surface } = model;
    /** @type {number[][]} */
    const sides = [[], []];
    surface.forEach((s, face) => {
      if (s >= 0) sides[this.isOutward(face) ? 0 : 1].push(face);
    });
    const listed = sides.flat(),
      vertices = new Float32Array(ROW * 3 * listed.length);
    listed.forEach((face, n) => {
      const s = surface[face];
      for (let k = 0; k < 3; k++) {
        const corner = places.subarray(3 * faces[3 * face + k], 3 * faces[3 * face + k] + 3);
        const [u, v] = this.flatten(s, corner);
        const [left, low] = [corners[2 * s], corners[2 * s + 1]];
        vertices.set(
          [
            ...corner,
            left + u,
            low + v,
            left,
            low,
            left + shape[2 * s] - 1,
            low + shape[2 * s + 1] - 1,
          ],
          ROW * (3 * n + k),
        );
      }
    });
    return { vertices, outward: 3 * sides[0].length, inward: 3 * sides[1].length };
  }
}

/**
 * Put rectangles on shelves, the highest first.
 * @param {Int32Array} shape width and height of each
 */
const arrange = (shape) => {
  const count = shape.length / 2,
    corners = new Int32Array(shape.length);
  let area = 0,
    wide = 1;
  for (let s = 0; s < count; s++) {
    area += shape[2 * s] * shape[2 * s + 1];
    wide = Math.max(wide, shape[2 * s]);
  }
  wide = Math.max(wide, Math.ceil(Math.sqrt(area) * GAP));
  let [x, y, high] = [0, 0, 1];
  const order = Array.from({ length: count }, (_, s) => s).sort(
    (a, b) => shape[2 * b + 1] - shape[2 * a + 1],
  );
  for (const s of order) {
    if (x + shape[2 * s] > wide) {
      x = 0;
      y += high;
      high = 1;
    }
    corners[2 * s] = x;
    corners[2 * s + 1] = y;
    x += shape[2 * s];
    high = Math.max(high, shape[2 * s + 1]);
  }
  return { corners, wide, high: y + high };
};
