// The sky above a place in words, numbers and a picture, and the same large in a dialog.

import { readClock, tellDate } from "./clock.js";
import { button, choice, el, fill } from "./dom.js";
import { hang } from "./land.js";
import { findOrigin } from "./place.js";
import { CHARTS, Chart } from "./sky_charts.js";
import { findHit, lookAround, sumSky } from "./sky_cube.js";
import { COLORS, OTHER, drawSky } from "./sky_picture.js";
import { findSun } from "./sun.js";
import { dot } from "./vectors.js";

/** @typedef {import('./sky_charts.js').ChartName} ChartName */
/** @typedef {import('./sky_cube.js').SkySums} SkySums */
/** @typedef {import('./sky_picture.js').Sky & { sums: SkySums }} SeenSky */
/** @typedef {import('./place.js').Sunlight} Sunlight */

/**
 * @typedef {object} SkyScene what all skies of a model share
 * @property {Model} model
 * @property {string[]} names of objects; the land's number is theirs
 * @property {ArrayLike<number>} objectOf the object of each part
 * @property {import('./daylight.js').Daylight} daylight
 * @property {number} north azimuth of true north in the plan [degrees]
 *
 * @typedef {object} SkyPlace a place, what stands around it, and a date
 * @property {Place} place
 * @property {Mask} cast
 * @property {string} date
 * @property {Sunlight | null} sunlight of the date; null without a site
 * @property {Vec3} now direction of the sun
 * @property {string} title
 */

export const COARSE = 512,
  FINE = 1024; // texels along a cube's edge
const NAMED = COLORS.length;
const LEAST = 0.0005; // share of the sky that is told as a number
const BESIDE = 1000; // from the end of a spell to what hides the sun [ms]

/**
 * Find the sky above a place.
 * @param {SkyScene} scene
 * @param {Place} place
 * @param {Mask} cast
 * @param {number} size texels along a cube's edge
 * @returns {SeenSky}
 */
export const findSky = ({ model, objectOf, names, daylight, north }, place, cast, size) => {
  const normal = place.normal ?? /** @type {Vec3} */ ([0, 0, 1]);
  const land = daylight.site?.land,
    around = land ? hang(land, north) : undefined;
  const eye = findOrigin(model, place);
  const cube = lookAround(model, eye, objectOf, cast, size, around, names.length);
  const sums = sumSky(cube, normal);
  const colors = new Map(sums.blockedBy.slice(0, NAMED).map(([object], k) => [object, COLORS[k]]));
  return { cube, normal, sums, colors };
};

/** @param {SkySums} sums */
export const tellSky = ({ viewFactor, component }) =>
  `sky view factor ${viewFactor.toFixed(3)}, sky component ${component.toFixed(1)} %`;

/**
 * Describe the plane that is judged.
 * @param {Vec3} normal @param {number} north [degrees]
 */
export const tellPlane = ([x, y, z], north) => {
  const tilt = (Math.acos(Math.max(-1, Math.min(1, z))) * 180) / Math.PI;
  if (tilt < 0.05) return "level plane";
  const facing = ((Math.atan2(x, y) * 180) / Math.PI - north + 720) % 360;
  return `plane facing ${facing.toFixed(0)}°, ${tilt.toFixed(0)}° from level`;
};

/** @param {string} name */
const orNone = (name) => name || "(no name)";
/** @param {string[]} names @param {number} object */
const nameObject = (names, object) => (object < names.length ? orNone(names[object]) : "land");

/**
 * List what obstructs, with its share of the plane's open sky component, as a key of colours.
 * @param {SkyScene} scene
 * @param {SeenSky} sky
 */
export const listObstructions = ({ names }, { sums, colors }) => {
  const rows = sums.blockedBy.slice(0, NAMED).map(([object, share]) => ({
    share, color: colors.get(object) ?? OTHER, name: nameObject(names, object),
  })); // prettier-ignore
  const rest = sums.blockedBy.slice(NAMED);
  if (rest.length) {
    const share = rest.reduce((sum, [, part]) => sum + part, 0);
    rows.push({ share, color: OTHER, name: `${rest.length} others` });
  }
  if (!rows.length) return el("p", { class: "quiet" }, "Nothing stands in the way.");
  const list = rows.map(({ share, color, name }) => {
    const swatch = el("i", { "aria-hidden": "true" });
    swatch.style.background = color;
    const shown = share < LEAST ? "<\u00a00.1\u00a0%" : `${(100 * share).toFixed(1)}\u00a0%`;
    return el("li", {}, swatch, el("b", {}, shown), el("span", {}, name));
  });
  return el(
    "div",
    {},
    el("p", { class: "quiet" }, "Takes of the open sky component"),
    el("ul", { class: "sky-key" }, ...list),
  );
};

/**
 * Show an instant by the clock, to a second.
 * @param {string} zone @param {number} instant
 */
const tellSecond = (zone, instant) => {
  const seconds = Math.round(readClock(zone, instant).minutes * 60);
  return [seconds / 3600, (seconds / 60) % 60, seconds % 60]
    .map((part) => String(Math.floor(part)).padStart(2, "0"))
    .join(":");
};

/**
 * Tell when the sun is seen, what it comes out of, and what it goes behind.
 * @param {SkyScene} scene
 * @param {SkyPlace} view
 */
export const listSpells = ({ model, daylight }, { place, cast, date, sunlight }) => {
  const { site } = daylight,
    day = daylight.day(date);
  if (!site || !day || !sunlight) return null;
  const name = (/** @type {number} */ instant) => {
    if (instant <= day.begin || instant >= day.end) return "midnight";
    const { direction, isBehind } = findSun(site, instant);
    if (direction[2] <= 0) return "the horizon";
    if (place.normal && dot(place.normal, direction) <= 0) return "its own plane";
    const [hit] = model.trace(findOrigin(model, place), direction, { cast });
    return hit ? orNone(model.parts[hit.part].label) : isBehind ? "the land" : "the sky";
  };
  if (!sunlight.spells.length) return el("p", { class: "quiet" }, `No sun on ${date}.`);
  const rows = sunlight.spells.map(([from, to]) =>
    el(
      "li",
      {},
      el("b", {}, `${tellSecond(site.zone, from)}–${tellSecond(site.zone, to)}`),
      el("span", {}, `out of ${name(from - BESIDE)}, behind ${name(to + BESIDE)}`),
    ),
  );
  return el(
    "div",
    {},
    el("p", { class: "quiet" }, `Sun on ${tellDate(date)}, the whole day`),
    el("ul", { class: "sky-spells" }, ...rows),
  );
};

/**
 * Draw a sky with the sun's paths of its date and year.
 * @param {SkyScene} scene
 * @param {SkyPlace} view
 * @param {SeenSky} sky
 * @param {ChartName} name
 * @param {number} wide [CSS pixels]
 */
export const drawView = ({ daylight, north }, { date, sunlight, title }, sky, name, wide) => {
  const { site } = daylight,
    day = daylight.day(date);
  const others = ["06-21", "12-21", "03-20"].flatMap(
    (monthDay) => daylight.day(`${date.slice(0, 4)}-${monthDay}`) ?? [],
  );
  const sun = site && day && sunlight ? { site, day, others, spells: sunlight.spells } : null;
  const words = `The sky above ${title}: ${tellSky(sky.sums)}. What obstructs it is listed below.`;
  return drawSky(sky, new Chart(name, sky.normal, north), sun, wide, words);
};

/**
 * How a picture is read.
 * @param {SkyScene} scene
 * @param {SeenSky} sky
 * @param {ChartName} name
 */
export const tellChart = ({ daylight: { site }, north }, sky, name) => {
  const chart = new Chart(name, sky.normal, north);
  const how = chart.isRound
    ? `As on a map: ${site ? "north" : "the model's y axis"} is up, east on the right; circles every 10°.`
    : chart.facing === null
      ? "Equal areas give a level plane equal light. Across: azimuth; up: altitude."
      : "Equal areas give a vertical plane equal light. Across: azimuth from the plane's normal; up: " +
        "altitude. Curves: level edges parallel to the plane, every 10° straight ahead.";
  const suns = site ? ` Orange: the sun, hours by the clock (${site.zone}); pale where it is hidden.` : "";
  return `${how}${suns}${sky.normal[2] < 1 - 1e-9 ? " Grey: behind the plane." : ""}`;
};

/**
 * The dialog of a large picture, which Escape closes.
 * @param {SkyScene} scene
 */
export const makeSkyDialog = (scene) => {
  /** @type {{view: SkyPlace, sky: SeenSky} | null} */
  let shown = null;
  let name = /** @type {ChartName} */ (CHARTS[0][0]);
  const heading = el("h2", {}, ""),
    figure = el("div", { class: "sky-figure" }),
    pointed = el("p", { class: "quiet sky-pointed" }),
    caption = el("p", { class: "quiet sky-caption" }),
    words = el("div", { class: "sky-words-beside" });
  const draw = () => {
    if (!shown || !element.open) return;
    const { clientWidth, clientHeight } = document.documentElement;
    const high = name === "waldram" ? Infinity : clientHeight - 170;
    const wide = Math.max(240, Math.min(clientWidth - 56, high, 700));
    const { view, sky } = shown,
      chart = drawView(scene, view, sky, name, wide);
    chart.setSun(view.now);
    chart.element.addEventListener("pointermove", (event) => {
      const box = chart.element.getBoundingClientRect();
      const toward = chart.findDirection(event.clientX - box.left, event.clientY - box.top);
      pointed.textContent = toward ? tellDirection(scene, sky, toward) : "";
    });
    fill(figure, chart.element);
    fill(caption, tellChart(scene, sky, name));
    pointed.textContent = "";
  };
  /** @type {HTMLDialogElement} */
  const element = el(
    "dialog",
    { class: "sky-dialog", "aria-label": "The sky above this place", onclose: () => (shown = null) },
    el(
      "div",
      { class: "line sky-head" },
      heading,
      choice("Projection", CHARTS, (value) => {
        name = /** @type {ChartName} */ (value);
        draw();
      }),
      button("Close", () => element.close()),
    ),
    el("div", { class: "sky-body" }, el("div", {}, figure, pointed, caption), words),
  );
  addEventListener("resize", draw);
  /** @param {SkyPlace} view */
  const open = (view) => {
    const sky = findSky(scene, view.place, view.cast, FINE);
    shown = { view, sky };
    fill(heading, `The sky above ${view.title}`);
    fill(words, ...describeSky(scene, view, sky, FINE));
    if (!element.open) element.showModal();
    draw();
  };
  const dispose = () => removeEventListener("resize", draw);
  return { element, open, dispose };
};

/**
 * Numbers, key, spells and how they were found.
 * @param {SkyScene} scene
 * @param {SkyPlace} view
 * @param {SeenSky} sky
 * @param {number} size
 */
export const describeSky = (scene, view, sky, size) => {
  const { viewFactor, component } = sky.sums;
  const own = view.place.position.map((value, k) => (value + scene.model.origin[k]).toFixed(3)),
    toward = sky.normal[2] > 1 - 1e-9 ? [] : sky.normal.map((value) => value.toFixed(5));
  return [
    el(
      "dl",
      { class: "figures sky-figures" },
      el("div", {}, el("dt", {}, "Sky view factor"), el("dd", {}, viewFactor.toFixed(3))),
      el("div", {}, el("dt", {}, "Sky component"), el("dd", {}, `${component.toFixed(1)} %`)),
    ),
    listObstructions(scene, sky),
    listSpells(scene, view),
    el(
      "p",
      { class: "quiet" },
      `Of a ${tellPlane(sky.normal, scene.north)}, by ${size} directions along each edge of a cube: ` +
        "the factor is within 0.001. Exact to rounding, with its outlines: ",
      el("code", {}, `umbra sky FILE --at ${[...own, ...toward].join(",")}`),
      view.cast && ", with --no-cast for what does not stand",
    ),
  ];
};

/**
 * Name what is seen in a direction.
 * @param {SkyScene} scene @param {SeenSky} sky @param {Float64Array} toward
 */
const tellDirection = ({ names, north }, { cube, normal }, toward) => {
  const [x, y, z] = toward;
  const azimuth = ((Math.atan2(x, y) * 180) / Math.PI - north + 720) % 360,
    altitude = (Math.asin(Math.min(1, z)) * 180) / Math.PI;
  const hit = findHit(cube, x, y, z);
  const what = dot(normal, toward) <= 0 ? "behind the plane" : hit ? nameObject(names, hit - 1) : "free sky";
  return `azimuth ${azimuth.toFixed(1)}°, ${altitude.toFixed(1)}° high: ${what}`;
};
