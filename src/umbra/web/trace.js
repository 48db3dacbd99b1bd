// Rays through a model, in float64: what is seen, and who casts a shadow.

import { misses } from './boxes.js';

/** @typedef {{part: number, face: number, distance: number}} Crossing */

/**
 * Find the faces that a ray meets, nearest first.
 * @param {Model} model
 * @param {Vec3} from
 * @param {Vec3} towards distances are in its length
 * @param {{cast?: Mask, every?: boolean, reach?: number}} options
 * @returns {Crossing[]}
 */
export function traceRay(model, from, towards, { cast = null, every = false, reach = Infinity }) {
  const { faceCount, facePart, planes } = model;
  /** @type {Crossing[]} */
  let hits = [];
  let far = reach;
  visitFaces(model, null, from, towards, () => far, (f) => {
    const part = facePart[f];
    if (cast && !cast[part]) return;
    const [nx, ny, nz] = [planes[f], planes[faceCount + f], planes[2 * faceCount + f]];
    const fall = nx * towards[0] + ny * towards[1] + nz * towards[2];
    if (fall === 0) return;
    const at = nx * from[0] + ny * from[1] + nz * from[2] + planes[3 * faceCount + f];
    const distance = -at / fall;
    if (!(distance > 0) || distance > far || !isThrough(model, f, from, towards)) return;
    const crossing = { part, face: f, distance };
    if (every) {
      hits.push(crossing);
    } else {
      hits = [crossing];
      far = distance;
    }
  });
  return hits.sort((a, b) => a.distance - b.distance);
}

/**
 * Visit the faces whose blocks a ray may meet before it has gone too far.
 * @param {Model} model
 * @param {Uint8Array | null} wanted which shells; null: all
 * @param {Vec3} from
 * @param {Vec3} towards
 * @param {() => number} far
 * @param {(face: number) => void} visit
 */
export function visitFaces(model, wanted, from, towards, far, visit) {
  const { shellCount, shells, blocks, blockStarts, blockFaces } = model;
  for (let shell = 0; shell < shellCount; shell++) {
    if (wanted && !wanted[shell]) continue;
    if (misses(shells, shell, from, towards, far())) continue;
    for (let block = blockStarts[shell]; block < blockStarts[shell + 1]; block++) {
      if (misses(blocks, block, from, towards, far())) continue;
      for (let f = blockFaces[block]; f < blockFaces[block + 1]; f++) visit(f);
    }
  }
}

/**
 * Whether a line passes through a face. The faces of an edge test it in one direction, so that a
 * line through the edge meets exactly one of them.
 * @param {Model} model @param {number} face @param {Vec3} from @param {Vec3} towards
 */
export function isThrough({ faces, places }, face, from, towards) {
  let positive = 0;
  for (let k = 0; k < 3; k++) {
    const i = faces[3 * face + k];
    const j = faces[3 * face + ((k + 1) % 3)];
    const [low, high] = [3 * Math.min(i, j), 3 * Math.max(i, j)];
    const ax = places[low] - from[0];
    const ay = places[low + 1] - from[1];
    const az = places[low + 2] - from[2];
    const bx = places[high] - from[0];
    const by = places[high + 1] - from[1];
    const bz = places[high + 2] - from[2];
    const side =
      towards[0] * (ay * bz - az * by) +
      towards[1] * (az * bx - ax * bz) +
      towards[2] * (ax * by - ay * bx);
    if (side >= 0 === i < j) positive += 1;
  }
  return positive === 0 || positive === 3;
}
