// Words and marks over the picture: hours of the sun's path, winds, the sun, places, distances.

import { tellMinutes } from "./clock.js";
import { drawLegend, LEGEND } from "./legend.js";
import { isUp } from "./paths.js";
import { drawScale } from "./scale_bar.js";
import { measure, move } from "./vectors.js";
import { project } from "./viewpoint.js";

/** @typedef {import('./sun.js').Sun} Sun */

/**
 * @typedef {object} Signs
 * @property {Viewpoint} viewpoint
 * @property {Dome} dome
 * @property {Sun} sun
 * @property {Day | null} day whose hours are written
 * @property {boolean} isNight whether the picture is dark
 * @property {{metres: number, isEverywhere: boolean} | null} scale metres of a pixel, and where
 * @property {boolean} isNarrow whether the view's buttons and the sky of a place are below
 * @property {number | null} divider where before and after meet, which no word may cover [pixels]
 * @property {boolean} hasPath
 * @property {boolean} hasCompass
 * @property {{position: Vec3, lit: boolean | null} | null} place
 * @property {[Vec3, Vec3][]} distances
 * @property {Vec3 | null} begun first end of a distance
 * @property {boolean} hasCross whether the picture's middle is marked, for choosing by keys
 * @property {import('./legend.js').Legend | null} legend of the hours that are shown
 * @property {(place: Vec3) => boolean} isHidden whether the model stands before a place
 */

const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "DejaVu Sans", sans-serif';
const SUN = "#f2b632",
  SUN_RIM = "#8a5a00",
  LINE = "#33457a",
  HALO = "rgba(255, 255, 255, 0.85)";
/** Inks of words, and what they are at night. */
const INKS = /** @type {Record<string, [string, string]>} */ ({
  hour: ["#6d4700", "#ffdc8c"],
  north: ["#a32020", "#ff9d92"],
  wind: ["#3c425a", "#dfe3f2"],
  length: [LINE, "#c4d2ff"],
});
const NIGHT_HALO = "rgba(14, 16, 30, 0.85)";
const WINDS = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];
const HANDLE = 20; // of the line between before and after: its reach [pixels]
const AWAY = 14; // from an hour's dot to its name [pixels]
const RIM = 40; // as far out of the picture a wind's name is drawn at its border [pixels]

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
    /** @type {{x: number, y: number, wide: number, high: number}[]} where words stand already */
    this.taken = [];
    pen.lineJoin = "round";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
  }

  draw() {
    const { signs } = this;
    if (signs.hasCompass) this.#drawCompass();
    if (signs.hasPath) this.#drawPath();
    if (signs.place) this.#drawPlace(signs.place.position, signs.place.lit);
    for (const [from, to] of signs.distances) this.#drawDistance(from, to);
    if (signs.begun) this.#drawDot(signs.begun, LINE);
    if (signs.hasCross) this.#drawCross();
    const { isNarrow } = signs;
    if (signs.scale) {
      const { metres, isEverywhere } = signs.scale;
      const left = isNarrow ? 8 : signs.legend ? LEGEND.wide + 28 : 14,
        above = isNarrow ? (signs.place ? 130 : 60) : 14;
      drawScale(this.pen, metres, isEverywhere, left, this.high - above);
    }
    if (signs.legend) {
      // Beneath the sentence about a place it is low, or it would cover the compass.
      const isLow = isNarrow && Boolean(signs.place),
        top = isNarrow ? (isLow ? 60 : 8) : this.high - 14 - LEGEND.high;
      drawLegend(this.pen, signs.legend, isNarrow ? 8 : 14, top, isLow ? this.wide - 16 : null);
    }
  }

  /** @param {Vec3} point */
  #at(point) {
    return project(this.signs.viewpoint, point, this.wide, this.high);
  }

  /** @param {Vec3[]} places @param {string} color @param {number} width @param {number[]} dash */
  #rule(places, color, width, dash = []) {
    const { pen } = this;
    pen.strokeStyle = color;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    let isOn = false;
    for (const point of places) {
      const at = this.#at(point);
      if (at && isOn) pen.lineTo(at.x, at.y);
      else if (at) pen.moveTo(at.x, at.y);
      isOn = at !== null;
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  /**
   * @param {string} words
   * @param {number} x
   * @param {number} y
   * @param {string} ink of `INKS`
   * @param {number} size
   * @param {string} weight
   */
  #write(words, x, y, ink, size = 12, weight = "500") {
    const { pen } = this,
      { isNight } = this.signs;
    pen.font = `${weight} ${size}px ${FONT}`;
    pen.lineWidth = 3;
    pen.strokeStyle = isNight ? NIGHT_HALO : HALO;
    pen.strokeText(words, x, y);
    pen.fillStyle = INKS[ink][isNight ? 1 : 0];
    pen.fillText(words, x, y);
  }

  /**
   * Write a word where none stands yet; return whether it was written.
   * @param {string} words @param {{x: number, y: number}} at @param {string} ink
   * @param {number} size @param {string} weight
   */
  #label(words, { x, y }, ink, size, weight) {
    const wide = size * 0.62 * words.length + 4,
      high = size + 4,
      { divider } = this.signs;
    if (divider !== null) {
      const gap = wide / 2 + (Math.abs(y - this.high / 2) < HANDLE ? HANDLE : 4);
      if (Math.abs(x - divider) < gap) x = divider + (x < divider - 2 ? -gap : gap);
    }
    if (
      this.taken.some(
        (box) =>
          Math.abs(box.x - x) < (box.wide + wide) / 2 &&
          Math.abs(box.y - y) < (box.high + high) / 2,
      )
    )
      return;
    this.taken.push({ x, y, wide, high });
    this.#write(words, x, y, ink, size, weight);
  }

  #drawCompass() {
    const { dome, isHidden } = this.signs,
      { wide, high } = this;
    // The four winds first: others give way to them.
    for (const k of [0, 2, 4, 6, 1, 3, 5, 7]) {
      const point = dome.onRing(45 * k, 1.08),
        at = this.#at(point),
        size = k % 2 ? 10 : 13;
      if (!at || at.x < -RIM || at.x > wide + RIM || at.y < -RIM || at.y > high + RIM) continue;
      if (isHidden(point)) continue;
      const x = Math.max(size, Math.min(wide - size, at.x)),
        y = Math.max(size, Math.min(high - size, at.y));
      this.#label(WINDS[k], { x, y }, k ? "wind" : "north", size, k % 2 ? "600" : "700");
    }
  }

  #drawPath() {
    const { signs, pen } = this,
      { day, sun, dome, isHidden } = signs,
      sunPoint = dome.at(sun),
      disc = isUp(sun) ? this.#at(sunPoint) : null;
    for (const { minutes, sun: there } of day?.hours ?? []) {
      const point = dome.at(there),
        spot = there.altitude > 0 && !isHidden(point) && this.#at(point);
      const out = spot && this.#at(dome.at(there, 1.055));
      if (!spot || !out) continue;
      pen.fillStyle = SUN_RIM;
      this.#circle(spot, 2.2);
      pen.fill();
      const [x, y] = [out.x - spot.x, out.y - spot.y],
        away = disc && Math.hypot(spot.x - disc.x, spot.y - disc.y) < AWAY ? 1.7 * AWAY : AWAY,
        times = Math.max(1, away / Math.max(Math.hypot(x, y), 1));
      const at = { x: spot.x + x * times, y: spot.y + y * times };
      this.#label(tellMinutes(minutes).slice(0, 2), at, "hour", 11, "500");
    }
    if (!disc) return;
    if (isHidden(sunPoint)) {
      pen.globalAlpha = 0.35; // behind the model: its place can still be seen
      this.#disc(disc, 8, "rgba(255, 211, 83, 0.35)", SUN_RIM);
      pen.globalAlpha = 1;
      return;
    }
    const glow = pen.createRadialGradient(disc.x, disc.y, 4, disc.x, disc.y, 20);
    glow.addColorStop(0, "rgba(255, 205, 70, 0.9)");
    glow.addColorStop(1, "rgba(255, 205, 70, 0)");
    pen.fillStyle = glow;
    this.#circle(disc, 20);
    pen.fill();
    this.#disc(disc, 8, "#ffd353", SUN_RIM);
  }

  /** @param {{x: number, y: number}} middle @param {number} radius */
  #circle({ x, y }, radius) {
    this.pen.beginPath();
    this.pen.arc(x, y, radius, 0, 7);
  }

  /**
   * @param {{x: number, y: number}} middle @param {number} radius
   * @param {string} fill @param {string} rim
   */
  #disc(middle, radius, fill, rim) {
    const { pen } = this;
    this.#circle(middle, radius);
    pen.fillStyle = fill;
    pen.fill();
    pen.lineWidth = 1.5;
    pen.strokeStyle = rim;
    pen.stroke();
  }

  /** @param {Vec3} point @param {string} color */
  #drawDot(point, color) {
    const at = this.#at(point);
    if (at) this.#disc(at, 4, color, "#ffffff");
  }

  /** @param {Vec3} point @param {boolean | null} lit null at night */
  #drawPlace(point, lit) {
    const at = this.#at(point),
      { pen } = this;
    if (!at) return;
    pen.lineWidth = 4;
    pen.strokeStyle = HALO;
    this.#circle(at, 8);
    pen.stroke();
    pen.lineWidth = 2;
    pen.strokeStyle = "#1c1c22";
    pen.stroke();
    this.#disc(at, 4, lit ? SUN : lit === null ? "#8c8c96" : "#39456b", "#ffffff");
  }

  /** @param {Vec3} from @param {Vec3} to */
  #drawDistance(from, to) {
    this.#rule([from, to], HALO, 4);
    this.#rule([from, to], LINE, 2);
    this.#drawDot(from, LINE);
    this.#drawDot(to, LINE);
    const at = this.#at(move(from, move(to, from, -1), 0.5));
    if (at) this.#write(tellLength(measure(from, to)), at.x, at.y - 12, "length", 13, "700");
  }

  #drawCross() {
    const { pen } = this,
      x = this.wide / 2,
      y = this.high / 2;
    for (const [color, width] of /** @type {[string, number][]} */ ([
      [HALO, 4],
      ["#1c1c22", 1.5],
    ])) {
      pen.strokeStyle = color;
      pen.lineWidth = width;
      pen.beginPath();
      for (const way of [4, -4]) {
        pen.moveTo(x + way, y);
        pen.lineTo(x + 3 * way, y);
        pen.moveTo(x, y + way);
        pen.lineTo(x, y + 3 * way);
      }
      pen.stroke();
    }
  }
}
