// The light of a day as colours along its track: night, twilight, day.

import { readClock } from "./clock.js";

/** Colours by the sun's altitude [degrees], between which they blend. */
const LIGHT = /** @type {[number, Vec3][]} */ ([
  [-12, [44, 52, 84]],
  [-6, [74, 84, 128]],
  [-0.8, [214, 140, 90]],
  [4, [244, 190, 90]],
  [20, [250, 222, 150]],
]);

/**
 * The colour of a day's light.
 * @param {number} altitude of the sun [degrees]
 */
export const findLight = (altitude) => {
  const above = LIGHT.findIndex(([from]) => altitude < from);
  if (above === 0) return LIGHT[0][1];
  if (above < 0) return LIGHT[LIGHT.length - 1][1];
  const [[low, dark], [high, light]] = [LIGHT[above - 1], LIGHT[above]],
    share = (altitude - low) / (high - low);
  return /** @type {Vec3} */ (dark.map((v, k) => Math.round(v + (light[k] - v) * share)));
};

/**
 * A day's light from midnight to midnight, as a gradient of CSS.
 * @param {Day} day
 * @param {string} zone
 */
export const makeGradient = (day, zone) => {
  const span = (day.end - day.begin) / (day.path.length - 1);
  const stops = day.path.map(({ altitude }, k) => {
    const isLast = k === day.path.length - 1;
    const minutes = isLast ? 1440 : readClock(zone, day.begin + k * span).minutes;
    return `rgb(${findLight(altitude)}) ${((100 * minutes) / 1440).toFixed(2)}%`;
  });
  return `linear-gradient(to right, ${stops.join(", ")})`;
};
