// The chosen place's year: day by hour, coloured by sun and by who casts the shadow.

import { AWAY, Carpet, NIGHT, SUN } from "./carpet.js";
import { drawCarpet, findColor, findFrame, OTHERS } from "./carpet_picture.js";
import { addDays, findDayOfYear, nameZone, tellDate, tellMinutes } from "./clock.js";
import { el, fill, fold } from "./dom.js";
import { DAYS, findYearSuns, MINUTES, ROWS } from "./year_suns.js";

const HIGH = 190; // [CSS pixels]
const SLICE = 12; // of rays between frames [ms]

/** @param {number} hours */
const tellYear = (hours) => `${Math.round(hours).toLocaleString("en")}\u00a0h`;

/** @param {App} app */
export const makeYearPanel = (app) => {
  const { site } = app.daylight;
  const body = el("div", { class: "year" }),
    element = fold("The place's year", body);
  if (!site) return null;
  element.open = true;
  element.addEventListener("toggle", () => app.redraw(false));
  /** @type {{title: string, carpet: Carpet, canvas: HTMLCanvasElement, key: HTMLElement, output: HTMLElement, drawn: string}[]} */
  let shown = [];
  let made = "",
    timer = 0;

  /** @param {number} value */
  const name = (value) =>
    value === SUN
      ? "in the sun"
      : value === AWAY
        ? "turned from the sun"
        : value === NIGHT
          ? "night"
          : app.things[value].label || "(no name)";

  /**
   * @param {string} title @param {Mask} cast @param {Place} place @param {number} year
   */
  const make = (title, cast, place, year) => {
    const carpet = new Carpet(app.model, place, cast, app.thingOf, findYearSuns(site, year));
    const canvas = el("canvas", { class: "carpet", role: "img", "aria-label": "The place's year, being counted" }),
      output = el("p", { class: "quiet told-cell", "aria-live": "off" });
    const find = (/** @type {PointerEvent | MouseEvent} */ { offsetX, offsetY }) => {
      const frame = findFrame(canvas.clientWidth, HIGH);
      const column = Math.floor(((offsetX - frame.left) / frame.wide) * carpet.suns.columns),
        row = Math.floor((1 - (offsetY - frame.top) / frame.high) * ROWS);
      const isIn = column >= 0 && row >= 0 && column < carpet.suns.columns && row < ROWS;
      return isIn ? { column, row, date: carpet.suns.dates[column] } : null;
    };
    canvas.addEventListener("pointermove", (event) => {
      const at = find(event);
      if (!at) return;
      const value = carpet.at(at.column, at.row),
        isShade = value >= 0;
      const when = `${tellDate(at.date)}, ${tellMinutes((at.row + 0.5) * MINUTES)}`;
      fill(output, `${when}: ${isShade ? `in shadow of ${name(value)}` : name(value)}`);
    });
    canvas.addEventListener("click", (event) => {
      const at = find(event);
      if (at) app.set({ date: at.date, minutes: (at.row + 0.5) * MINUTES, playing: null, share: 0 });
    });
    return { title, carpet, canvas, key: el("ul", { class: "carpet-key" }), output, drawn: "" };
  };

  /** Draw what is there, and go on until all is. */
  const advance = () => {
    clearTimeout(timer);
    if (!element.open || !element.isConnected) return;
    const open = shown.find(({ carpet }) => !carpet.isWhole);
    open?.carpet.fill(SLICE);
    draw();
    if (open) timer = setTimeout(advance, 0);
  };

  const draw = () => {
    const { state } = app,
      now = { day: findDayOfYear(state.date), minutes: state.minutes };
    for (const panel of shown) {
      const { carpet, canvas, key } = panel,
        wide = canvas.clientWidth || 290,
        dot = Math.min(window.devicePixelRatio || 1, 3);
      const look = [
        carpet.pass, carpet.isWhole ? 0 : carpet.next, now.day, Math.floor(now.minutes), wide,
        app.root.dataset.theme, ...app.sky.colors().keys(),
      ].join();
      if (panel.drawn === look) continue;
      panel.drawn = look;
      const hours = carpet.sum(),
        colors = app.sky.colors();
      [canvas.width, canvas.height] = [Math.round(wide * dot), Math.round(HIGH * dot)];
      const pen = canvas.getContext("2d");
      if (!pen) continue;
      pen.scale(dot, dot);
      drawCarpet(pen, carpet, colors, now, wide, HIGH, getComputedStyle(canvas).color);
      if (!carpet.isWhole) continue;
      const rest = hours.filter(([value]) => value >= 0 && !colors.has(value));
      const rows = hours.filter(([value]) => !rest.some(([other]) => other === value));
      const more = rest.reduce((sum, [, part]) => sum + part, 0);
      const row = (/** @type {string} */ color, /** @type {string} */ words, /** @type {number} */ part) => {
        const swatch = el("i", { "aria-hidden": "true" });
        swatch.style.background = color;
        return el("li", {}, swatch, el("b", {}, tellYear(part)), el("span", {}, words));
      };
      fill(
        key,
        ...rows.map(([value, part]) =>
          row(findColor(value, colors), value >= 0 ? `shadow of ${name(value)}` : name(value), part),
        ),
        more > 0 && row(OTHERS, `shadow of ${rest.length} others`, more),
      );
      const sun = hours.find(([value]) => value === SUN)?.[1] ?? 0,
        up = hours.reduce((sum, [, part]) => sum + part, 0);
      canvas.setAttribute(
        "aria-label",
        `${panel.title && `${panel.title}: `}day by hour over ${carpet.suns.year}: ${tellYear(sun)} in the sun of ${tellYear(up)}`,
      );
    }
  };

  /** @param {State} state */
  const update = (state) => {
    const { place, date } = state,
      year = Number(date.slice(0, 4));
    element.hidden = !place;
    if (!place || !element.open || state.playing === "year") return;
    const key = [app.revision, year, place.position.join()].join("|");
    if (made !== key) {
      made = key;
      shown = [make(app.hasChanges ? "After" : "", app.after, place, year)];
      if (app.hasChanges) shown.unshift(make("Before", app.before, place, year));
      const clock = nameZone(site.zone, app.daylight.instant({ ...state, minutes: 720 }));
      const isShifted = clock !== nameZone(site.zone, app.daylight.instant({ ...state, date: addDays(date, 183), minutes: 720 }));
      fill(
        body,
        ...shown.map(({ title, canvas, key: list, output }) =>
          el("div", { class: "day" }, title && el("h2", {}, title), canvas, output, list),
        ),
        el(
          "p",
          { class: "quiet" },
          `Days of ${year} to the right, hours upward by the clock of ${site.zone}${isShifted ? ", with its summer time" : ""}. ` +
            `A ray every ${DAYS} days and ${MINUTES} minutes; a click goes there.`,
        ),
      );
    }
    advance();
  };
  return { element, update, shown: () => shown };
};
