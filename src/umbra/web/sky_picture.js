// The picture of a sky: what obstructs it in colours, the grid, the sun's paths and hours.

import { findInstant } from "./clock.js";
import { el } from "./dom.js";
import { findHit } from "./sky_cube.js";
import { findSun } from "./sun.js";
import { dot } from "./vectors.js";

/** @typedef {import('./sky_charts.js').Chart} Chart */
/** @typedef {import('./sky_cube.js').SkyCube} SkyCube */
/** @typedef {import('./sun.js').Site} Site */

/**
 * @typedef {object} Sky the sky above a place
 * @property {SkyCube} cube
 * @property {Vec3} normal of the plane that is judged
 * @property {Map<number, string>} colors of objects; others are grey
 *
 * @typedef {object} SunPaths
 * @property {Site} site
 * @property {Day} day that is shown
 * @property {[number, number][]} spells of sun on it [ms since 1970]
 * @property {Day[]} others of the year: its longest, shortest and even days
 */

/** Colours of those that obstruct most, as in umbra's own pictures of skies. */
export const COLORS = [
  "#5b7a9d", "#c98f4e", "#6f9a6b", "#a56a7a", "#8d7db5", "#b8a24a", "#4f9a98", "#b5715a",
  "#7b8794", "#96a05f",
]; // prettier-ignore
export const OTHER = "#b4b4ba";
const FREE = "#eef4fa",
  BEHIND = "#dcdce0",
  INK = "#1c1c22",
  GRID = "#93a1b1",
  SUN = "#d9480f",
  HIDDEN = "#f0b89c";
const OUTLINE = 0.45; // what stays of a pixel's colour on the border of the free sky
const FINE = 2; // looks in each direction of a pixel
const TICK = 240000; // between places of a path [ms]
const WINDS = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];
const LOWEST = 0.02; // sine of an altitude below which no hour is named
const NEAR = 4; // noon altitudes of paths that are taken as one [degrees]
const MARGIN = { round: 24, left: 30, right: 14, below: 20, above: 6 }; // around a chart [pixels]

/** @param {string} hex */
const parseColor = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

/**
 * Make an element of SVG.
 * @param {string} tag
 * @param {Record<string, string | number>} attributes
 * @param {...(Node | string)} children
 */
const mark = (tag, attributes, ...children) => {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
};

/** A chart on paper of so many pixels. */
class Sheet {
  /** @param {Chart} chart @param {number} wide [CSS pixels] @param {number} [rim] of a round one */
  constructor(chart, wide, rim = MARGIN.round) {
    const { left, right, below, above } = MARGIN;
    this.chart = chart;
    this.wide = wide;
    this.scale = chart.isRound ? wide / 2 - rim : (wide - left - right) / 2;
    /** of the place (0, 0) */
    this.x = chart.isRound ? wide / 2 : left + this.scale;
    this.tall = chart.isRound ? this.scale : 1.14 * this.scale; // of one upward
    this.y = chart.isRound ? wide / 2 : above + this.tall;
    this.high = chart.isRound ? wide : this.y + below;
    /** @type {{x: number, y: number, wide: number, high: number}[]} where words stand */
    this.taken = [];
  }

  /** @param {[number, number]} place */
  spot([x, y]) {
    return [this.x + this.scale * x, this.y - this.tall * y];
  }

  /**
   * The direction under a pixel; null outside.
   * @param {number} x @param {number} y
   */
  findDirection(x, y) {
    const into = new Float64Array(3);
    const isIn = this.chart.look((x - this.x) / this.scale, (this.y - y) / this.tall, into);
    return isIn ? into : null;
  }

  /**
   * A line through places, broken where there is none and where it would cross the chart.
   * @param {([number, number] | null)[]} places
   */
  trace(places) {
    let words = "",
      /** @type {number[] | null} */ last = null;
    for (const place of places) {
      const at = place && this.spot(place);
      if (at) {
        const isOn = last && Math.hypot(at[0] - last[0], at[1] - last[1]) < 0.6 * this.scale;
        words += `${isOn ? "L" : "M"}${at[0].toFixed(1)} ${at[1].toFixed(1)}`;
      }
      last = at;
    }
    return words;
  }

  /**
   * Words at a spot, if none stand there.
   * @param {string} words @param {number} x @param {number} y @param {Record<string, string | number>} more
   */
  label(words, x, y, more = {}) {
    const size = Number(more["font-size"] ?? 10),
      wide = 0.6 * size * words.length + 2;
    const middle = more["text-anchor"] === "middle" ? x : x + wide / 2;
    const isTaken = this.taken.some(
      (box) =>
        Math.abs(box.x - middle) < (box.wide + wide) / 2 && Math.abs(box.y - y) < (box.high + size) / 2,
    );
    if (isTaken || middle - wide / 2 < 0 || middle + wide / 2 > this.wide) return [];
    this.taken.push({ x: middle, y, wide, high: size });
    return [mark("text", { x, y: y + size / 3, "font-size": size, class: "sky-words", ...more }, words)];
  }
}

/**
 * Draw a sky.
 * @param {Sky} sky
 * @param {Chart} chart
 * @param {SunPaths | null} sun
 * @param {number} wide of the picture [CSS pixels]
 * @param {string} words what it shows, for those who do not see it
 */
export const drawSky = (sky, chart, sun, wide, words) => {
  const sheet = new Sheet(chart, wide);
  const canvas = el("canvas", { "aria-hidden": "true" });
  paint(canvas, sky, sheet);
  const svg = mark(
    "svg",
    { viewBox: `0 0 ${wide} ${sheet.high}`, role: "img", "aria-label": words },
    ...drawGrid(sheet),
    ...(sun ? drawSuns(sheet, sky, sun) : []),
  );
  const element = el("div", { class: "sky-chart" }, canvas, svg);
  element.style.width = `${wide}px`;
  element.style.height = `${sheet.high}px`;
  /** @param {Vec3} direction of the sun now */
  const setSun = (direction) => {
    const at = direction[2] > 0 ? chart.place(direction) : null;
    svg.querySelector(".sky-sun")?.remove();
    if (!at) return;
    const [cx, cy] = sheet.spot(at);
    svg.append(mark("circle", { cx, cy, r: 6, fill: "#ffd43b", stroke: INK, class: "sky-sun" }));
  };
  return { element, setSun, findDirection: sheet.findDirection.bind(sheet) };
};

/**
 * Draw a sky small, without lines and words.
 * @param {HTMLCanvasElement} canvas
 * @param {Sky} sky
 * @param {Chart} chart
 * @param {number} wide [CSS pixels]
 */
export const drawSmallSky = (canvas, sky, chart, wide) => paint(canvas, sky, new Sheet(chart, wide, 1));

/**
 * Colour the pixels by what is nearest in their directions.
 * @param {HTMLCanvasElement} canvas
 * @param {Sky} sky
 * @param {Sheet} sheet
 */
const paint = (canvas, { cube, normal, colors }, sheet) => {
  const dots = Math.min(window.devicePixelRatio || 1, 2);
  canvas.width = Math.round(sheet.wide * dots);
  canvas.height = Math.round(sheet.high * dots);
  const pen = canvas.getContext("2d");
  if (!pen) throw new Error("this browser draws no 2D canvas");
  const image = pen.createImageData(canvas.width, canvas.height),
    { data } = image;
  const [free, behind, other] = [FREE, BEHIND, OTHER].map(parseColor);
  const inks = new Map([...colors].map(([object, color]) => [object + 1, parseColor(color)]));
  const { chart, scale, tall } = sheet,
    toward = new Float64Array(3),
    looks = FINE * FINE;
  for (let row = 0, at = 0; row < canvas.height; row++) {
    for (let column = 0; column < canvas.width; column++, at += 4) {
      let red = 0,
        green = 0,
        blue = 0,
        count = 0,
        open = 0;
      for (let k = 0; k < looks; k++) {
        const x = (column + ((k % FINE) + 0.5) / FINE) / dots,
          y = (row + (Math.floor(k / FINE) + 0.5) / FINE) / dots;
        if (!chart.look((x - sheet.x) / scale, (sheet.y - y) / tall, toward)) continue;
        count++;
        const isBehind = dot(normal, toward) <= 0;
        const hit = isBehind ? -1 : findHit(cube, toward[0], toward[1], toward[2]);
        const ink = isBehind ? behind : hit ? (inks.get(hit) ?? other) : free;
        if (hit === 0) open++;
        red += ink[0];
        green += ink[1];
        blue += ink[2];
      }
      if (!count) continue;
      const share = (open && open < count ? OUTLINE : 1) / count;
      data[at] = red * share;
      data[at + 1] = green * share;
      data[at + 2] = blue * share;
      data[at + 3] = (255 * count) / looks;
    }
  }
  pen.putImageData(image, 0, 0);
};

/** @param {string} path @param {string} color @param {number} width @param {string} [dash] */
const rule = (path, color, width, dash) =>
  mark("path", { d: path, stroke: color, "stroke-width": width, fill: "none", ...(dash ? { "stroke-dasharray": dash } : {}) });

/**
 * Altitudes and azimuths, or the droop lines of a Waldram diagram.
 * @param {Sheet} sheet
 */
const drawGrid = (sheet) => {
  const { chart } = sheet,
    size = sheet.wide < 400 ? 9 : 11;
  const drawn = [],
    turn = Array.from({ length: 181 }, (_, k) => 2 * k);
  if (chart.isRound) {
    for (let altitude = 10; altitude < 90; altitude += 10)
      drawn.push(rule(sheet.trace(turn.map((a) => chart.placeAngles(a, altitude))), GRID, 0.5));
    for (let a = 0; a < 360; a += 15)
      drawn.push(rule(sheet.trace([chart.placeAngles(a, 0), chart.placeAngles(a, 80)]), GRID, 0.5));
    const [x, y] = sheet.spot([0, 0]);
    drawn.push(mark("circle", { cx: x, cy: y, r: sheet.scale, fill: "none", stroke: GRID }));
    for (let a = 0; a < 360; a += sheet.wide < 400 ? 45 : 15) {
      const [left, top] = sheet.spot(/** @type {[number, number]} */ (chart.placeAngles(a, 0)));
      const out = 1 + 13 / sheet.scale,
        isWind = a % 45 === 0;
      drawn.push(
        ...sheet.label(isWind ? WINDS[a / 45] : `${a}°`, x + (left - x) * out, y + (top - y) * out, {
          "font-size": isWind ? size + 2 : size - 1, "text-anchor": "middle", class: "sky-rim",
          ...(a % 90 === 0 ? { "font-weight": 700 } : {}),
        }), // prettier-ignore
      );
    }
    for (const altitude of [30, 60]) {
      const at = chart.placeAngles(180, altitude);
      if (at) drawn.push(...sheet.label(`${altitude}°`, sheet.spot(at)[0] + 2, sheet.spot(at)[1] - 6, { "font-size": size - 1 }));
    }
    return drawn;
  }
  const [left, floor] = sheet.spot([-1, 0]);
  const isLevel = chart.facing === null;
  const zero = isLevel ? 0 : ((chart.facing ?? 0) - chart.north) * (180 / Math.PI);
  const angles = Array.from({ length: 91 }, (_, k) => 2 * k - 90);
  if (!isLevel)
    for (let a = 10; a < 90; a += 10)
      drawn.push(rule(sheet.trace(angles.map((across) => chart.placeAngles(across + zero, droop(a, across)))), GRID, 0.6));
  const marks = isLevel ? [0, 45, 90, 135, 180, 225, 270, 315] : [-75, -60, -45, -30, -15, 0, 15, 30, 45, 60, 75];
  for (const a of marks) {
    const x = sheet.spot(/** @type {[number, number]} */ (chart.placeAngles(a + zero, 0)))[0];
    drawn.push(rule(`M${x} ${floor}V${floor - sheet.tall}`, GRID, 0.5));
    const words = isLevel ? WINDS[a / 45] : `${a > 0 ? "+" : ""}${a}°`;
    drawn.push(...sheet.label(words, x, floor + 10, { "font-size": size, "text-anchor": "middle", class: "sky-rim" }));
  }
  for (const altitude of [0, 10, 20, 30, 40, 50, 60, 90]) {
    const at = chart.placeAngles(zero, altitude);
    if (at) drawn.push(...sheet.label(`${altitude}°`, left - 26, sheet.spot(at)[1], { "font-size": size, class: "sky-rim" }));
  }
  drawn.push(mark("rect", { x: left, y: floor - sheet.tall, width: 2 * sheet.scale, height: sheet.tall, fill: "none", stroke: GRID }));
  return drawn;
};

/**
 * The altitude of a level edge parallel to the plane, away from straight ahead [degrees].
 * @param {number} ahead @param {number} across
 */
const droop = (ahead, across) => {
  const radians = Math.PI / 180;
  return Math.atan(Math.tan(ahead * radians) * Math.cos(across * radians)) / radians;
};

/**
 * The sun's paths, the hours of the clock through the year, and the sun now.
 * @param {Sheet} sheet
 * @param {Sky} sky
 * @param {SunPaths} sun
 */
const drawSuns = (sheet, sky, { site, day, spells, others }) => {
  const { chart } = sheet,
    size = sheet.wide < 400 ? 9 : 11;
  const put = (/** @type {Vec3} */ direction) => (direction[2] > 0 ? chart.place(direction) : null);
  const hours = findHourLines(site, day.date.slice(0, 4));
  const drawn = [rule(sheet.trace(hours.map((direction) => direction && put(direction))), SUN, 0.5)];
  const noon = (/** @type {Day} */ curve) => Math.max(...curve.path.map(({ altitude }) => altitude));
  const paths = others.filter((curve) => Math.abs(noon(curve) - noon(day)) > NEAR);
  for (const sunPath of [...paths, day]) {
    const isShown = sunPath === day;
    /** @type {([number, number] | null)[][]} */
    const lines = [[], []];
    const times = [];
    for (let at = sunPath.begin; at < sunPath.end; at += TICK) times.push(at);
    if (isShown) times.push(...spells.flat());
    for (const at of times.sort((a, b) => a - b)) {
      const { direction } = findSun(site, at);
      const isFree = isShown
        ? spells.some(([from, to]) => at >= from && at <= to)
        : dot(direction, sky.normal) > 0 && direction[2] > 0 && !findHit(sky.cube, ...direction);
      lines[0].push(put(direction));
      lines[1].push(isFree ? put(direction) : null);
    }
    const width = isShown ? 2.4 : 1.1;
    drawn.push(rule(sheet.trace(lines[0]), HIDDEN, width), rule(sheet.trace(lines[1]), SUN, width));
  }
  for (const { minutes, sun } of day.hours) {
    const at = sun.direction[2] > LOWEST ? chart.place(sun.direction) : null;
    if (!at) continue;
    const [x, y] = sheet.spot(at);
    drawn.push(mark("circle", { cx: x, cy: y, r: 2.6, fill: SUN, stroke: "#ffffff", "stroke-width": 0.6 }));
    drawn.push(...sheet.label(String(minutes / 60), x + 4, y - 5, { "font-size": size }));
  }
  for (const dayPath of [day, ...paths]) {
    const highest = dayPath.path.reduce((best, sun) => (sun.altitude > best.altitude ? sun : best));
    const at = put(highest.direction);
    if (!at) continue;
    const [x, y] = sheet.spot(at);
    drawn.push(...sheet.label(tellDay(dayPath.date), x, y + size, { "font-size": size, "text-anchor": "middle", "font-weight": dayPath === day ? 700 : 400 }));
  }
  return drawn;
};

/** @type {Map<string, (Vec3 | null)[]>} */
const hourLines = new Map();

/**
 * Directions of the sun at equal hours of the site's clock through a year, null where a line ends.
 * @param {Site} site @param {string} year
 */
const findHourLines = (site, year) => {
  const key = JSON.stringify([site, year]);
  const known = hourLines.get(key);
  if (known) return known;
  /** @type {(Vec3 | null)[]} */
  const directions = [];
  const first = Date.parse(`${year}-01-01`);
  for (let hour = 0; hour < 24; hour++) {
    let shift = NaN; // of the clock: where it is changed, the line goes on at another place
    for (let day = 0; day < 366; day += 6) {
      const date = new Date(first + day * 86400000).toISOString().slice(0, 10);
      const instant = findInstant(site.zone, date, hour * 60);
      const offset = Date.parse(date) + hour * 3600000 - instant;
      if (offset !== shift) directions.push(null);
      shift = offset;
      const { direction } = findSun(site, instant);
      directions.push(direction[2] > 0 ? direction : null);
    }
  }
  hourLines.set(key, directions);
  return directions;
};

/** @param {string} date */
const tellDay = (date) =>
  new Intl.DateTimeFormat("en-GB", { day: "numeric", month: "short", timeZone: "UTC" }).format(Date.parse(date));
