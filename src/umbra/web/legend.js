// The key of hours of sun, over the picture and in what is saved of it.

import { nameZone, tellDate, tellMinutes } from "./clock.js";
import { STEP } from "./steps.js";

/**
 * @typedef {object} Legend
 * @property {string} title
 * @property {string} when
 * @property {string} note
 * @property {boolean} isWhole whether all is counted
 * @property {number[][]} colors of no sun, then from the least to the most hours
 * @property {number} most [h]
 */

const WIDE = 236, // [CSS pixels]
  HIGH = 96,
  LOW = 58, // with title and interval in one line
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
    isWhole: sunHours.isWhole,
    colors: sunHours.colors,
    most: sunHours.most,
  };
};

/**
 * Draw the key in a corner, or low and across the picture.
 * @param {CanvasRenderingContext2D} pen a unit is a CSS pixel
 * @param {Legend} legend
 * @param {number} left @param {number} top
 * @param {number | null} across its width where it is low
 */
export const drawLegend = (pen, { title, when, note, isWhole, colors, most }, left, top, across) => {
  const isLow = across !== null,
    wide = across ?? WIDE,
    bar = wide - 2 * PAD,
    swatch = 18,
    ramp = bar - swatch - 34,
    row = isLow ? 25 : 52;
  pen.save();
  pen.fillStyle = "rgba(255, 255, 255, 0.92)";
  pen.beginPath();
  pen.rect(left, top, wide, isLow ? LOW : HIGH);
  pen.fill();
  pen.translate(left + PAD, top);
  pen.textBaseline = "middle";
  pen.textAlign = "left";
  pen.fillStyle = "#1c1c22";
  pen.font = `650 13px ${FONT}`;
  const line = isLow ? 14 : 17,
    rest = bar - 10 - Math.min(pen.measureText(title).width, 0.65 * bar);
  pen.fillText(title, 0, line, isLow ? 0.65 * bar : bar);
  pen.font = `400 12px ${FONT}`;
  pen.fillStyle = "#44444c";
  if (isLow) pen.fillText(isWhole ? when : note, bar - rest, line, rest);
  else pen.fillText(`${when} · ${note}`, 0, 36, bar);
  const x = swatch + 34;
  const paint = (/** @type {number[]} */ rgb) => `rgb(${rgb.join(",")})`;
  const gradient = pen.createLinearGradient(x, 0, x + ramp, 0);
  const shown = colors.slice(1);
  shown.forEach((rgb, k) => gradient.addColorStop(k / (shown.length - 1), paint(rgb)));
  pen.fillStyle = gradient;
  pen.fillRect(x, row, ramp, 14);
  pen.fillStyle = paint(colors[0]);
  pen.fillRect(0, row, swatch, 14);
  pen.strokeStyle = "#8c8c96";
  pen.lineWidth = 1;
  pen.strokeRect(x - 0.5, row - 0.5, ramp + 1, 15);
  pen.strokeRect(-0.5, row - 0.5, swatch + 1, 15);
  pen.fillStyle = "#1c1c22";
  pen.font = `400 11px ${FONT}`;
  pen.fillText("no sun", 0, row + 26);
  const step = WHOLE.find((width) => most / width <= 6) ?? 6;
  pen.textAlign = "center";
  for (let hour = 0; hour <= most + 1e-6; hour += step) {
    const at = x + (most ? hour / most : 0) * ramp;
    pen.fillRect(Math.round(at) - 0.5, row + 14, 1, 4);
    const isLast = hour + step > most + 1e-6;
    pen.fillText(isLast ? `${hour} h` : String(hour), Math.min(at, x + ramp - 6), row + 26);
  }
  pen.restore();
};

/** Size of the key [CSS pixels]. */
export const LEGEND = { wide: WIDE, high: HIGH };
