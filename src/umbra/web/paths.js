// The compass on the ground and the sun's paths over the model, as lines that the renderer draws.

import { makeDirection } from "./sun.js";
import { measure, move } from "./vectors.js";
import { findEye, isPlan } from "./viewpoint.js";

/** @typedef {import('./sun.js').Sun} Sun */

const RING = /** @type {Line['color']} */ ([0.24, 0.26, 0.35, 0.7]);
const NIGHT_RING = /** @type {Line['color']} */ ([0.8, 0.83, 0.95, 0.7]);
const OTHER = /** @type {Line['color']} */ ([0.59, 0.41, 0.08, 0.5]);
const HALO = /** @type {Line['color']} */ ([1, 1, 1, 0.7]);
const SUN = /** @type {Line['color']} */ ([0.95, 0.71, 0.2, 1]);
const RAY = /** @type {Line['color']} */ ([0.75, 0.51, 0.04, 0.6]);
const SEEN = -0.3; // altitude from which a path is drawn [degrees]

/**
 * Whether a sun is drawn.
 * @param {Sun} sun
 */
export const isUp = (sun) => sun.altitude > SEEN;

/** The sky over a model as a dome: from above about the model, from within the sky itself. */
export class Dome {
  /**
   * @param {Viewpoint} viewpoint
   * @param {Vec3} middle of the compass, on the ground
   * @param {number} radius [m]
   * @param {number} north azimuth of true north in the plan [degrees]
   */
  constructor(viewpoint, middle, radius, north) {
    const eye = findEye(viewpoint),
      t = measure(eye, middle) / radius;
    const inside = isPlan(viewpoint) ? 0 : Math.max(0, Math.min(1, (1 - t) / 0.4));
    this.centre = move(middle, move(eye, middle, -1), inside * inside * (3 - 2 * inside));
    /** whether everything of the model is nearer than the dome */
    this.isSky = inside > 0.5;
    this.middle = middle;
    this.radius = radius;
    this.north = north;
  }

  /**
   * A place on the dome.
   * @param {Sun} sun @param {number} times its radius
   */
  at({ azimuth, altitude }, times = 1) {
    return move(this.centre, makeDirection(altitude, azimuth + this.north), this.radius * times);
  }

  /**
   * A place on the compass.
   * @param {number} azimuth from true north @param {number} times its radius
   */
  onRing(azimuth, times = 1) {
    return move(this.middle, makeDirection(0, azimuth + this.north), this.radius * times);
  }

  /**
   * @param {boolean} isNight
   * @returns {Line[]}
   */
  drawCompass(isNight) {
    const color = isNight ? NIGHT_RING : RING;
    const ring = Array.from({ length: 121 }, (_, k) => this.onRing(3 * k));
    const ticks = Array.from({ length: 24 }, (_, k) => {
      const places = [this.onRing(15 * k), this.onRing(15 * k, k % 3 ? 1.015 : 1.035)];
      return { places, color, width: k ? 1.25 : 2 };
    });
    return [{ places: ring, color, width: 1.25 }, ...ticks];
  }

  /**
   * @param {Day | null} day whose path is drawn
   * @param {Day[]} others fainter paths: solstices and an equinox
   * @returns {Line[]}
   */
  drawPaths(day, others) {
    const { isSky } = this,
      line = (/** @type {Day} */ day) => day.path.filter(isUp).map((sun) => this.at(sun));
    const lines = others.map((other) => ({ places: line(other), color: OTHER, width: 1.1, isSky }));
    if (day) {
      const places = line(day);
      lines.push(
        { places, color: HALO, width: 4.5, isSky },
        { places, color: SUN, width: 2.5, isSky },
      );
    }
    return lines.filter(({ places }) => places.length > 1);
  }

  /**
   * The way of light from the sun to the middle.
   * @param {Sun} sun
   * @returns {Line[]}
   */
  drawRay(sun) {
    if (!isUp(sun) || this.isSky) return [];
    return [{ places: [this.at(sun), this.centre], color: RAY, width: 1 }];
  }
}
