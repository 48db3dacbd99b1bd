// Where one looks from, as umbra's window keeps it: a target and a direction of view.

import { makeBoxes, widen } from "./boxes.js";
import { dot, measure, move } from "./vectors.js";

/**
 * @typedef {object} Viewpoint
 * @property {Vec3} target centre of the orbit, local [m]
 * @property {number} heading direction of view, clockwise from +y [degrees]
 * @property {number} tilt elevation of the direction of view [degrees]
 * @property {number} distance from the eye to the target [m]
 * @property {number} fov vertical field of view [degrees]
 *
 * @typedef {{right: Vec3, up: Vec3, forward: Vec3}} Axes
 */

const RADIANS = Math.PI / 180;
const STEEPEST = 89.9; // [degrees], so that "up" stays defined
const MARGIN = 1.06;

/**
 * Whether one looks straight down: such a view is a plan, in parallel.
 * @param {Viewpoint} view
 */
export const isPlan = (view) => view.tilt <= -STEEPEST + 1e-6;

/** @param {Viewpoint} view @returns {Axes} unit vectors */
export const findAxes = (view) => {
  const turn = view.heading * RADIANS,
    lift = (isPlan(view) ? -90 : view.tilt) * RADIANS;
  const [s, c, h, v] = [Math.sin(turn), Math.cos(turn), Math.cos(lift), Math.sin(lift)];
  return { right: [c, -s, 0], up: [-s * v, -c * v, h], forward: [s * h, c * h, v] };
};

/** @param {Viewpoint} view */
export const findEye = (view) => move(view.target, findAxes(view).forward, -view.distance);

/**
 * How much of the world a picture's height shows at the target's depth [m].
 * @param {Viewpoint} view
 */
export const findHeight = (view) => 2 * view.distance * Math.tan((view.fov * RADIANS) / 2);

/**
 * The ray through a place of the picture, from -1 to 1 to the right and upward.
 * @param {Viewpoint} view @param {number} x @param {number} y @param {number} aspect width / height
 * @returns {{from: Vec3, towards: Vec3}} towards in parts of the target's distance
 */
export const findRay = (view, x, y, aspect) => {
  const { right, up, forward } = findAxes(view),
    half = findHeight(view) / 2,
    eye = findEye(view),
    aside = move(move([0, 0, 0], right, x * half * aspect), up, y * half),
    ahead = move([0, 0, 0], forward, view.distance);
  return isPlan(view)
    ? { from: move(eye, aside, 1), towards: ahead }
    : { from: eye, towards: move(ahead, aside, 1) };
};

/**
 * Where a place falls in a picture of this size, in its pixels, and how deep; null behind the eye.
 * @param {Viewpoint} view @param {Vec3} point @param {number} wide @param {number} high
 */
export const project = (view, point, wide, high) => {
  const { right, up, forward } = findAxes(view);
  const from = move(point, findEye(view), -1),
    depth = dot(from, forward);
  if (depth < 1e-3 * view.distance && !isPlan(view)) return null;
  const scale = (high / findHeight(view)) * (isPlan(view) ? 1 : view.distance / depth);
  return { x: wide / 2 + dot(from, right) * scale, y: high / 2 - dot(from, up) * scale, depth };
};

/**
 * @param {Viewpoint} view
 * @param {number} right
 * @param {number} up [degrees]
 * @returns {Viewpoint}
 */
export const turn = (view, right, up) => ({
  ...view,
  heading: (((view.heading + right) % 360) + 360) % 360,
  tilt: Math.max(-STEEPEST, Math.min(STEEPEST, view.tilt + up)),
});

/**
 * Turn about a place other than the target, which keeps its pixel.
 * @param {Viewpoint} view @param {number} right @param {number} up [degrees] @param {Vec3} about
 */
export const turnAbout = (view, right, up, about) => {
  const was = findAxes(view),
    from = move(view.target, about, -1);
  const turned = turn(view, right, up),
    is = findAxes(turned);
  const target = move(
    move(move(about, is.right, dot(from, was.right)), is.up, dot(from, was.up)),
    is.forward,
    dot(from, was.forward),
  );
  return { ...turned, target };
};

/**
 * Come nearer to a place, which keeps its pixel.
 * @param {Viewpoint} view @param {number} times above 1 to come nearer @param {Vec3} about
 * @returns {Viewpoint}
 */
export const zoom = (view, times, about = view.target) => ({
  ...view,
  target: move(about, move(view.target, about, -1), 1 / times),
  distance: view.distance / times,
});

/**
 * Move in the picture's plane by parts of its height at the target's distance.
 * @param {Viewpoint} view @param {number} right @param {number} up @returns {Viewpoint}
 */
export const pan = (view, right, up) => {
  const axes = findAxes(view),
    size = findHeight(view);
  return { ...view, target: move(move(view.target, axes.right, right * size), axes.up, up * size) };
};

/**
 * Look at a box so that it fills the picture, and further places are in it.
 * @param {Viewpoint} view gives direction and field of view
 * @param {[Vec3, Vec3]} bounds @param {number} aspect width / height
 * @param {Vec3[]} [places] @returns {Viewpoint}
 */
export const frame = (view, bounds, aspect, places = []) => {
  const { right, up, forward } = findAxes(view),
    tan = Math.tan((view.fov * RADIANS) / 2);
  const middle = move(bounds[0], move(bounds[1], bounds[0], -1), 0.5);
  const corners = Array.from(
    { length: 8 },
    (_, k) => /** @type {Vec3} */ ([0, 1, 2].map((axis) => bounds[(k >> axis) & 1][axis])),
  );
  const ways = [...corners, ...places].map((point) => move(point, middle, -1));
  // In the picture's plane a place at x and depth z lies in a picture about a at distance d if
  // |x - a| <= slope (d + z): of all places this leaves the a between two bounds.
  const fit = (/** @type {Vec3} */ axis, /** @type {number} */ slope) => {
    const depths = ways.map((way) => (isPlan(view) ? 0 : slope * dot(way, forward)));
    const least = Math.max(...ways.map((way, k) => dot(way, axis) - depths[k])),
      most = Math.min(...ways.map((way, k) => dot(way, axis) + depths[k]));
    return { aside: (least + most) / 2, away: (least - most) / (2 * slope) };
  };
  const across = fit(right, (tan * aspect) / MARGIN),
    upward = fit(up, tan / MARGIN);
  return {
    ...view,
    target: move(move(middle, right, across.aside), up, upward.aside),
    distance: Math.max(across.away, upward.away, measure(bounds[0], bounds[1]) / 4, 1e-3),
  };
};

/**
 * A view between two, for a glide.
 * @param {Viewpoint} a @param {Viewpoint} b @param {number} t 0 to 1 @returns {Viewpoint}
 */
export const blend = (a, b, t) => {
  const around = ((b.heading - a.heading + 540) % 360) - 180;
  return {
    target: move(a.target, move(b.target, a.target, -1), t),
    heading: (a.heading + around * t + 360) % 360,
    tilt: a.tilt + (b.tilt - a.tilt) * t,
    distance: a.distance * (b.distance / a.distance) ** t,
    fov: a.fov + (b.fov - a.fov) * t,
  };
};

const LAND = /^(AssumedGround|GivenGround)/; // kinds of parts that umbra adds around a model

/**
 * Whether each part is land that was laid around a model; of land alone none is.
 * @param {Model} model
 */
const findLand = ({ parts }) => {
  const isLand = parts.map(({ kind }) => LAND.test(kind));
  return isLand.includes(false) ? isLand : isLand.map(() => false);
};

/**
 * The bounds of a model without the land that was laid around it.
 * @param {Model} model
 * @returns {[Vec3, Vec3]}
 */
export const findBuilt = (model) => {
  const { faces, facePart, places, bounds } = model,
    isLand = findLand(model);
  if (!isLand.includes(true)) return bounds;
  const box = makeBoxes(1);
  for (let f = 0; f < facePart.length; f++)
    if (!isLand[facePart[f]]) for (let k = 0; k < 3; k++) widen(box, 0, places, faces[3 * f + k]);
  const [x, y, z, east, north, top] = box;
  return [[x, y, z], [east, north, top]];
};

/**
 * How high the land that was laid around a model rises under a ring, so that none of it hides the ring.
 * @param {Model} model
 * @param {number[]} centre x and y @param {number} radius [m]
 * @param {number} low without land
 */
export const findRise = (model, [x, y], radius, low) => {
  const isLand = findLand(model),
    top = model.bounds[1][2] + 1;
  if (!isLand.includes(true)) return low;
  const rises = Array.from({ length: 24 }, (_, k) => {
    const turn = (k * Math.PI) / 12;
    const from = /** @type {Vec3} */ ([x + radius * Math.sin(turn), y + radius * Math.cos(turn), top]);
    const [hit] = model.trace(from, [0, 0, -1], { cast: isLand });
    return hit ? top - hit.distance : low;
  });
  return Math.max(...rises) + 0.05;
};

const SPARSE = 80,
  NEIGHBOURHOOD = 12; // sizes of the middling object: of a model, of a view's half

/**
 * Find the box where most objects stand, of a model in which they would be specks; else null.
 * @param {Model} model
 * @param {number[]} owner object of each part
 * @param {[Vec3, Vec3]} built as of `findBuilt`
 * @returns {[Vec3, Vec3] | null}
 */
export const findDense = (model, owner, built) => {
  const { faces, facePart, places } = model,
    isLand = findLand(model),
    bounds = makeBoxes(owner.reduce((most, number, part) => (isLand[part] ? most : Math.max(most, number)), 0) + 1);
  for (let f = 0; f < facePart.length; f++) {
    const part = facePart[f];
    if (!isLand[part]) for (let k = 0; k < 3; k++) widen(bounds, owner[part], places, faces[3 * f + k]);
  }
  const boxes = Array.from({ length: bounds.length / 6 }, (_, k) => bounds.subarray(6 * k, 6 * k + 6));
  const sizes = boxes.map((box) => Math.hypot(box[3] - box[0], box[4] - box[1], box[5] - box[2]));
  const middling = sizes.sort((a, b) => a - b)[boxes.length >> 1];
  if (!(measure(...built) > SPARSE * middling)) return null;
  const reach = NEIGHBOURHOOD * middling;
  // A grid of squares as large as a view's half, each with how much stands in it.
  /** @type {Map<string, number>} */
  const crowd = new Map();
  const squareOf = (/** @type {Float64Array} */ box) =>
    [0, 1].map((k) => Math.floor((box[k] + box[k + 3]) / 2 / reach));
  for (const box of boxes) {
    const [column, row] = squareOf(box);
    for (const [x, y] of [
      [0, 0],
      [-1, 0],
      [0, -1],
      [-1, -1],
    ]) {
      const name = `${column + x},${row + y}`;
      crowd.set(name, (crowd.get(name) ?? 0) + 1);
    }
  }
  const [best] = [...crowd].reduce((a, b) => (b[1] > a[1] ? b : a));
  const [column, row] = best.split(",").map(Number);
  const low = /** @type {Vec3} */ ([Infinity, Infinity, Infinity]);
  const high = /** @type {Vec3} */ ([-Infinity, -Infinity, -Infinity]);
  for (const box of boxes) {
    const [x, y] = squareOf(box);
    if (x < column || x > column + 1 || y < row || y > row + 1) continue;
    for (let k = 0; k < 3; k++) {
      low[k] = Math.min(low[k], box[k]);
      high[k] = Math.max(high[k], box[k + 3]);
    }
  }
  return [low, high];
};
