// A place's day: when the sun reaches it, and which parts stand in between.

import { findSun } from "./sun.js";
import { dot, measure, move } from "./vectors.js";

/** @typedef {import('./types.js').Vec3} Vec3 */
/** @typedef {import('./model.js').Model} Model */
/** @typedef {import('./sun.js').Site} Site */
/** @typedef {import('./daylight.js').Day} Day */

/**
 * @typedef {object} Place
 * @property {Vec3} position local [m]
 * @property {Vec3 | null} normal of its surface, on the side that is seen; null: any sun reaches it
 * @property {number} part -1 on the ground
 *
 * @typedef {object} Sunlight
 * @property {[number, number][]} spells in the sun [ms since 1970]
 * @property {number} hours
 */

const STEP = 60000; // between rays [ms]; shorter spells and gaps can be missed
const CLOSE = 500; // of a spell's ends [ms]
const CLEARANCE = 1e-6; // of a ray's origin above its surface, of the model's size
const GAP = 1e-3; // by which an assumed ground lies below the model, at most, of its size

/**
 * Where rays begin: a hair above the surface, so that they miss it. A ground that was put just
 * below the model has its rays begin at the model's feet, so that no low sun shines under them.
 * @param {Model} model
 * @param {Place} place
 */
const findOrigin = (model, place) => {
  const size = measure(...model.bounds),
    feet = model.bounds[0][2];
  const origin = place.normal
    ? move(place.position, place.normal, size * CLEARANCE + 1e-4)
    : [...place.position];
  if (place.part < 0 && origin[2] < feet && feet - origin[2] < size * GAP) origin[2] = feet + 1e-4;
  return /** @type {Vec3} */ (origin);
};

/**
 * Whether light from a direction reaches a place.
 * @param {Model} model
 * @param {Place} place
 * @param {Vec3} direction toward the light
 * @param {ArrayLike<number | boolean> | null} cast
 */
export const isLit = (model, place, direction, cast) =>
  (!place.normal || dot(place.normal, direction) > 0) &&
  model.trace(findOrigin(model, place), direction, { cast }).length === 0;

/**
 * Find when the sun reaches a place on a day: a ray a minute, then each change to half a second.
 * @param {Model} model
 * @param {Site} site
 * @param {Day} day
 * @param {Place} place
 * @param {ArrayLike<number | boolean> | null} cast
 * @returns {Sunlight}
 */
export const findSunlight = (model, site, day, place, cast) => {
  const isLitAt = (/** @type {number} */ instant) =>
    isLit(model, place, /** @type {Vec3} */ (findSun(site, instant).direction), cast);
  /** @type {[number, number][]} */
  const spells = [];
  for (const [begin, end] of day.up) {
    let was = isLitAt(begin),
      since = begin;
    for (let at = begin; at < end; at += STEP) {
      const next = Math.min(at + STEP, end),
        is = isLitAt(next);
      if (is !== was) {
        let low = at,
          high = next;
        while (high - low > CLOSE) {
          const middle = (low + high) / 2;
          if (isLitAt(middle) === was) low = middle;
          else high = middle;
        }
        const change = (low + high) / 2;
        if (was) spells.push([since, change]);
        since = change;
      }
      was = is;
    }
    if (was) spells.push([since, end]);
  }
  const sum = spells.reduce((total, [from, to]) => total + to - from, 0);
  return { spells, hours: sum / 3600000 };
};

/**
 * Name the objects between a place and a light, nearest first.
 * @param {Model} model
 * @param {Place} place
 * @param {Vec3} direction toward the light
 * @param {ArrayLike<number | boolean> | null} cast
 */
export const findCasters = (model, place, direction, cast) => {
  const met = model.trace(findOrigin(model, place), direction, { cast, every: true });
  return [...new Set(met.map((hit) => model.parts[hit.part].label))];
};
