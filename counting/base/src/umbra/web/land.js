// The land far away, which hides the sun: the elevation of its upper edge by azimuth.

/**
 * @typedef {object} Land
 * @property {number[]} azimuth clockwise from true north, ascending, in [0, 360) [degrees]
 * @property {number[]} elevation between azimuths it is linear, around the circle [degrees]
 */

const AWAY = 1e7, // of the curtain that stands for the land [m]
  DEEP = 1e5; // below the eye
const STEP = 1; // between its meridians at most [degrees]
const STEEPEST = 89.9;

/**
 * The elevation of the land's edge at an azimuth [degrees].
 * @param {Land} land
 * @param {number} azimuth
 */
const findEdge = ({ azimuth: turns, elevation }, azimuth) => {
  const count = turns.length;
  let low = 0,
    high = count; // the first azimuth beyond
  while (low < high) {
    const middle = (low + high) >> 1;
    if (turns[middle] > azimuth) high = middle;
    else low = middle + 1;
  }
  const from = (low + count - 1) % count,
    to = low % count;
  const step = (turns[to] - turns[from] + 360) % 360 || 360;
  const share = ((azimuth - turns[from] + 360) % 360) / step;
  return elevation[from] + share * (elevation[to] - elevation[from]);
};

/**
 * Whether the land hides a place of the sky.
 * @param {Land | null | undefined} land
 * @param {number} azimuth @param {number} altitude [degrees]
 */
export const hides = (land, azimuth, altitude) =>
  Boolean(land) && altitude > 0 && altitude < findEdge(/** @type {Land} */ (land), azimuth);

/**
 * The land as triangles far around an eye: nine coordinates from the eye each [m].
 * @param {Land} land
 * @param {number} north azimuth of true north in the plan [degrees]
 */
export const hang = (land, north) => {
  const whole = Array.from({ length: 360 / STEP + 1 }, (_, k) => k * STEP);
  const turns = [...new Set([...whole, ...land.azimuth])].sort((a, b) => a - b);
  const ends = turns.map((azimuth) => {
    const angle = ((azimuth + north) * Math.PI) / 180,
      edge = Math.min(findEdge(land, azimuth % 360), STEEPEST);
    const [x, y] = [AWAY * Math.sin(angle), AWAY * Math.cos(angle)];
    return { edge, foot: [x, y, -DEEP], top: [x, y, AWAY * Math.tan((edge * Math.PI) / 180)] };
  });
  const triangles = ends.slice(1).flatMap((to, k) => {
    const from = ends[k];
    if (from.edge <= 0 && to.edge <= 0) return [];
    return [...from.foot, ...to.foot, ...to.top, ...from.foot, ...to.top, ...from.top];
  });
  return Float64Array.from(triangles);
};
