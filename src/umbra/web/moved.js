// A proposal in another place: the vertices of its parts, turned about the middle of their plan
// and moved on the ground. The rest of the model stays, and so do heights.

import { makeBoxes, widen } from "./boxes.js";
import { findPlane } from "./planes.js";

/**
 * @typedef {object} Move of the proposal from where it was packed
 * @property {number} dx to the east of the plan [m]
 * @property {number} dy to the north [m]
 * @property {number} turn clockwise about the middle of its plan [degrees]
 */

export const NOWHERE = /** @type {Move} */ ({ dx: 0, dy: 0, turn: 0 });

/** @param {Move} move */
export const isMoved = ({ dx, dy, turn }) => dx !== 0 || dy !== 0 || turn !== 0;

/**
 * Tell a move in a caption; nothing if there is none.
 * @param {Proposal} proposal
 */
export const tellMove = ({ parts, move: { dx, dy, turn } }) => {
  if (!parts) return "";
  const way = dx || dy ? ` moved ${dx.toFixed(2)} m east, ${dy.toFixed(2)} m north` : "";
  return way || turn ? `proposal${way}${turn ? ` turned ${turn.toFixed(1)}°` : ""}` : "";
};

/**
 * Turn a way of the plan clockwise.
 * @param {number} x @param {number} y @param {number} turn [degrees]
 */
export const turnPlan = (x, y, turn) => {
  const angle = (turn * Math.PI) / 180,
    [c, s] = [Math.cos(angle), Math.sin(angle)];
  return [c * x + s * y, c * y - s * x];
};

export class Proposal {
  /** @param {Model} model */
  constructor(model) {
    this.model = model;
    /** @type {Float64Array | null} as packed; kept from the first move on */
    this.packed = null;
    /** @type {number[]} of the parts that were put last */
    this.faces = [];
    this.parts = "";
    this.move = NOWHERE;
    /** @type {[Vec3, Vec3]} of those parts as packed */
    this.box = [[0, 0, 0], [0, 0, 0]];
  }

  /** The middle of the plan, as packed, and the lowest height: where the proposal is held. */
  get foot() {
    const [low, high] = this.box;
    return /** @type {Vec3} */ ([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]);
  }

  /**
   * Where a place of the proposal comes to, from one move to another.
   * @param {Vec3} place @param {Move} from @param {Move} to
   * @returns {Vec3}
   */
  carry([x, y, z], from, to) {
    const [cx, cy] = this.foot;
    const [a, b] = turnPlan(x - cx - from.dx, y - cy - from.dy, to.turn - from.turn);
    return [cx + a + to.dx, cy + b + to.dy, z];
  }

  /**
   * Put parts in their place, all others where they were packed.
   * @param {number[]} parts @param {Move} move
   * @returns {{faces: number[], turned: number[]} | null} faces that moved, and those that are
   *   turned now; null if nothing moved
   */
  put(parts, move) {
    const { model } = this,
      key = parts.join();
    if (key === this.parts && move.dx === this.move.dx && move.dy === this.move.dy && move.turn === this.move.turn)
      return null;
    const before = isMoved(this.move) ? this.faces : [];
    if (key !== this.parts) this.#choose(parts);
    this.parts = key;
    this.move = move;
    if (!before.length && !isMoved(move)) return null;
    this.packed ??= model.places.slice();
    const { packed, faces } = this;
    for (const f of before) for (let k = 0; k < 3; k++) this.#set(model.faces[3 * f + k], packed);
    const done = new Set(),
      at = /** @type {Vec3} */ ([0, 0, 0]);
    for (const f of isMoved(move) ? faces : []) {
      for (let k = 0; k < 3; k++) {
        const vertex = model.faces[3 * f + k];
        if (done.has(vertex)) continue;
        done.add(vertex);
        for (let axis = 0; axis < 3; axis++) at[axis] = packed[3 * vertex + axis];
        this.carry(at, NOWHERE, move).forEach((value, axis) => {
          // As packed: whole steps, which float32 holds.
          model.places[3 * vertex + axis] = Math.fround(Math.round(value / model.step) * model.step);
        });
      }
    }
    const changed = [...new Set([...before, ...(isMoved(move) ? faces : [])])].sort((a, b) => a - b);
    this.#measure(changed);
    return { faces: changed, turned: faces };
  }

  /** @param {number[]} parts */
  #choose(parts) {
    const { facePart, faces } = this.model,
      wanted = new Set(parts),
      box = makeBoxes(1);
    this.faces = [];
    facePart.forEach((part, f) => {
      if (!wanted.has(part)) return;
      this.faces.push(f);
      for (let k = 0; k < 3; k++) widen(box, 0, this.packed ?? this.model.places, faces[3 * f + k]);
    });
    const [x, y, z, east, north, top] = box;
    this.box = [[x, y, z], [east, north, top]];
  }

  /** @param {number} vertex @param {Float64Array} from */
  #set(vertex, from) {
    for (let axis = 0; axis < 3; axis++) this.model.places[3 * vertex + axis] = from[3 * vertex + axis];
  }

  /**
   * Find planes and bounds of faces anew.
   * @param {number[]} changed in ascending order
   */
  #measure(changed) {
    const { model } = this,
      { faces, places, planes, faceCount, blocks, blockFaces, shells, blockStarts, shellCount } = model;
    for (const f of changed) {
      findPlane(places, faces, f).forEach((value, row) => (planes[row * faceCount + f] = value));
    }
    let next = 0;
    for (let block = 0; block + 1 < blockFaces.length && next < changed.length; block++) {
      if (changed[next] >= blockFaces[block + 1]) continue;
      while (next < changed.length && changed[next] < blockFaces[block + 1]) next += 1;
      blocks.fill(Infinity, 6 * block, 6 * block + 3).fill(-Infinity, 6 * block + 3, 6 * block + 6);
      for (let f = blockFaces[block]; f < blockFaces[block + 1]; f++) {
        for (let k = 0; k < 3; k++) widen(blocks, block, places, faces[3 * f + k]);
      }
    }
    const whole = makeBoxes(1);
    for (let shell = 0; shell < shellCount; shell++) {
      joinBoxes(shells, shell, blocks, blockStarts[shell], blockStarts[shell + 1]);
    }
    joinBoxes(whole, 0, shells, 0, shellCount);
    const [x, y, z, east, north, top] = whole;
    model.bounds = [[x, y, z], [east, north, top]];
    model.assumedGround = null;
  }
}

/**
 * Make a box hold others.
 * @param {Float64Array} boxes @param {number} box
 * @param {Float64Array} others @param {number} first @param {number} end
 */
const joinBoxes = (boxes, box, others, first, end) => {
  for (let k = 0; k < 6; k++) {
    let value = k < 3 ? Infinity : -Infinity;
    for (let i = first; i < end; i++)
      value = k < 3 ? Math.min(value, others[6 * i + k]) : Math.max(value, others[6 * i + k]);
    boxes[6 * box + k] = value;
  }
};
