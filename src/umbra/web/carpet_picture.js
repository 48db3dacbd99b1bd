// The picture of a carpet: days to the right, hours upward, with their axes.

import { AWAY, NIGHT, SUN } from "./carpet.js";
import { DAYS, ROWS } from "./year_suns.js";

const MONTHS = [..."JFMAMJJASOND"];
const LEFT = 22,
  FOOT = 16,
  TOP = 6,
  RIGHT = 6; // margins [CSS pixels]
const FIXED = new Map([[SUN, "#ffdb6b"], [AWAY, "#c9cad3"], [NIGHT, "#f0f0f3"]]);
/** Of objects without a colour of their own. */
export const OTHERS = "#8a8d9c";

/**
 * The colour of a value.
 * @param {number} value @param {Map<number, string>} colors of objects
 */
export const findColor = (value, colors) => FIXED.get(value) ?? colors.get(value) ?? OTHERS;

/** @param {string} color @returns {[number, number, number]} */
const read = (color) =>
  /** @type {[number, number, number]} */ (
    [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16))
  );

/**
 * The place of a carpet in its picture [CSS pixels].
 * @param {number} wide @param {number} high of the picture
 */
export const findFrame = (wide, high) => ({
  left: LEFT, top: TOP, wide: wide - LEFT - RIGHT, high: high - TOP - FOOT,
});

/**
 * Draw a carpet.
 * @param {CanvasRenderingContext2D} pen a unit is a CSS pixel
 * @param {import('./carpet.js').Carpet} carpet
 * @param {Map<number, string>} colors of objects
 * @param {{day: number, minutes: number}} now marked
 * @param {number} wide @param {number} high
 * @param {string} ink of axes
 */
export const drawCarpet = (pen, carpet, colors, now, wide, high, ink) => {
  const { columns, year } = carpet.suns,
    frame = findFrame(wide, high);
  const image = new ImageData(columns, ROWS),
    inks = new Map();
  for (let column = 0; column < columns; column++) {
    for (let row = 0; row < ROWS; row++) {
      const at = 4 * ((ROWS - 1 - row) * columns + column);
      const value = carpet.at(column, row);
      let rgb = inks.get(value);
      if (!rgb) inks.set(value, (rgb = read(findColor(value, colors))));
      image.data.set([...rgb, 255], at);
    }
  }
  const sheet = document.createElement("canvas");
  [sheet.width, sheet.height] = [columns, ROWS];
  sheet.getContext("2d")?.putImageData(image, 0, 0);
  pen.clearRect(0, 0, wide, high);
  pen.imageSmoothingEnabled = false;
  pen.drawImage(sheet, frame.left, frame.top, frame.wide, frame.high);
  pen.fillStyle = pen.strokeStyle = ink;
  pen.font = "10px system-ui, sans-serif";
  pen.textBaseline = "middle";
  pen.textAlign = "right";
  pen.lineWidth = 1;
  for (let hour = 0; hour <= 24; hour += 3) {
    const y = frame.top + frame.high * (1 - hour / 24);
    if (hour % 6 === 0) pen.fillText(String(hour), frame.left - 5, y);
    pen.fillRect(frame.left - 3, Math.round(y) - 0.5, 3, 1);
    pen.globalAlpha = 0.25;
    pen.fillRect(frame.left, Math.round(y) - 0.5, frame.wide, 0.5);
    pen.globalAlpha = 1;
  }
  pen.textAlign = "center";
  const days = columns * DAYS;
  MONTHS.forEach((name, month) => {
    const [from, to] = [month, month + 1].map(
      (month) => (Date.UTC(year, month, 1) - Date.UTC(year, 0, 1)) / 86400000,
    );
    const x = frame.left + (frame.wide * from) / days;
    pen.fillText(name, x + (frame.wide * (to - from)) / days / 2, high - FOOT / 2);
    pen.fillRect(Math.round(x) - 0.5, frame.top + frame.high, 1, 4);
  });
  const x = frame.left + (frame.wide * (now.day + 0.5)) / days,
    y = frame.top + frame.high * (1 - now.minutes / 1440);
  pen.globalAlpha = 0.7;
  pen.fillRect(x - 0.5, frame.top, 1, frame.high);
  pen.globalAlpha = 1;
  pen.beginPath();
  pen.arc(x, y, 4, 0, 7);
  pen.fillStyle = "#ffffff";
  pen.fill();
  pen.strokeStyle = "#1c1c22";
  pen.lineWidth = 1.5;
  pen.stroke();
};
