// Lines and words over the picture: the sun's path with its hours, the compass, places, distances.

import { tellMinutes } from "./clock.js";
import { measure, move } from "./vectors.js";
import { findEye, project } from "./viewpoint.js";

/** @typedef {import('./types.js').Vec3} Vec3 */
/** @typedef {import('./viewpoint.js').Viewpoint} Viewpoint */
/** @typedef {import('./sun.js').Sun} Sun */
/** @typedef {import('./daylight.js').Day} Day */

/**
 * @typedef {object} Signs
 * @property {Viewpoint} viewpoint
 * @property {Vec3} middle of the compass, on the ground
 * @property {number} radius of the compass and the sun's path [m]
 * @property {number} north azimuth of true north in the plan [degrees]
 * @property {Sun} sun
 * @property {Day | null} day whose path is drawn
 * @property {Day[]} others fainter paths: solstices and an equinox
 * @property {boolean} hasPath
 * @property {boolean} hasCompass
 * @property {{position: Vec3, lit: boolean | null} | null} place
 * @property {[Vec3, Vec3][]} distances
 * @property {Vec3 | null} begun first end of a distance
 * @property {boolean} hasCross whether the picture's middle is marked, for choosing by keys
 */

const RADIANS = Math.PI / 180;
const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "DejaVu Sans", sans-serif';
const SUN = "#f2b632", SUN_RIM = "#8a5a00", LINE = "#33457a", HALO = "rgba(255, 255, 255, 0.85)";
const WINDS = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];

/**
 * Show a length with readable digits.
 * @param {number} metres
 */
export const tellLength = (metres) => `${metres.toFixed(metres < 100 ? 2 : 1)} m`;

/** Draws into one part of a canvas; a unit is a CSS pixel. */
export class SignPainter {
  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {Signs} signs
   * @param {number} wide
   * @param {number} high
   */
  constructor(pen, signs, wide, high) {
    this.pen = pen;
    this.signs = signs;
    this.wide = wide;
    this.high = high;
    // From above, the path is a dome about the model; from within, it is the sky itself.
    const { viewpoint, middle, radius } = signs;
    const eye = findEye(viewpoint), t = measure(eye, middle) / radius;
    const inside = Math.max(0, Math.min(1, (1 - t) / 0.4));
    this.centre = move(middle, move(eye, middle, -1), inside * inside * (3 - 2 * inside));
    pen.lineJoin = "round";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
  }

  draw() {
    const { signs } = this;
    if (signs.hasCompass) this.#drawCompass();
    if (signs.hasPath) this.#drawPaths();
    if (signs.place) this.#drawPlace(signs.place.position, signs.place.lit);
    for (const [from, to] of signs.distances) this.#drawDistance(from, to);
    if (signs.begun) this.#drawDot(signs.begun, LINE);
    if (signs.hasCross) this.#drawCross();
  }

  /** @param {Vec3} place */
  #at(place) {
    return project(this.signs.viewpoint, place, this.wide, this.high);
  }

  /**
   * A place on the dome.
   * @param {number} azimuth from true north @param {number} altitude @param {number} times its radius
   */
  #onDome(azimuth, altitude, times = 1) {
    const a = (azimuth + this.signs.north) * RADIANS, h = altitude * RADIANS, r = this.signs.radius * times;
    return move(this.centre, [Math.sin(a) * Math.cos(h), Math.cos(a) * Math.cos(h), Math.sin(h)], r);
  }

  /** @param {Vec3[]} places @param {string} color @param {number} width @param {number[]} dash */
  #rule(places, color, width, dash = []) {
    const { pen } = this;
    pen.strokeStyle = color;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    let isOn = false;
    for (const place of places) {
      const at = this.#at(place);
      if (at && isOn) pen.lineTo(at.x, at.y);
      else if (at) pen.moveTo(at.x, at.y);
      isOn = at !== null;
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  /** @param {string} words @param {number} x @param {number} y @param {string} color @param {number} size @param {string} weight */
  #write(words, x, y, color, size = 12, weight = "500") {
    const { pen } = this;
    pen.font = `${weight} ${size}px ${FONT}`;
    pen.lineWidth = 3;
    pen.strokeStyle = HALO;
    pen.strokeText(words, x, y);
    pen.fillStyle = color;
    pen.fillText(words, x, y);
  }

  #drawCompass() {
    const ring = [], { signs } = this;
    const spot = (/** @type {number} */ azimuth, /** @type {number} */ times) => {
      const a = (azimuth + signs.north) * RADIANS;
      return move(signs.middle, [Math.sin(a), Math.cos(a), 0], signs.radius * times);
    };
    for (let azimuth = 0; azimuth <= 360; azimuth += 4) ring.push(spot(azimuth, 1));
    this.#rule(ring, "rgba(60, 66, 90, 0.55)", 1.25);
    for (let azimuth = 0; azimuth < 360; azimuth += 15) {
      const times = azimuth % 45 ? 1.015 : 1.035;
      this.#rule([spot(azimuth, 1), spot(azimuth, times)], "rgba(60, 66, 90, 0.7)", azimuth ? 1.25 : 2);
    }
    WINDS.forEach((name, k) => {
      const at = this.#at(spot(45 * k, 1.08));
      if (at) this.#write(name, at.x, at.y, k ? "#3c425a" : "#a32020", k % 2 ? 10 : 13, k ? "600" : "700");
    });
  }

  #drawPaths() {
    const { signs, pen } = this, { day, sun } = signs;
    const isUp = (/** @type {Sun} */ one) => one.altitude > -0.3;
    for (const other of signs.others) {
      this.#rule(other.path.filter(isUp).map((one) => this.#onDome(one.azimuth, one.altitude)),
        "rgba(150, 105, 20, 0.4)", 1);
    }
    if (day) {
      const path = day.path.filter(isUp).map((one) => this.#onDome(one.azimuth, one.altitude));
      this.#rule(path, "rgba(255, 255, 255, 0.7)", 4.5);
      this.#rule(path, SUN, 2.5);
      let last = { x: -1e9, y: -1e9 };
      for (const { minutes, sun: at } of day.hours) {
        const spot = at.altitude > 0 ? this.#at(this.#onDome(at.azimuth, at.altitude)) : null;
        const out = spot && this.#at(this.#onDome(at.azimuth, at.altitude, 1.055));
        if (!spot || !out) continue;
        pen.fillStyle = SUN_RIM;
        pen.beginPath();
        pen.arc(spot.x, spot.y, 2.2, 0, 7);
        pen.fill();
        if (Math.hypot(out.x - last.x, out.y - last.y) < 22) continue;
        last = out;
        this.#write(tellMinutes(minutes).slice(0, 2), out.x, out.y, "#6d4700", 11);
      }
    }
    const at = sun.altitude > -0.3 ? this.#at(this.#onDome(sun.azimuth, sun.altitude)) : null;
    if (!at) return;
    this.#rule([this.#onDome(sun.azimuth, sun.altitude), this.centre], "rgba(190, 130, 10, 0.5)", 1, [4, 4]);
    const glow = pen.createRadialGradient(at.x, at.y, 4, at.x, at.y, 20);
    glow.addColorStop(0, "rgba(255, 205, 70, 0.9)");
    glow.addColorStop(1, "rgba(255, 205, 70, 0)");
    pen.fillStyle = glow;
    pen.beginPath();
    pen.arc(at.x, at.y, 20, 0, 7);
    pen.fill();
    this.#disc(at.x, at.y, 8, "#ffd353", SUN_RIM);
  }

  /** @param {number} x @param {number} y @param {number} radius @param {string} fill @param {string} rim */
  #disc(x, y, radius, fill, rim) {
    const { pen } = this;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 7);
    pen.fillStyle = fill;
    pen.fill();
    pen.lineWidth = 1.5;
    pen.strokeStyle = rim;
    pen.stroke();
  }

  /** @param {Vec3} place @param {string} color */
  #drawDot(place, color) {
    const at = this.#at(place);
    if (at) this.#disc(at.x, at.y, 4, color, "#ffffff");
  }

  /** @param {Vec3} place @param {boolean | null} lit null at night */
  #drawPlace(place, lit) {
    const at = this.#at(place), { pen } = this;
    if (!at) return;
    pen.lineWidth = 4;
    pen.strokeStyle = HALO;
    pen.beginPath();
    pen.arc(at.x, at.y, 8, 0, 7);
    pen.stroke();
    pen.lineWidth = 2;
    pen.strokeStyle = "#1c1c22";
    pen.stroke();
    this.#disc(at.x, at.y, 4, lit ? SUN : lit === null ? "#8c8c96" : "#39456b", "#ffffff");
  }

  /** @param {Vec3} from @param {Vec3} to */
  #drawDistance(from, to) {
    this.#rule([from, to], HALO, 4);
    this.#rule([from, to], LINE, 2);
    this.#drawDot(from, LINE);
    this.#drawDot(to, LINE);
    const at = this.#at(move(from, move(to, from, -1), 0.5));
    if (at) this.#write(tellLength(measure(from, to)), at.x, at.y - 12, LINE, 13, "700");
  }

  #drawCross() {
    const { pen } = this, x = this.wide / 2, y = this.high / 2;
    for (const [color, width] of /** @type {[string, number][]} */ ([[HALO, 4], ["#1c1c22", 1.5]])) {
      pen.strokeStyle = color;
      pen.lineWidth = width;
      pen.beginPath();
      for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
        pen.moveTo(x + 4 * dx, y + 4 * dy);
        pen.lineTo(x + 12 * dx, y + 12 * dy);
      }
      pen.stroke();
    }
  }
}
