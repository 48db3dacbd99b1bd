// Projections of the upper sky: round ones, and the Waldram diagram (umbra.sky.projections).

import { makeDirection } from "./sun.js";

export const CHARTS = /** @type {const} */ ([
  ["stereographic", "Stereographic"],
  ["equidistant", "Equidistant"],
  ["orthographic", "Orthographic"],
  ["waldram", "Waldram diagram"],
]);

/** @typedef {typeof CHARTS[number][0]} ChartName */

const STEEP = Math.SQRT1_2; // sine of a tilt from which a Waldram diagram is of a vertical plane
const STEPS = 1024; // of altitudes, between which a Waldram diagram is read
const { PI } = Math;

/** Maps directions to a picture: in the unit circle, or x from -1 to 1 and y from 0 to 1. */
export class Chart {
  /**
   * @param {ChartName} name
   * @param {ArrayLike<number>} normal of the plane; a Waldram diagram lies before it
   * @param {number} north azimuth of true north in the model's plan [degrees]
   */
  constructor(name, normal, north) {
    this.name = name;
    this.isRound = name !== "waldram";
    this.north = (north * PI) / 180;
    this.sine = Math.sin(this.north);
    this.cosine = Math.cos(this.north);
    /** @type {number | null} azimuth of a vertical plane's normal in the plan [radians] */
    this.facing = Math.hypot(normal[0], normal[1]) < STEEP ? null : Math.atan2(normal[0], normal[1]);
    /** of a Waldram diagram the height of each altitude */
    this.rise = Float64Array.from({ length: STEPS + 1 }, (_, k) => this.#lift((k / STEPS) * (PI / 2)));
  }

  /**
   * The height of an altitude in a Waldram diagram, on which equal areas give equal light.
   * @param {number} altitude [radians]
   */
  #lift(altitude) {
    const sine = Math.sin(altitude),
      cosine = Math.cos(altitude);
    if (this.facing === null) return (sine ** 2 / 2 + (2 / 3) * sine ** 3) / (7 / 6);
    const up = altitude / 2 + Math.sin(2 * altitude) / 4 + (2 / 3) * (1 - cosine ** 3);
    return up / (PI / 4 + 2 / 3);
  }

  /**
   * The place of a direction above the horizon; null beside a Waldram diagram.
   * @param {Vec3} direction a unit vector
   * @returns {[number, number] | null}
   */
  place([x, y, z]) {
    const azimuth = Math.atan2(x, y),
      altitude = Math.atan2(z, Math.hypot(x, y));
    if (this.isRound) {
      const apart = PI / 2 - altitude,
        turn = azimuth - this.north;
      const radius =
        this.name === "stereographic"
          ? Math.tan(apart / 2)
          : this.name === "equidistant"
            ? apart / (PI / 2)
            : Math.sin(apart);
      return [radius * Math.sin(turn), radius * Math.cos(turn)];
    }
    const up = this.#lift(Math.max(0, altitude));
    if (this.facing === null) return [(wrap(azimuth - this.north) / PI) - 1, up];
    const turn = wrap(azimuth - this.facing + PI) - PI;
    return Math.abs(turn) <= PI / 2 + 1e-9 ? [Math.sin(turn), up] : null;
  }

  /**
   * The place of an azimuth from true north and an altitude [degrees].
   * @param {number} azimuth @param {number} altitude
   */
  placeAngles(azimuth, altitude) {
    return this.place(makeDirection(altitude, azimuth + (this.north * 180) / PI));
  }

  /**
   * Find the direction at a place; false outside.
   * @param {number} x @param {number} y
   * @param {Float64Array} into (3,)
   */
  look(x, y, into) {
    if (!this.isRound) return this.#lookStraight(x, y, into);
    const square = x * x + y * y;
    if (square >= 1) return false;
    let level = 1,
      up = Math.sqrt(1 - square); // of an orthographic picture
    if (this.name === "stereographic") {
      level = 2 / (1 + square);
      up = (1 - square) / (1 + square);
    } else if (this.name === "equidistant") {
      const radius = Math.sqrt(square) || 1e-12,
        apart = (radius * PI) / 2;
      level = Math.sin(apart) / radius;
      up = Math.cos(apart);
    }
    into[0] = level * (x * this.cosine + y * this.sine);
    into[1] = level * (y * this.cosine - x * this.sine);
    into[2] = up;
    return true;
  }

  /** @param {number} x @param {number} y @param {Float64Array} into */
  #lookStraight(x, y, into) {
    if (!(Math.abs(x) < 1 && y > 0 && y < 1)) return false;
    const { rise } = this;
    let low = 0,
      high = STEPS;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (rise[middle] <= y) low = middle;
      else high = middle;
    }
    const share = (y - rise[low]) / (rise[high] - rise[low]),
      altitude = ((low + share) / STEPS) * (PI / 2);
    const azimuth = this.facing === null ? (x + 1) * PI + this.north : Math.asin(x) + this.facing;
    into[0] = Math.sin(azimuth) * Math.cos(altitude);
    into[1] = Math.cos(azimuth) * Math.cos(altitude);
    into[2] = Math.sin(altitude);
    return true;
  }
}

/**
 * An angle within the turn [radians].
 * @param {number} angle
 */
const wrap = (angle) => ((angle % (2 * PI)) + 2 * PI) % (2 * PI);
