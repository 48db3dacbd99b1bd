// The suns of a year on a grid of days and times by the local clock; the same for every place.

import { addDays, findDayOfYear, findInstant } from "./clock.js";
import { findSun } from "./sun.js";

/** Days and minutes from one cell of the grid to the next. */
export const DAYS = 2;
export const MINUTES = 15;
/** Cells of a day. */
export const ROWS = 1440 / MINUTES;

/**
 * @typedef {object} YearSuns
 * @property {number} year
 * @property {number} columns
 * @property {string[]} dates of the columns
 * @property {Float32Array} directions toward the sun, (columns, rows, 3); z is 0 or less at night
 */

/** @type {Map<string, YearSuns>} */
const cache = new Map();

/**
 * Find the suns of a year, in the middle of each cell.
 * @param {import('./sun.js').Site} site
 * @param {number} year
 * @returns {YearSuns}
 */
export const findYearSuns = (site, year) => {
  const key = JSON.stringify([site, year]),
    known = cache.get(key);
  if (known) return known;
  const first = `${String(year).padStart(4, "0")}-01-01`,
    columns = Math.ceil((findDayOfYear(`${first.slice(0, 4)}-12-31`) + 1) / DAYS);
  const dates = Array.from({ length: columns }, (_, k) => addDays(first, DAYS * k));
  const directions = new Float32Array(3 * columns * ROWS);
  dates.forEach((date, column) => {
    // One offset a day, that of noon: clocks change at night.
    const midnight = findInstant(site.zone, date, 720) - 720 * 60000;
    for (let row = 0; row < ROWS; row++) {
      const { altitude, direction } = findSun(site, midnight + (row + 0.5) * MINUTES * 60000);
      if (altitude > 0) directions.set(direction, 3 * (column * ROWS + row));
    }
  });
  if (cache.size > 3) cache.clear();
  const suns = { year, columns, dates, directions };
  cache.set(key, suns);
  return suns;
};
