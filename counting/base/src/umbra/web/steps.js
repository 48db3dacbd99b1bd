// The steps of a day at whose middle the sun is up before no land: what hours of sun are counted by, as a study's are.

import { findInstant } from "./clock.js";
import { findSun } from "./sun.js";

/**
 * @typedef {object} Step
 * @property {number} instant its middle [ms since 1970]
 * @property {Vec3} direction toward the sun
 */

/** The length of a step [min]. */
export const STEP = 15;

/**
 * Find the steps of a date, from midnight to midnight by the local clock.
 * @param {import('./sun.js').Site} site
 * @param {string} date
 * @returns {Step[]}
 */
export const findSteps = (site, date) => {
  const begin = findInstant(site.zone, date, 0),
    end = findInstant(site.zone, date, 1440),
    half = STEP * 30000;
  const steps = [];
  for (let instant = begin + half; instant < end; instant += 2 * half) {
    const { altitude, direction, isBehind } = findSun(site, instant);
    if (altitude > 0 && !isBehind) steps.push({ instant, direction });
  }
  return steps;
};

/**
 * The numbers of the steps whose middles lie in an interval.
 * @param {Step[]} steps
 * @param {number} from @param {number} to [ms since 1970]
 */
export const findWithin = (steps, from, to) =>
  steps.flatMap(({ instant }, k) => (instant >= from && instant < to ? [k] : []));

/**
 * Some of a list, evenly spread.
 * @param {number[]} list @param {number} count
 */
export const spread = (list, count) =>
  Array.from({ length: Math.min(count, list.length) }, (_, k) =>
    list[Math.floor(((k + 0.5) * list.length) / Math.min(count, list.length))],
  );
