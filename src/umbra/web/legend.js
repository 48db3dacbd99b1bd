// The key of hours of sun, over the picture and in what is saved of it.

import { nameZone, tellDate, tellMinutes } from "./clock.js";
import { STEP } from "./steps.js";

/**
 * @typedef {object} Legend
 * @property {string} title
 * @property {string} when
 * @property {string} note
 * @property {number[][]} colors of no sun, then from the least to the most hours
 * @property {number} most [h]
 */

const WIDE = 236, // [CSS pixels]
  HIGH = 96,
  PAD = 12;
const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "DejaVu Sans", sans-serif';
const WHOLE = [1, 2, 3, 4, 6]; // hours between figures

/**
 * Describe the hours that an app shows.
 * @param {App} app
 * @returns {Legend | null}
 */
export const describeHours = ({ state, sunHours, daylight }) => {
  const { site } = daylight;
  if (!state.hasSunHours || !site || !sunHours.layer) return null;
  const [from, to] = state.interval.map(tellMinutes);
  const clock = nameZone(site.zone, daylight.instant({ ...state, minutes: state.interval[0] }));
  return {
    title: `Hours of sun, ${tellDate(state.date)}`,
    when: `${from}–${to} ${clock}`,
    note: sunHours.isWhole ? `steps of ${STEP} min` : "coarse, being counted",
    colors: sunHours.colors,
    most: sunHours.most,
  };
};

/**
 * Draw the key in a corner.
 * @param {CanvasRenderingContext2D} pen a unit is a CSS pixel
 * @param {Legend} legend
 * @param {number} left @param {number} foot
 */
export const drawLegend = (pen, { title, when, note, colors, most }, left, foot) => {
  const top = foot - HIGH,
    bar = WIDE - 2 * PAD,
    swatch = 18,
    ramp = bar - swatch - 34;
  pen.save();
  pen.fillStyle = "rgba(255, 255, 255, 0.92)";
  pen.beginPath();
  pen.rect(left, top, WIDE, HIGH);
  pen.fill();
  pen.translate(left + PAD, top);
  pen.textBaseline = "middle";
  pen.textAlign = "left";
  pen.fillStyle = "#1c1c22";
  pen.font = `650 13px ${FONT}`;
  pen.fillText(title, 0, 17, bar);
  pen.font = `400 12px ${FONT}`;
  pen.fillStyle = "#44444c";
  pen.fillText(`${when} · ${note}`, 0, 36, bar);
  const x = swatch + 34;
  const paint = (/** @type {number[]} */ rgb) => `rgb(${rgb.join(",")})`;
  const gradient = pen.createLinearGradient(x, 0, x + ramp, 0);
  const shown = colors.slice(1);
  shown.forEach((rgb, k) => gradient.addColorStop(k / (shown.length - 1), paint(rgb)));
  pen.fillStyle = gradient;
  pen.fillRect(x, 52, ramp, 14);
  pen.fillStyle = paint(colors[0]);
  pen.fillRect(0, 52, swatch, 14);
  pen.strokeStyle = "#8c8c96";
  pen.lineWidth = 1;
  pen.strokeRect(x - 0.5, 51.5, ramp + 1, 15);
  pen.strokeRect(-0.5, 51.5, swatch + 1, 15);
  pen.fillStyle = "#1c1c22";
  pen.font = `400 11px ${FONT}`;
  pen.fillText("no sun", 0, 80);
  const step = WHOLE.find((width) => most / width <= 6) ?? 6;
  pen.textAlign = "center";
  for (let hour = 0; hour <= most + 1e-6; hour += step) {
    const at = x + (most ? hour / most : 0) * ramp;
    pen.fillRect(Math.round(at) - 0.5, 66, 1, 4);
    const isLast = hour + step > most + 1e-6;
    pen.fillText(isLast ? `${hour} h` : String(hour), Math.min(at, x + ramp - 6), 80);
  }
  pen.restore();
};

/** Size of the key [CSS pixels]. */
export const LEGEND = { wide: WIDE, high: HIGH };
