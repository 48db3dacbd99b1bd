// Components that must follow the open rule for one view and light (umbra.rays.eye_count).
//
// Lit faces alone determine the count only where a visible point is inside a closed component as
// often as the light is. That can fail only for components that hold a lamp or are wound inward.

import { isThrough, visitFaces } from "./trace.js";
import { dot } from "./vectors.js";

const SKY = /** @type {Vec3} */ ([0.36, 0.48, 0.8]); // a direction to infinity

/**
 * Find the closed components to open; null: none.
 * @param {Volumes} volumes
 * @param {Sight} sight
 * @param {number[]} light homogeneous
 * @returns {Uint8Array | null}
 */
export function findOpened(volumes, sight, light) {
  const { model } = volumes;
  const suspects = findSuspects(volumes, light);
  if (!suspects) return null;
  const { shells, components } = suspects;
  const opened = new Uint8Array(components.length);
  const apex = sight.apex;
  if (apex[3] || light[3]) {
    const isFromEye = apex[3] !== 0;
    const [start, end] = isFromEye ? [apex, light] : [light, apex];
    const towards = /** @type {Vec3} */ ([0, 1, 2].map((k) => end[k] - end[3] * start[k]));
    const from = /** @type {Vec3} */ (start.slice(0, 3));
    const net = countThrough(model, shells, from, towards, end[3] ? 1 : Infinity);
    // From eye to light: faces left at their fronts are lit.
    net.forEach((value, k) => {
      if (components[k] && (isFromEye ? value : -value) < 0) opened[k] = 1;
    });
  }
  if (sight.nearest <= sight.cameraNear) openCut(model, components, shells, sight, light, opened);
  return opened.includes(1) ? opened : null;
}

/**
 * Find the closed components that hold a lamp, by their shells' boxes, or are wound inward.
 * @param {Volumes} volumes
 * @param {number[]} light
 */
function findSuspects({ model, isClosed }, light) {
  const { shells, shellCount, faceStarts, faceComponent, isInward } = model;
  const isInside = (/** @type {number} */ shell) =>
    light[3] !== 0 &&
    [0, 1, 2].every(
      (k) => light[k] >= shells[6 * shell + k] && light[k] <= shells[6 * shell + 3 + k],
    );
  if (!light[3] && !isInward.includes(1)) return null;
  const wanted = new Uint8Array(shellCount);
  const components = new Uint8Array(isClosed.length);
  let any = false;
  for (let shell = 0; shell < shellCount; shell++) {
    const isHeld = isInside(shell);
    for (let f = faceStarts[shell]; f < faceStarts[shell + 1]; f++) {
      const k = faceComponent[f];
      if (isClosed[k] && (isHeld || isInward[k])) any = Boolean((wanted[shell] = components[k] = 1));
    }
  }
  return any ? { shells: wanted, components } : null;
}

/**
 * Count the faces that a ray leaves at their fronts less those that it enters, by component.
 * @param {Model} model
 * @param {Uint8Array} shells
 * @param {Vec3} from
 * @param {Vec3} towards
 * @param {number} reach in lengths of `towards`
 */
function countThrough(model, shells, from, towards, reach) {
  const { faceCount, planes, faceComponent, isClosed } = model;
  const net = new Int32Array(isClosed.length);
  visitFaces(
    model,
    shells,
    from,
    towards,
    () => reach,
    (f) => {
      const normal = [planes[f], planes[faceCount + f], planes[2 * faceCount + f]];
      const fall = dot(normal, towards);
      const distance = -(dot(normal, from) + planes[3 * faceCount + f]) / fall;
      if (distance > 0 && distance < reach && isThrough(model, f, from, towards)) {
        net[faceComponent[f]] += Math.sign(fall);
      }
    },
  );
  return net;
}

/**
 * Open the components that the near plane cuts if they hold the lamp or are wound inward: behind
 * a wall cut away the eye's winding number is not that of what is seen.
 * @param {Model} model
 * @param {Uint8Array} components
 * @param {Uint8Array} shells
 * @param {Sight} sight
 * @param {number[]} light
 * @param {Uint8Array} opened
 */
function openCut(model, components, shells, sight, light, opened) {
  const { faces, places, faceCount, faceComponent, isInward } = model;
  const least = dot(sight.forward, sight.eye) + sight.cameraNear;
  const source = /** @type {Vec3} */ (light.slice(0, 3));
  const around = light[3] ? countThrough(model, shells, source, SKY, Infinity) : null;
  for (let f = 0; f < faceCount; f++) {
    const k = faceComponent[f];
    if (!components[k] || opened[k] || !(isInward[k] || (around && around[k]))) continue;
    for (let corner = 0; corner < 3; corner++) {
      const at = 3 * faces[3 * f + corner];
      if (dot(sight.forward, places.subarray(at, at + 3)) < least) opened[k] = 1;
    }
  }
}
