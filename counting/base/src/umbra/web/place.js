// A place's day: when the sun reaches it, and which parts stand in between.

import { findSpells, findSun } from "./sun.js";
import { dot, measure, move } from "./vectors.js";

/** @typedef {import('./sun.js').Site} Site */

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

const STEP = 60000; // between rays [ms]
const CLEARANCE = 1e-6; // of a ray's origin above its surface, of the model's size
const GAP = 1e-3; // by which an assumed ground lies below the model, at most, of its size

/**
 * Where rays begin: `CLEARANCE` of the model's size above the surface, so that they miss it. A ground that was put just
 * below the model has its rays begin at the model's feet, so that no low sun shines under them.
 * @param {Model} model
 * @param {Place} place
 */
export const findOrigin = (model, place) => {
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
 * @param {Mask} cast
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
 * @param {Mask} cast
 * @returns {Sunlight}
 */
export const findSunlight = (model, site, day, place, cast) => {
  const isLitAt = (/** @type {number} */ instant) => {
    const { direction, isBehind } = findSun(site, instant);
    return !isBehind && isLit(model, place, direction, cast);
  };
  const spells = day.up.flatMap(([begin, end]) => findSpells(isLitAt, begin, end, STEP));
  const sum = spells.reduce((total, [from, to]) => total + to - from, 0);
  return { spells, hours: sum / 3600000 };
};

/**
 * Name the objects between a place and a light, nearest first.
 * @param {Model} model
 * @param {Place} place
 * @param {Vec3} direction toward the light
 * @param {Mask} cast
 */
export const findCasters = (model, place, direction, cast) => {
  const met = model.trace(findOrigin(model, place), direction, { cast, every: true });
  return [...new Set(met.map((hit) => model.parts[hit.part].label))];
};
