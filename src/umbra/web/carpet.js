// The year of a place as a carpet: for each day and time, in the sun or in the shadow of what.
//
// Rays start at one place, so the cells are filled in passes from coarse to fine, a slice at a time:
// a first look at the year is there at once.

import { findOrigin } from "./place.js";
import { dot } from "./vectors.js";
import { DAYS, MINUTES, ROWS } from "./year_suns.js";

/** What a cell holds besides the number of the object that casts the shadow. */
export const NIGHT = -1;
export const SUN = -2;
export const AWAY = -3; // the surface is turned from the sun
const OPEN = -4; // not looked at yet
const STRIDES = [8, 4, 2, 1]; // cells between looks in each pass
const SLICE = 32; // rays between looks at the clock

export class Carpet {
  /**
   * @param {Model} model
   * @param {Place} place
   * @param {Mask} cast
   * @param {number[]} thingOf object of each part
   * @param {import('./year_suns.js').YearSuns} suns
   */
  constructor(model, place, cast, thingOf, suns) {
    this.model = model;
    this.place = place;
    this.cast = cast;
    this.thingOf = thingOf;
    this.suns = suns;
    this.origin = findOrigin(model, place);
    this.cells = new Int32Array(suns.columns * ROWS).fill(OPEN);
    this.pass = 0;
    this.next = 0;
  }

  /** Whether every cell has been looked at. */
  get isWhole() {
    return this.pass >= STRIDES.length;
  }

  /**
   * Go on for a while; return whether the carpet is whole.
   * @param {number} milliseconds
   */
  fill(milliseconds) {
    const { cells, suns } = this,
      until = performance.now() + milliseconds;
    for (let rays = 1; this.pass < STRIDES.length; this.pass++, this.next = 0) {
      const stride = STRIDES[this.pass],
        high = Math.ceil(ROWS / stride),
        total = high * Math.ceil(suns.columns / stride);
      for (; this.next < total; this.next++) {
        const column = stride * Math.floor(this.next / high),
          row = stride * (this.next % high),
          cell = column * ROWS + row;
        if (cells[cell] !== OPEN) continue;
        cells[cell] = this.#look(cell);
        if (cells[cell] !== NIGHT && rays++ % SLICE === 0 && performance.now() > until) {
          this.next++;
          return false;
        }
      }
    }
    return true;
  }

  /** @param {number} cell */
  #look(cell) {
    const { suns, place, model, thingOf, cast } = this,
      [x, y, z] = suns.directions.subarray(3 * cell, 3 * cell + 3);
    if (!(z > 0)) return NIGHT;
    const direction = /** @type {Vec3} */ ([x, y, z]);
    if (place.normal && dot(place.normal, direction) <= 0) return AWAY;
    const [hit] = model.trace(this.origin, direction, { cast });
    return hit ? thingOf[hit.part] : SUN;
  }

  /**
   * What a cell shows: its own value, or that of the coarser cell that stands in for it.
   * @param {number} column @param {number} row
   */
  at(column, row) {
    for (const stride of [...STRIDES].reverse()) {
      const value = this.cells[(column - (column % stride)) * ROWS + row - (row % stride)];
      if (value !== OPEN) return value;
    }
    return NIGHT;
  }

  /**
   * Hours of the year by what cells hold, the most first; night is left out.
   * @returns {[number, number][]} value and hours
   */
  sum() {
    /** @type {Map<number, number>} */
    const hours = new Map();
    for (let column = 0; column < this.suns.columns; column++) {
      for (let row = 0; row < ROWS; row++) {
        const value = this.at(column, row);
        if (value !== NIGHT) hours.set(value, (hours.get(value) ?? 0) + (DAYS * MINUTES) / 60);
      }
    }
    return [...hours].sort((a, b) => b[1] - a[1]);
  }
}
