// Bounding boxes in one array (n, 2, 3): lowest and highest corner.

/** Faces in a block, the finest that is culled and placed by its bounds. */
export const BLOCK = 64;

/**
 * Make boxes that hold nothing.
 * @param {number} count
 */
export function makeBoxes(count) {
  const boxes = new Float64Array(6 * count);
  for (let i = 0; i < boxes.length; i++) boxes[i] = i % 6 < 3 ? Infinity : -Infinity;
  return boxes;
}

/**
 * Widen a box to hold a place.
 * @param {Float64Array} boxes
 * @param {number} box
 * @param {Float64Array} places
 * @param {number} vertex
 */
export function widen(boxes, box, places, vertex) {
  for (let axis = 0; axis < 3; axis++) {
    const value = places[3 * vertex + axis];
    if (value < boxes[6 * box + axis]) boxes[6 * box + axis] = value;
    if (value > boxes[6 * box + 3 + axis]) boxes[6 * box + 3 + axis] = value;
  }
}

/**
 * Whether a ray surely misses a box within a distance, in lengths of `towards`.
 * @param {Float64Array} boxes
 * @param {number} box
 * @param {Vec3} from
 * @param {Vec3} towards
 * @param {number} far
 */
export function misses(boxes, box, from, towards, far) {
  let near = 0;
  for (let axis = 0; axis < 3; axis++) {
    const [start, way] = [from[axis], towards[axis]];
    const margin = 1e-9 * (1 + Math.abs(start));
    const low = boxes[6 * box + axis] - margin - start;
    const high = boxes[6 * box + 3 + axis] + margin - start;
    if (way === 0) {
      if (low > 0 || high < 0) return true;
    } else {
      near = Math.max(near, Math.min(low / way, high / way));
      far = Math.min(far, Math.max(low / way, high / way));
    }
  }
  return near > far * (1 + 1e-9);
}

/**
 * The distance from a place to a box; 0 inside.
 * @param {Float64Array} boxes
 * @param {number} box
 * @param {ArrayLike<number>} point
 */
export function findGap(boxes, box, point) {
  let square = 0;
  for (let axis = 0; axis < 3; axis++) {
    const low = boxes[6 * box + axis] - point[axis];
    const away = Math.max(low, point[axis] - boxes[6 * box + 3 + axis], 0);
    square += away * away;
  }
  return Math.sqrt(square);
}
