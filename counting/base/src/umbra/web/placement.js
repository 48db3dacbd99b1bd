// How each shell's shadow volume is counted: McGuire's cases, by bounds (umbra.volume.placement).

import { findGap } from "./boxes.js";
import { isBeyond } from "./view.js";

/** Its volume is out of view, or out of the light's range. */
export const CULLED = 0;
/** Case 1: nothing stands between the near rectangle and the light; sides, before the surface. */
export const Z_PASS = 1;
/** Case 2: the viewport may be in its shadow; sides and dark cap, behind the surface. */
export const Z_FAIL = 2;
/** Case 3: and it is in view; light cap, sides and dark cap, behind the surface. */
export const Z_FAIL_CAP = 3;

/**
 * A light and where its volumes end.
 * @typedef {object} Throw
 * @property {number[]} light homogeneous, local
 * @property {number} range of a lamp [m]
 * @property {number} bottom z where volumes end; -Infinity: at infinity
 * @property {number} floor z up to which a ground hides all from the eye; -Infinity: nothing
 * @property {number} tip weight of ends at infinity: 0, or nearly, so that they are very far away
 */

/**
 * Find the shells that lie out of view, beyond one of its planes.
 * @param {Model} model
 * @param {number[]} view
 */
export function findUnseen({ shells, shellCount }, view) {
  const unseen = new Uint8Array(shellCount);
  for (let shell = 0; shell < shellCount; shell++) {
    unseen[shell] = Number(isBeyond(view, shells, 6 * shell));
  }
  return unseen;
}

/**
 * Find the case of every shell, into `cases`.
 * @param {Model} model
 * @param {Sight} sight
 * @param {Throw} thrown
 * @param {Uint8Array} casts whether each shell casts
 * @param {Uint8Array} unseen whether each is out of view
 * @param {Uint8Array} cases
 */
export function placeShells(model, sight, thrown, casts, unseen, cases) {
  const { shells, shellCount, blocks, blockStarts } = model;
  const view = sight.findPlanes();
  const pyramid = sight.findPyramid(thrown.light);
  for (let shell = 0; shell < shellCount; shell++) {
    const at = 6 * shell;
    cases[shell] = CULLED;
    if (!casts[shell]) continue;
    if (thrown.light[3] && findGap(shells, shell, thrown.light) > thrown.range) continue;
    const isUnseen = unseen[shell] === 1;
    if (isUnseen && isThrownAside(view, shells, at, thrown)) continue;
    cases[shell] = Z_PASS;
    if (isBeyond(pyramid, shells, at)) continue;
    // The shell's box meets the pyramid: ask the boxes of its faces, if there are several.
    const [first, end] = [blockStarts[shell], blockStarts[shell + 1]];
    let meets = end - first === 1;
    for (let block = first; block < end && !meets; block++) {
      meets = !isBeyond(pyramid, blocks, 6 * block);
    }
    if (meets) cases[shell] = isUnseen ? Z_FAIL : Z_FAIL_CAP;
  }
}

/**
 * Whether the far end of a box's volume lies wholly beyond a plane that the box is beyond, too.
 * @param {number[]} planes
 * @param {Float64Array} boxes
 * @param {number} at
 * @param {Throw} thrown
 */
function isThrownAside(planes, boxes, at, { light, bottom }) {
  for (let p = 0; p < planes.length; p += 4) {
    const [a, b, c, d] = [planes[p], planes[p + 1], planes[p + 2], planes[p + 3]];
    let [near, far] = [d, 0];
    let slope = c;
    if (light[3]) {
      // Directions away from a lamp, of which it takes the one most inward; if they go on forever.
      far = -(a * light[0] + b * light[1] + c * light[2]);
    } else if (bottom === -Infinity) {
      far = -(a * light[0] + b * light[1] + c * light[2]);
    } else {
      // The place (x, y, z) ends at (x - kx (z - bottom), y - ky (z - bottom), bottom).
      slope = -(a * light[0] + b * light[1]) / light[2];
      far = d + (c - slope) * bottom;
    }
    for (let axis = 0; axis < 3; axis++) {
      const normal = planes[p + axis];
      const [low, high] = [boxes[at + axis], boxes[at + axis + 3]];
      near += Math.max(normal * low, normal * high);
      const thrown = axis === 2 ? slope : normal;
      if (light[3] || bottom !== -Infinity) far += Math.max(thrown * low, thrown * high);
    }
    if (near < 0 && far <= 0) return true;
  }
  return false;
}
