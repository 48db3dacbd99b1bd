// The upper sky around a place: which object is nearest in each direction of half a cube.
//
// Triangles are drawn here, in float64, on a cube's upper face and the upper halves of its sides,
// so that great circles are straight lines. The middle of each texel is judged.

/**
 * @typedef {object} SkyCube
 * @property {number} size texels along a cube's edge
 * @property {Int32Array} hit of each texel the number of its nearest object and 1; 0: free. The
 *   upper face (size, size), then the sides (size / 2, size) toward +y, +x, -y and -x; rows go up
 *
 * @typedef {object} SkySums
 * @property {number} viewFactor share of the plane's view that is free sky
 * @property {number} component light of the CIE overcast sky, of that on an open level plane [%]
 * @property {[number, number][]} blockedBy objects with the share of the plane's open sky
 *   component that each takes, largest first
 */

const EDGE_ON = 1e-9; // from a face's plane: it is seen from its edge [m]
// Of each face of the cube the axes of its columns, rows and depth, and their signs.
const AXES = [
  [0, 1, 2, 1, 1, 1],
  [0, 2, 1, 1, 1, 1],
  [1, 2, 0, -1, 1, 1],
  [0, 2, 1, -1, 1, -1],
  [1, 2, 0, 1, 1, -1],
];

/**
 * Find the nearest object in each direction above the horizon.
 * @param {Model} model
 * @param {ArrayLike<number>} eye
 * @param {ArrayLike<number>} objectOf the object of each part
 * @param {Mask} cast which parts obstruct; null: all
 * @param {number} size texels along a cube's edge, even
 * @param {Float64Array} [around] triangles from the eye, nine coordinates each [m]
 * @param {number} [object] that they are
 * @returns {SkyCube}
 */
export const lookAround = (model, eye, objectOf, cast, size, around, object = 0) => {
  const { faces, facePart, faceStarts, places, shells, shellCount } = model;
  const hit = new Int32Array(3 * size * size),
    nearness = new Float32Array(3 * size * size);
  const [x, y, z] = [eye[0], eye[1], eye[2]];
  for (let shell = 0; shell < shellCount; shell++) {
    if (shells[6 * shell + 5] <= z) continue;
    for (let f = faceStarts[shell]; f < faceStarts[shell + 1]; f++) {
      if (cast && !cast[facePart[f]]) continue;
      for (let k = 0; k < 3; k++) {
        const at = 3 * faces[3 * f + k];
        corners[3 * k] = places[at] - x;
        corners[3 * k + 1] = places[at + 1] - y;
        corners[3 * k + 2] = places[at + 2] - z;
      }
      if (corners[2] <= 0 && corners[5] <= 0 && corners[8] <= 0) continue;
      drawFace(objectOf[facePart[f]] + 1, size, hit, nearness);
    }
  }
  for (let at = 0; around && at < around.length; at += 9) {
    corners.set(around.subarray(at, at + 9));
    drawFace(object + 1, size, hit, nearness);
  }
  return { size, hit };
};

// What the loops below work on: they allocate nothing.
const corners = new Float64Array(9), // of a triangle, from the eye
  normal = new Float64Array(3),
  plane = new Float64Array(3), // nearness (1 over the depth) of a texel (u, v, 1)
  polygon = new Float64Array(3 * 8), // across, up, deep
  clipped = new Float64Array(3 * 8);
let lefts = new Float64Array(0),
  rights = new Float64Array(0);

/**
 * Draw the triangle `corners` on the faces of the cube that it may lie on.
 * @param {number} value
 * @param {number} size
 * @param {Int32Array} hit
 * @param {Float32Array} nearness
 */
const drawFace = (value, size, hit, nearness) => {
  for (let k = 0; k < 3; k++) {
    const i = (k + 1) % 3,
      j = (k + 2) % 3;
    normal[k] =
      (corners[3 + i] - corners[i]) * (corners[6 + j] - corners[j]) -
      (corners[3 + j] - corners[j]) * (corners[6 + i] - corners[i]);
  }
  const reach = normal[0] * corners[0] + normal[1] * corners[1] + normal[2] * corners[2];
  const length = Math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2);
  if (!(Math.abs(reach) > EDGE_ON * length)) return;
  for (let side = 0; side < 5; side++) {
    const axes = AXES[side],
      u = axes[0],
      v = axes[1],
      w = axes[2];
    let outside = 15,
      any = 0;
    for (let k = 0; k < 9; k += 3) {
      const across = axes[3] * corners[k + u],
        up = axes[4] * corners[k + v],
        deep = axes[5] * corners[k + w];
      let out = (across > deep ? 1 : 0) | (-across > deep ? 2 : 0) | (up > deep ? 4 : 0);
      if (side ? up < 0 : -up > deep) out |= 8;
      outside &= out;
      any |= out;
      polygon[k] = across;
      polygon[k + 1] = up;
      polygon[k + 2] = deep;
    }
    if (outside) continue;
    const count = any ? clip(any, side > 0) : 3;
    if (count < 3) continue;
    plane[0] = (axes[3] * normal[u]) / reach;
    plane[1] = (axes[4] * normal[v]) / reach;
    plane[2] = (axes[5] * normal[w]) / reach;
    fillPolygon(count, side, value, size, hit, nearness);
  }
};

/**
 * How far a corner of `polygon` lies within one of the planes that bound a face of the cube.
 * @param {number} bound @param {number} at of the corner @param {boolean} isSide
 */
const findInside = (bound, at, isSide) => {
  if (bound === 3) return isSide ? polygon[at + 1] : polygon[at + 2] + polygon[at + 1];
  if (bound === 2) return polygon[at + 2] - polygon[at + 1];
  return polygon[at + 2] + (bound ? polygon[at] : -polygon[at]);
};

/**
 * Cut `polygon` to what one face of the cube shows; return its corners' number.
 * @param {number} bounds which of the four planes, as bits
 * @param {boolean} isSide whether the lowest is the horizon
 */
const clip = (bounds, isSide) => {
  let count = 3;
  for (let bound = 0; bound < 4 && count > 2; bound++) {
    if (!(bounds & (1 << bound))) continue;
    let length = 0;
    for (let k = 0; k < count; k++) {
      const from = 3 * k,
        to = 3 * ((k + 1) % count),
        here = findInside(bound, from, isSide),
        there = findInside(bound, to, isSide);
      if (here >= 0) {
        for (let axis = 0; axis < 3; axis++) clipped[length + axis] = polygon[from + axis];
        length += 3;
      }
      if (here >= 0 === there >= 0) continue;
      const share = here / (here - there);
      for (let axis = 0; axis < 3; axis++) {
        clipped[length + axis] = polygon[from + axis] + share * (polygon[to + axis] - polygon[from + axis]);
      }
      length += 3;
    }
    for (let k = 0; k < length; k++) polygon[k] = clipped[k];
    count = length / 3;
  }
  return count;
};

/**
 * Fill the texels whose middles lie in `polygon`, where it is the nearest so far.
 * @param {number} count corners
 * @param {number} side
 * @param {number} value
 * @param {number} size
 * @param {Int32Array} hit
 * @param {Float32Array} nearness
 */
const fillPolygon = (count, side, value, size, hit, nearness) => {
  if (lefts.length < size) {
    lefts = new Float64Array(size);
    rights = new Float64Array(size);
  }
  const half = size / 2,
    rows = side ? half : size,
    base = side ? size * size + (side - 1) * size * half : 0;
  let first = rows,
    last = -1;
  for (let k = 0; k < 3 * count; k += 3) {
    const up = polygon[k + 1] / polygon[k + 2],
      y = (side ? up : up + 1) * half;
    polygon[k] = (polygon[k] / polygon[k + 2] + 1) * half;
    polygon[k + 1] = y;
    first = Math.min(first, Math.ceil(y - 0.5));
    last = Math.max(last, Math.ceil(y - 0.5) - 1);
  }
  first = Math.max(0, first);
  last = Math.min(rows - 1, last);
  if (!(first <= last)) return;
  for (let row = first; row <= last; row++) {
    lefts[row] = Infinity;
    rights[row] = -Infinity;
  }
  for (let k = 0; k < count; k++) {
    const next = (k + 1) % count,
      isRising = polygon[3 * k + 1] <= polygon[3 * next + 1],
      low = 3 * (isRising ? k : next),
      high = 3 * (isRising ? next : k);
    const x = polygon[low],
      y = polygon[low + 1];
    const slope = (polygon[high] - x) / (polygon[high + 1] - y),
      end = Math.min(last, Math.ceil(polygon[high + 1] - 0.5) - 1);
    for (let row = Math.max(first, Math.ceil(y - 0.5)); row <= end; row++) {
      const at = x + (row + 0.5 - y) * slope;
      if (at < lefts[row]) lefts[row] = at;
      if (at > rights[row]) rights[row] = at;
    }
  }
  for (let row = first; row <= last; row++) {
    const begin = Math.max(0, Math.ceil(lefts[row] - 0.5)),
      end = base + row * size + Math.min(size, Math.ceil(rights[row] - 0.5));
    const up = (row + 0.5) / half - (side ? 0 : 1),
      step = plane[0] / half;
    let near = plane[0] * ((begin + 0.5) / half - 1) + plane[1] * up + plane[2];
    for (let i = base + row * size + begin; i < end; i++) {
      if (near > nearness[i]) {
        nearness[i] = near;
        hit[i] = value;
      }
      near += step;
    }
  }
};

/**
 * The object and 1 in a direction above the horizon; 0: free.
 * @param {SkyCube} cube
 * @param {number} x @param {number} y @param {number} z
 */
export const findHit = ({ size, hit }, x, y, z) => {
  const wide = Math.abs(x),
    deep = Math.abs(y),
    half = size / 2;
  if (z >= wide && z >= deep) {
    const column = Math.min(size - 1, Math.floor((x / z + 1) * half)),
      row = Math.min(size - 1, Math.floor((y / z + 1) * half));
    return hit[row * size + column];
  }
  let side = 0,
    across = 0;
  if (deep >= wide) {
    side = y > 0 ? 0 : 2;
    across = x / y;
  } else {
    side = x > 0 ? 1 : 3;
    across = -y / x;
  }
  const column = Math.min(size - 1, Math.floor((across + 1) * half)),
    row = Math.max(0, Math.floor((z / Math.max(wide, deep)) * half));
  return hit[size * size + (side * half + row) * size + column];
};

/**
 * Sum up what a plane sees of the sky, a weight for each texel.
 * @param {SkyCube} cube
 * @param {ArrayLike<number>} normal of the plane, a unit vector
 * @returns {SkySums}
 */
export const sumSky = ({ size, hit }, normal) => {
  const half = size / 2,
    area = 1 / half ** 2;
  /** @type {Map<number, number>} */
  const taken = new Map();
  let [viewFactor, free, open, i] = [0, 0, 0, 0];
  for (let side = 0; side < 5; side++) {
    const [u, v, w, su, sv, sw] = AXES[side];
    const [nu, nv, nw] = [su * normal[u], sv * normal[v], sw * normal[w]];
    for (let row = 0; row < (side ? half : size); row++) {
      const up = (row + 0.5) / half - (side ? 0 : 1);
      let [last, sum] = [0, 0];
      for (let column = 0; column < size; column++, i++) {
        const across = (column + 0.5) / half - 1;
        const ahead = nu * across + nv * up + nw;
        if (ahead <= 0) continue;
        const square = 1 + across * across + up * up,
          far = Math.sqrt(square);
        const share = (ahead * area) / (square * square);
        const light = share * (1 + (2 * (side ? up : 1)) / far);
        open += light;
        if (hit[i] === 0) {
          viewFactor += share;
          free += light;
          continue;
        }
        if (hit[i] !== last) {
          if (last) taken.set(last, (taken.get(last) ?? 0) + sum);
          [last, sum] = [hit[i], 0];
        }
        sum += light;
      }
      if (last) taken.set(last, (taken.get(last) ?? 0) + sum);
    }
  }
  return {
    viewFactor: viewFactor / Math.PI,
    component: (100 * free) / ((7 * Math.PI) / 3),
    blockedBy: [...taken]
      .map(([value, light]) => /** @type {[number, number]} */ ([value - 1, light / open]))
      .sort((a, b) => b[1] - a[1]),
  };
};
