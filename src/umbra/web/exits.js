// The faces of a ground that are turned from a sun: by these alone its rays come out again.
//
// In a picture that the sun would take, a ray is a point, and the side of an edge is a line. Loops are
// written out, as they run for thousands of edges at each instant of a day.

const CELLS = 512; // of that picture, along each axis

/** @param {number} at */
const findCell = (at) => (at > 0 ? (at < CELLS ? Math.floor(at) : CELLS - 1) : 0);

export class Exits {
  /**
   * @param {Model} model
   * @param {Uint32Array} vertices of the ground
   * @param {Uint32Array} faces of the ground
   */
  constructor(model, vertices, faces) {
    this.model = model;
    this.vertices = vertices;
    this.faces = faces;
    /** @type {number[]} the last sun */
    this.sun = [];
    /** of vertices, in cells */
    this.x = new Float64Array(model.places.length / 3);
    this.y = new Float64Array(model.places.length / 3);
    /** the last entry of each cell; face of each entry, and the entry before it in its cell; -1: none */
    this.cells = new Int32Array(CELLS * CELLS);
    /** @type {number[]} */
    this.entries = [];
    /** @type {number[]} */
    this.before = [];
  }

  /**
   * Find the exits of a sun.
   * @param {number[]} sun a direction
   * @param {Int8Array} side of each face, on which the sun is
   */
  find(sun, side) {
    if (sun.every((value, k) => value === this.sun[k])) return;
    this.sun = sun;
    const { before, cells, entries, faces, vertices, x, y } = this,
      { bounds, faces: corners, places } = this.model;
    const [[west, south, low], [right, back]] = bounds,
      pitch = CELLS / Math.max(right - west, back - south),
      flat = Math.hypot(sun[0], sun[1]);
    const [a, b] = flat > 0 ? [(-pitch * sun[1]) / flat, (pitch * sun[0]) / flat] : [pitch, 0];
    const [c, d, e] = [-b * sun[2], a * sun[2], b * sun[0] - a * sun[1]]; // across both
    const [u, v] = [(west + right) / 2, (south + back) / 2];
    for (let n = 0; n < vertices.length; n++) {
      const i = vertices[n],
        at = 3 * i;
      x[i] = CELLS / 2 + a * (places[at] - u) + b * (places[at + 1] - v);
      y[i] = CELLS / 2 + c * (places[at] - u) + d * (places[at + 1] - v) + e * (places[at + 2] - low);
    }
    cells.fill(-1);
    entries.length = before.length = 0;
    for (let n = 0; n < faces.length; n++) {
      const f = faces[n];
      if (side[f] >= 0) continue;
      const i = corners[3 * f],
        j = corners[3 * f + 1],
        k = corners[3 * f + 2];
      const from = findCell(Math.min(x[i], x[j], x[k])),
        to = findCell(Math.max(x[i], x[j], x[k]));
      const first = findCell(Math.min(y[i], y[j], y[k])),
        last = findCell(Math.max(y[i], y[j], y[k]));
      for (let row = first; row <= last; row++) {
        for (let cell = row * CELLS + from; cell <= row * CELLS + to; cell++) {
          before.push(cells[cell]);
          cells[cell] = entries.length;
          entries.push(f);
        }
      }
    }
  }

  /**
   * Whether the side of an edge may meet one, beyond the edge.
   * @param {number} p @param {number} q vertices of the ground
   */
  meet(p, q) {
    const { before, cells, entries, x, y } = this;
    const from = findCell(Math.min(x[p], x[q])),
      to = findCell(Math.max(x[p], x[q]));
    const first = findCell(Math.min(y[p], y[q])),
      last = findCell(Math.max(y[p], y[q]));
    for (let row = first; row <= last; row++) {
      for (let cell = row * CELLS + from; cell <= row * CELLS + to; cell++) {
        for (let at = cells[cell]; at >= 0; at = before[at])
          if (!this.#isAside(entries[at], p, q)) return true;
      }
    }
    return false;
  }

  /**
   * Whether a face surely lies before an edge, or beside it in the picture.
   * @param {number} f @param {number} p @param {number} q
   */
  #isAside(f, p, q) {
    if (this.rise(f, p) >= 0 && this.rise(f, q) >= 0) return true;
    const { faces } = this.model;
    const i = faces[3 * f],
      j = faces[3 * f + 1],
      k = faces[3 * f + 2];
    const a = this.#turn(p, q, i),
      b = this.#turn(p, q, j),
      c = this.#turn(p, q, k);
    if ((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0)) return true;
    return this.#divides(i, j, k, p, q) || this.#divides(j, k, i, p, q) || this.#divides(k, i, j, p, q);
  }

  /**
   * How high a vertex is above the plane of a face, in its lengths.
   * @param {number} f @param {number} i
   */
  rise(f, i) {
    const { faceCount: n, faces, places, planes } = this.model;
    if (faces[3 * f] === i || faces[3 * f + 1] === i || faces[3 * f + 2] === i) return 0;
    return (
      planes[f] * places[3 * i] + planes[n + f] * places[3 * i + 1] +
      planes[2 * n + f] * places[3 * i + 2] + planes[3 * n + f]
    );
  }

  /**
   * Twice the area of a triangle in the picture; exactly 0 where two corners are one vertex.
   * @param {number} i @param {number} j @param {number} k
   */
  #turn(i, j, k) {
    const { x, y } = this;
    return (x[j] - x[i]) * (y[k] - y[i]) - (y[j] - y[i]) * (x[k] - x[i]);
  }

  /**
   * Whether the line through two corners divides an edge from the third corner, in the picture.
   * @param {number} i @param {number} j @param {number} third
   * @param {number} p @param {number} q
   */
  #divides(i, j, third, p, q) {
    const inside = this.#turn(i, j, third);
    return inside * this.#turn(i, j, p) <= 0 && inside * this.#turn(i, j, q) <= 0;
  }
}
