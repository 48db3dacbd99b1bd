// Date and time of day: sliders, typed values, and a day or a year that plays.

import { addDays, findDayOfYear, findInstant, isDate } from "./clock.js";
import { nameZone, parseMinutes, readClock, tellDate, tellMinutes } from "./clock.js";
import { tellSun } from "./daylight.js";
import { button, el, fill, icon, slider } from "./dom.js";
import { makeInterval } from "./interval.js";

const DAY_SPEED = 60,
  YEAR_SPEED = 14; // minutes and days that pass in a second
const MONTHS = ["J", "F", "M", "A", "M", "J", "J", "A", "S", "O", "N", "D"];

/**
 * Show hours and minutes of an instant by the site's clock.
 * @param {string} zone @param {number} instant
 */
export const tellClock = (zone, instant) => tellMinutes(readClock(zone, instant + 30000).minutes);

/**
 * The date of a year's n-th day.
 * @param {string} year @param {number} n
 */
const findDate = (year, n) => addDays(`${year}-01-01`, n);

/** @param {...Element} children */
const line = (...children) => el("div", { class: "line" }, ...children);

/** @param {App} app */
export const makeTimebar = (app) => (app.daylight.site ? makeClockBar(app) : makeAngleBar(app));

/**
 * The bar of a site: its clock and calendar.
 * @param {App} app
 */
const makeClockBar = (app) => {
  const zone = app.daylight.site?.zone ?? "UTC";
  const stop = { playing: null, share: 0 };
  const time = slider(
    "Time of day",
    { min: 0, max: 1439, step: 1, value: 0 },
    (minutes) => app.set({ minutes, ...stop }),
    tellMinutes,
  );
  const date = slider(
    "Day of the year",
    { min: 0, max: 364, step: 1, value: 0 },
    (n) => app.set({ date: findDate(app.state.date.slice(0, 4), n), ...stop }),
    (n) => tellDate(findDate(app.state.date.slice(0, 4), n)),
  );
  const typedTime = el("input", {
    type: "text",
    class: "typed",
    size: 5,
    inputmode: "numeric",
    "aria-label": "Time, hours and minutes",
    autocomplete: "off",
    onchange: () => {
      const minutes = parseMinutes(typedTime.value);
      if (minutes !== null) app.set({ minutes, ...stop });
      else typedTime.value = tellMinutes(app.state.minutes);
    },
  });
  const typedDate = el("input", {
    type: "date",
    class: "typed",
    "aria-label": "Date",
    min: "1583-01-01",
    max: "2999-12-31",
    onchange: () => {
      if (isDate(typedDate.value)) app.set({ date: typedDate.value, ...stop });
      else typedDate.value = app.state.date;
    },
  });
  const makePlay = (/** @type {'day' | 'year'} */ what) =>
    button("", () => app.set({ playing: app.state.playing === what ? null : what, share: 0 }), {
      class: "play",
      "aria-label": `Play the ${what}`,
      title: `Play the ${what}`,
    });
  const plays = { day: makePlay("day"), year: makePlay("year") };
  const interval = makeInterval(app, zone);
  const output = el("p", { class: "told", "aria-live": "off" });
  const months = el(
    "div",
    { class: "months", "aria-hidden": "true" },
    ...MONTHS.map((name) => el("span", {}, name)),
  );
  const element = el(
    "section",
    { class: "timebar", "aria-label": "Time and date" },
    line(plays.day, el("div", { class: "track daytrack" }, time.input), typedTime),
    interval.element,
    line(plays.year, el("div", { class: "track" }, date.input, months), typedDate),
    output,
  );

  let last = 0;
  /**
   * Move the clock of what plays; whether anything does.
   * @param {number} now
   */
  const play = (now) => {
    const { state } = app;
    if (!state.playing) {
      last = 0;
      return false;
    }
    const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (isCalm && last && now - last < 500) return true;
    const seconds = last ? Math.min(0.5, (now - last) / 1000) : 0;
    last = now;
    if (state.playing === "day") app.set(passDay(seconds, isCalm));
    else {
      const days = (isCalm ? 7 : seconds * YEAR_SPEED) + state.share,
        whole = Math.floor(days);
      const next = addDays(state.date, whole),
        year = state.date.slice(0, 4);
      app.set({
        date: next.startsWith(year) ? next : findDate(year, 0),
        share: isCalm ? 0 : days - whole,
      });
    }
    return true;
  };
  /**
   * From sunset the day goes on at sunrise.
   * @param {number} seconds @param {boolean} isCalm
   */
  const passDay = (seconds, isCalm) => {
    const { date: on, minutes } = app.state,
      day = app.daylight.day(on);
    const later = minutes + (isCalm ? 15 : seconds * DAY_SPEED);
    if (!day || !day.up.length) return { minutes: later % 1440 };
    const [first, end] = [day.up[0][0], day.up[day.up.length - 1][1]];
    const at = findInstant(zone, on, Math.min(later, 1439.99));
    if (later < 1440 && at >= first && at <= end) return { minutes: later };
    return { minutes: readClock(zone, first).minutes };
  };
  /** @param {State} state */
  const update = (state) => {
    time.set(Math.floor(state.minutes));
    date.set(findDayOfYear(state.date));
    date.input.max = String(findDayOfYear(`${state.date.slice(0, 4)}-12-31`));
    const shown = tellMinutes(state.minutes);
    if (document.activeElement !== typedTime || state.playing) typedTime.value = shown;
    if (typedDate.value !== state.date) typedDate.value = state.date;
    for (const what of /** @type {const} */ (["day", "year"])) {
      const isOn = String(state.playing === what);
      if (plays[what].getAttribute("aria-pressed") === isOn) continue;
      plays[what].setAttribute("aria-pressed", isOn);
      fill(plays[what], icon(state.playing === what ? "pause" : "play"), what);
    }
    const day = app.daylight.day(state.date),
      { sun } = app;
    const isUpAllDay = day !== null && day.rise === null && day.set === null && day.up.length > 0;
    interval.update(state);
    const edges = !day
      ? []
      : day.rise === null && day.set === null
        ? [isUpAllDay ? "the sun does not set" : "the sun does not rise"]
        : [
            day.rise && `sunrise ${tellClock(zone, day.rise)}`,
            day.set && `sunset ${tellClock(zone, day.set)}`,
          ].filter(Boolean);
    const now = nameZone(zone, app.daylight.instant(state));
    fill(
      output,
      el("strong", {}, `${tellDate(state.date)}, ${shown} ${now}`),
      ` · ${tellSun(sun)} · ${edges.join(", ")}`,
    );
  };
  return { element, update, play };
};

/**
 * The bar without a site: two angles.
 * @param {App} app
 */
const makeAngleBar = (app) => {
  const degrees = (/** @type {number} */ value) => `${value.toFixed(0)}°`;
  const make = (
    /** @type {string} */ label,
    /** @type {number} */ max,
    /** @type {'azimuth' | 'altitude'} */ name,
  ) => {
    const control = slider(
      label,
      { min: 0, max, step: 0.5, value: 0 },
      (value) => app.set({ [name]: value }),
      degrees,
    );
    const typed = el("input", {
      type: "number",
      class: "typed",
      min: 0,
      max,
      step: 0.5,
      "aria-label": `${label} in degrees`,
      onchange: () => {
        const value = typed.valueAsNumber;
        app.set({
          [name]: Number.isFinite(value) ? Math.max(0, Math.min(max, value)) : app.state[name],
        });
      },
    });
    return {
      control,
      typed,
      name,
      line: line(
        el("span", { class: "name" }, label),
        el("div", { class: "track" }, control.input),
        typed,
      ),
    };
  };
  const both = [make("Sun's azimuth", 360, "azimuth"), make("Sun's altitude", 90, "altitude")];
  const element = el(
    "section",
    { class: "timebar", "aria-label": "The sun" },
    ...both.map((control) => control.line),
    el(
      "p",
      { class: "told" },
      "The file does not say where on earth it stands: give --lat and --lon for dates and times.",
    ),
  );
  /** @param {State} state */
  const update = (state) => {
    for (const { control, typed, name } of both) {
      control.set(state[name]);
      if (document.activeElement !== typed) typed.value = state[name].toFixed(1);
    }
  };
  return { element, update, play: () => false };
};
