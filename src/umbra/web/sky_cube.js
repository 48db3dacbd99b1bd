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
 * @returns {SkyCube}
 */
export const lookAround = (model, eye, objectOf, cast, size) => {
  const { faces, facePart, faceStarts, places, shells, shellCount } = model;
  const hit = new Int32Array(3 * size * size),
    nearness = new Float32Array(3 * size * size);
  const corners = new Float64Array(9);
  for (let shell = 0; shell < shellCount; shell++) {
    if (shells[6 * shell + 5] <= eye[2]) continue;
    for (let f = faceStarts[shell]; f < faceStarts[shell + 1]; f++) {
      if (cast && !cast[facePart[f]]) continue;
      for (let k = 0; k < 9; k++) {
        corners[k] = places[3 * faces[3 * f + Math.floor(k / 3)] + (k % 3)] - eye[k % 3];
      }
      if (corners[2] <= 0 && corners[5] <= 0 && corners[8] <= 0) continue;
      drawFace(corners, objectOf[facePart[f]] + 1, size, hit, nearness);
    }
  }
  return { size, hit };
};

const polygon = new Float64Array(3 * 8),
  clipped = new Float64Array(3 * 8);

/**
 * Draw a triangle on the faces of the cube that it may lie on.
 * @param {Float64Array} corners (3, 3) from the eye
 * @param {number} value
 * @param {number} size
 * @param {Int32Array} hit
 * @param {Float32Array} nearness
 */
const drawFace = (corners, value, size, hit, nearness) => {
  const [ax, ay, az, bx, by, bz, cx, cy, cz] = corners;
  const normal = [
    (by - ay) * (cz - az) - (bz - az) * (cy - ay),
    (bz - az) * (cx - ax) - (bx - ax) * (cz - az),
    (bx - ax) * (cy - ay) - (by - ay) * (cx - ax),
  ];
  const reach = normal[0] * ax + normal[1] * ay + normal[2] * az;
  if (!(Math.abs(reach) > EDGE_ON * Math.hypot(normal[0], normal[1], normal[2]))) return;
  for (let side = 0; side < 5; side++) {
    const [u, v, w, su, sv, sw] = AXES[side];
    let [all, any] = [15, 0];
    for (let k = 0; k < 3; k++) {
      const across = su * corners[3 * k + u],
        up = sv * corners[3 * k + v],
        deep = sw * corners[3 * k + w];
      const out =
        (across > deep ? 1 : 0) |
        (-across > deep ? 2 : 0) |
        (up > deep ? 4 : 0) |
        ((side ? up < 0 : -up > deep) ? 8 : 0);
      all &= out;
      any |= out;
      polygon[3 * k] = across;
      polygon[3 * k + 1] = up;
      polygon[3 * k + 2] = deep;
    }
    if (all) continue;
    const count = any ? clip(any, side > 0) : 3;
    if (count < 3) continue;
    const plane = [(su * normal[u]) / reach, (sv * normal[v]) / reach, (sw * normal[w]) / reach];
    fillPolygon(count, plane, side, value, size, hit, nearness);
  }
};

/**
 * Cut `polygon` to what one face of the cube shows; return its corners' number.
 * @param {number} planes which of the four, as bits
 * @param {boolean} isSide whether the lowest is the horizon
 */
const clip = (planes, isSide) => {
  let count = 3;
  for (let plane = 0; plane < 4; plane++) {
    if (!(planes & (1 << plane))) continue;
    const inside = (/** @type {number} */ k) => {
      const [across, up, deep] = [polygon[3 * k], polygon[3 * k + 1], polygon[3 * k + 2]];
      if (plane === 3) return isSide ? up : deep + up;
      return plane === 0 ? deep - across : plane === 1 ? deep + across : deep - up;
    };
    let kept = 0;
    for (let k = 0; k < count; k++) {
      const next = (k + 1) % count,
        here = inside(k),
        there = inside(next);
      if (here >= 0) clipped.set(polygon.subarray(3 * k, 3 * k + 3), 3 * kept++);
      if (here >= 0 === there >= 0) continue;
      const share = here / (here - there);
      for (let axis = 0; axis < 3; axis++) {
        const from = polygon[3 * k + axis];
        clipped[3 * kept + axis] = from + share * (polygon[3 * next + axis] - from);
      }
      kept++;
    }
    count = kept;
    polygon.set(clipped.subarray(0, 3 * kept));
    if (count < 3) return 0;
  }
  return count;
};

let lefts = new Float64Array(0),
  rights = new Float64Array(0);

/**
 * Fill the texels whose middles lie in `polygon`, where it is the nearest so far.
 * @param {number} count corners
 * @param {number[]} plane nearness (1 over the depth) of a texel (u, v, 1)
 * @param {number} side
 * @param {number} value
 * @param {number} size
 * @param {Int32Array} hit
 * @param {Float32Array} nearness
 */
const fillPolygon = (count, plane, side, value, size, hit, nearness) => {
  if (lefts.length < size) [lefts, rights] = [new Float64Array(size), new Float64Array(size)];
  const half = size / 2,
    rows = side ? half : size,
    base = side ? size * size + (side - 1) * size * half : 0;
  let [first, last] = [rows, -1];
  for (let k = 0; k < count; k++) {
    const row = polygon[3 * k + 1] / polygon[3 * k + 2];
    const y = (side ? row : row + 1) * half;
    polygon[3 * k] = (polygon[3 * k] / polygon[3 * k + 2] + 1) * half;
    polygon[3 * k + 1] = y;
    first = Math.min(first, Math.ceil(y - 0.5));
    last = Math.max(last, Math.ceil(y - 0.5) - 1);
  }
  first = Math.max(0, first);
  last = Math.min(rows - 1, last);
  if (!(first <= last)) return;
  lefts.fill(Infinity, first, last + 1);
  rights.fill(-Infinity, first, last + 1);
  for (let k = 0; k < count; k++) {
    const next = (k + 1) % count;
    let [x, y, endX, endY] = [
      polygon[3 * k],
      polygon[3 * k + 1],
      polygon[3 * next],
      polygon[3 * next + 1],
    ];
    if (y > endY) [x, y, endX, endY] = [endX, endY, x, y];
    const slope = (endX - x) / (endY - y);
    const end = Math.min(last, Math.ceil(endY - 0.5) - 1);
    for (let row = Math.max(first, Math.ceil(y - 0.5)); row <= end; row++) {
      const at = x + (row + 0.5 - y) * slope;
      if (at < lefts[row]) lefts[row] = at;
      if (at > rights[row]) rights[row] = at;
    }
  }
  for (let row = first; row <= last; row++) {
    const begin = Math.max(0, Math.ceil(lefts[row] - 0.5)),
      end = Math.min(size, Math.ceil(rights[row] - 0.5));
    const up = (row + 0.5) / half - (side ? 0 : 1);
    const step = plane[0] / half;
    let near = plane[0] * ((begin + 0.5) / half - 1) + plane[1] * up + plane[2];
    for (let i = base + row * size + begin; i < base + row * size + end; i++) {
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
  const [wide, deep] = [Math.abs(x), Math.abs(y)];
  let [side, across, up] = [0, x / z, y / z + 1];
  if (z < wide || z < deep) {
    if (deep >= wide) [side, across] = y > 0 ? [1, x / deep] : [3, -x / deep];
    else [side, across] = x > 0 ? [2, -y / wide] : [4, y / wide];
    up = z / Math.max(wide, deep);
  }
  const half = size / 2,
    rows = side ? half : size;
  const column = Math.min(size - 1, Math.max(0, Math.floor((across + 1) * half))),
    row = Math.min(rows - 1, Math.max(0, Math.floor(up * half)));
  return hit[(side ? size * size + (side - 1) * size * half : 0) + row * size + column];
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
        const seen = (ahead * area) / (square * square);
        const light = seen * (1 + (2 * (side ? up : 1)) / far);
        open += light;
        if (hit[i] === 0) {
          viewFactor += seen;
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
