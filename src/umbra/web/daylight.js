// The sun of one view: by date and clock at a site, or by azimuth and altitude without one.

import { addDays, findInstant } from "./clock.js";
import { RIM, describeSun, findSpells, findSun, makeDirection } from "./sun.js";

/** @typedef {import('./sun.js').Site} Site */
/** @typedef {import('./sun.js').Sun} Sun */

/**
 * @typedef {object} When
 * @property {string} date local, ``YYYY-MM-DD``
 * @property {number} minutes since midnight on the local clock
 * @property {number} [share] of a day, in [0, 1), by which a year that plays is past the date
 * @property {number} azimuth without a site [degrees]
 * @property {number} altitude without a site [degrees]
 *
 * @typedef {object} Day
 * @property {string} date
 * @property {number} begin midnight [ms since 1970]
 * @property {number} end
 * @property {number | null} rise upper limb on a level horizon, as in almanacs
 * @property {number | null} set
 * @property {[number, number][]} up while the sun's centre is above the horizon
 * @property {{minutes: number, sun: Sun}[]} hours the sun at whole hours
 * @property {Sun[]} path every ten minutes
 */

const WINDS = "N NNE NE ENE E ESE SE SSE S SSW SW WSW W WNW NW NNW".split(" ");

/**
 * Say where a sun stands.
 * @param {Sun} sun
 */
export const tellSun = ({ altitude, azimuth, isBehind }) =>
  altitude > 0
    ? `sun ${altitude.toFixed(1)}° high in the ${WINDS[Math.round(azimuth / 22.5) % 16]} ` +
      `(${azimuth.toFixed(1)}°)${isBehind ? ", behind the land" : ""}`
    : `the sun is ${(-altitude).toFixed(1)}° below the horizon`;

const STEP = 600000; // of a path [ms]
const MOST = 40; // days that are kept

export class Daylight {
  /** @param {Site | null} site */
  constructor(site) {
    this.site = site;
    /** @type {Map<string, Day>} */
    this.days = new Map();
  }

  /**
   * The instant of a view [ms since 1970].
   * @param {When} when
   */
  instant(when) {
    return this.site ? findInstant(this.site.zone, when.date, when.minutes) : 0;
  }

  /**
   * @param {When} when
   * @returns {Sun}
   */
  sun(when) {
    if (!this.site) {
      const { altitude, azimuth } = when;
      return { altitude, azimuth, direction: makeDirection(altitude, azimuth), isBehind: false };
    }
    const now = findSun(this.site, this.instant(when));
    if (!when.share) return now;
    // Between two dates at the same clock time the sun glides.
    const next = findSun(this.site, this.instant({ ...when, date: addDays(when.date, 1) })),
      t = when.share;
    const around = ((next.azimuth - now.azimuth + 540) % 360) - 180;
    const altitude = now.altitude + (next.altitude - now.altitude) * t;
    const azimuth = (now.azimuth + around * t + 360) % 360;
    return describeSun(this.site, altitude, azimuth);
  }

  /**
   * The sun's day at the site.
   * @param {string} date
   * @returns {Day | null}
   */
  day(date) {
    const { site } = this;
    if (!site) return null;
    let known = this.days.get(date);
    if (!known) {
      if (this.days.size > MOST) this.days.clear();
      known = findDay(site, date);
      this.days.set(date, known);
    }
    return known;
  }
}

/**
 * @param {Site} site
 * @param {string} date
 * @returns {Day}
 */
const findDay = (site, date) => {
  const begin = findInstant(site.zone, date, 0),
    end = findInstant(site.zone, date, 1440);
  const findAbove = (/** @type {number} */ level) =>
    findSpells((instant) => findSun(site, instant).altitude > level, begin, end, STEP);
  const inSight = findAbove(RIM);
  const hours = [],
    path = [];
  for (let hour = 0; hour < 24; hour++) {
    hours.push({ minutes: hour * 60, sun: findSun(site, findInstant(site.zone, date, hour * 60)) });
  }
  for (let at = begin; at <= end; at += STEP) path.push(findSun(site, at));
  return {
    date,
    begin,
    end,
    hours,
    path,
    up: findAbove(0),
    rise: inSight.find(([from]) => from > begin)?.[0] ?? null,
    set: inSight.reverse().find(([, to]) => to < end)?.[1] ?? null,
  };
};
