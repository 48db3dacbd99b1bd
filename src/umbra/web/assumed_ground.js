// The ground that umbra assumes beneath a model: a surface without a hole, whose plan is a disc.
//
// Seen from above it hides all that is below, which leaves out half of the sides. A ray from a place
// above it to a light meets it first at a face that is turned from the light: these faces alone tell
// whether it hides the light. And the side of an edge that lies on it is beneath it, before nothing,
// unless such a face lets it out again.

import { makeBoxes, widen } from "./boxes.js";
import { Exits } from "./exits.js";

const KIND = /^AssumedGround/; // of its parts: between buildings, and under them

/**
 * Find the ground that umbra assumes; null: the model has none.
 * @param {Model} model
 */
export const findAssumedGround = (model) =>
  model.parts.some(({ kind }) => KIND.test(kind)) ? new AssumedGround(model) : null;

export class AssumedGround {
  /** @param {Model} model that has one */
  constructor(model) {
    const { facePart, faces, parts, places } = model;
    this.model = model;
    this.isPart = Uint8Array.from(parts, ({ kind }) => Number(KIND.test(kind)));
    this.faces = Uint32Array.from(facePart.keys()).filter((f) => this.isPart[facePart[f]]);
    const isVertex = new Uint8Array(places.length / 3);
    for (const f of this.faces) for (let k = 3 * f; k < 3 * f + 3; k++) isVertex[model.faces[k]] = 1;
    this.vertices = Uint32Array.from(isVertex.keys()).filter((i) => isVertex[i]);
    this.top = this.vertices.reduce((top, i) => Math.max(top, places[3 * i + 2]), -Infinity);
    this.edges = new Edges(model, this.faces);
    /** its edge in the place of each edge of the model, where two of its faces meet; -1: none */
    this.laid = new Int32Array(model.edgeCount).fill(-1);
    for (let i = 0; i < model.edgeCount; i++) {
      const [from, to] = [model.edgeFrom[i], model.edgeTo[i]];
      const at = isVertex[from] && isVertex[to] ? this.edges.find(from, to) : undefined;
      if (at !== undefined && this.edges.counts[at] === 2) this.laid[i] = at;
    }
    /** lines a x + b y + c = 0 along the border of its plan, (n, 3), positive inside */
    this.border = findBorder(model, this.edges);
    this.holdsAll = this.#holdsAll();
    this.exits = new Exits(model, this.vertices, this.faces);
  }

  /** Whether the plan of all else lies within its own. */
  #holdsAll() {
    const { isPart, model } = this,
      { facePart, faces, places } = model,
      box = makeBoxes(1);
    for (let f = 0; f < facePart.length; f++)
      if (!isPart[facePart[f]]) for (let k = 0; k < 3; k++) widen(box, 0, places, faces[3 * f + k]);
    const [west, south, , east, north] = box;
    return west > east || [[west, south], [west, north], [east, south], [east, north]].every(
      (corner) => this.#isWithin(corner),
    );
  }

  /**
   * Whether a place of the plan has the whole border around it.
   * @param {number[]} place
   */
  #isWithin([x, y]) {
    const { border } = this;
    for (let k = 0; k < border.length; k += 3)
      if (!(border[k] * x + border[k + 1] * y + border[k + 2] > 0)) return false;
    return border.length > 0;
  }

  /**
   * Whether a view sees nothing that is below it.
   * @param {Sight} sight
   */
  isSeenFromAbove(sight) {
    return (
      this.holdsAll &&
      sight.isAbove(this.top) &&
      sight.findCorners(sight.near).every((corner) => this.#isWithin(corner))
    );
  }

  /**
   * Whether the two faces at an edge of its own look at each other: one rises above the other's plane.
   * @param {number} at
   */
  #isValley(at) {
    const { faces } = this.model,
      { exits } = this,
      f = this.edges.first[at],
      k = 3 * this.edges.last[at];
    return exits.rise(f, faces[k]) + exits.rise(f, faces[k + 1]) + exits.rise(f, faces[k + 2]) > 0;
  }

  /**
   * Whether the side of an edge lies beneath it, by the sun of `exits`.
   * @param {number} edge
   * @param {Int8Array} side of each face, on which the sun is
   */
  buries(edge, side) {
    const at = this.laid[edge];
    if (at < 0) return false;
    // Where only one of its two faces is lit, a side begins beneath the ground in a valley.
    const here = side[this.edges.first[at]],
      there = side[this.edges.last[at]];
    if (!(here > 0 && there > 0) && !(here * there < 0 && this.#isValley(at))) return false;
    return !this.exits.meet(this.model.edgeFrom[edge], this.model.edgeTo[edge]);
  }
}

/** The edges of a ground, by their vertices: a model's own pairs may join other faces there. */
class Edges {
  /** @param {Model} model @param {Uint32Array} listed faces of the ground */
  constructor(model, listed) {
    const { faces, places } = model,
      most = 3 * listed.length;
    /** @type {number} */
    this.vertexCount = places.length / 3;
    /** @type {Map<number, number>} */
    this.numbers = new Map();
    /** vertices, wound as in the first face; the first face and the last; how many meet */
    this.from = new Uint32Array(most);
    this.to = new Uint32Array(most);
    this.first = new Uint32Array(most);
    this.last = new Uint32Array(most);
    this.counts = new Uint8Array(most);
    for (const f of listed) {
      for (let k = 0; k < 3; k++) {
        const [from, to] = [faces[3 * f + k], faces[3 * f + ((k + 1) % 3)]];
        const at = this.find(from, to) ?? this.numbers.size;
        if (this.counts[at] === 0) {
          this.numbers.set(this.#name(from, to), at);
          this.from[at] = from;
          this.to[at] = to;
          this.first[at] = f;
        }
        this.last[at] = f;
        this.counts[at] += 1;
      }
    }
  }

  /** @param {number} i @param {number} j @returns {number} */
  #name(i, j) {
    return Math.min(i, j) * this.vertexCount + Math.max(i, j);
  }

  /**
   * The number of the edge between two vertices.
   * @param {number} i @param {number} j
   * @returns {number | undefined}
   */
  find(i, j) {
    return this.numbers.get(this.#name(i, j));
  }
}

/**
 * Find the lines along the border of a ground's plan.
 * @param {Model} model @param {Edges} edges of the ground
 */
const findBorder = ({ places, step }, { counts, from, to, numbers }) => {
  /** @type {number[]} */
  const lines = [];
  for (let at = 0; at < numbers.size; at++) {
    if (counts[at] !== 1) continue;
    // A face winds its edges counter-clockwise seen from above.
    const [p, q] = [3 * from[at], 3 * to[at]];
    const [a, b] = [places[p + 1] - places[q + 1], places[q] - places[p]];
    // Upright ones, but for the rounding of places, close on themselves: steps that meet there are
    // divided at different heights.
    if (Math.hypot(a, b) > 2 * step) lines.push(a, b, -(a * places[p] + b * places[p + 1]));
  }
  return Float64Array.from(lines);
};
