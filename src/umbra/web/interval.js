// The interval of hours of sun: two handles on the day's track, which shows its light and hours.

import { tellMinutes } from "./clock.js";
import { makeGradient } from "./day_gradient.js";
import { button, el, fill, icon } from "./dom.js";
import { STEP } from "./steps.js";

const DAY = 1440; // [min]
const HOURS = [0, 3, 6, 9, 12, 15, 18, 21, 24];
const KEYS = /** @type {Record<string, number>} */ ({
  ArrowLeft: -STEP, ArrowDown: -STEP, ArrowRight: STEP, ArrowUp: STEP,
  PageDown: -60, PageUp: 60, Home: -DAY, End: DAY,
});

/** @typedef {[number, number]} Interval minutes since midnight */

/**
 * Move an end of an interval, or both, by whole steps within the day.
 * @param {Interval} interval
 * @param {'from' | 'to' | 'both'} which
 * @param {number} by [min]
 * @returns {Interval}
 */
export const moveInterval = ([from, to], which, by) => {
  const whole = Math.round(by / STEP) * STEP;
  if (which === "from") return [Math.max(0, Math.min(to - STEP, from + whole)), to];
  if (which === "to") return [from, Math.min(DAY, Math.max(from + STEP, to + whole))];
  const shift = Math.max(-from, Math.min(DAY - to, whole));
  return [from + shift, to + shift];
};

/**
 * @param {App} app
 * @param {string} zone
 */
export const makeInterval = (app, zone) => {
  const put = (/** @type {Interval} */ interval) => app.set({ interval, hasSunHours: true });
  const toggle = button("", () => app.set({ hasSunHours: !app.state.hasSunHours }), {
    class: "counts",
    "aria-label": "Hours of sun",
    title: "Hours of sun of the interval, in place of light and shadow",
  });
  fill(toggle, icon("sun"), "hours");
  /** @param {'from' | 'to' | 'both'} which @param {Element} part */
  const drag = (which, part) => {
    const handle = /** @type {HTMLElement} */ (part);
    let start = 0,
      was = /** @type {Interval} */ ([0, 0]);
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      [start, was] = [event.clientX, app.state.interval];
    });
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const minutes = ((event.clientX - start) / track.clientWidth) * DAY;
      put(moveInterval(was, which, minutes));
    });
  };
  const makeHandle = (/** @type {'from' | 'to'} */ which, /** @type {string} */ label) => {
    const handle = el("div", {
      class: "end", role: "slider", tabindex: 0, "aria-label": label,
      "aria-valuemin": 0, "aria-valuemax": DAY, "aria-orientation": "horizontal",
    });
    handle.addEventListener("keydown", (event) => {
      const by = KEYS[event.key];
      if (by === undefined || event.altKey || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      put(moveInterval(app.state.interval, which, by));
    });
    drag(which, handle);
    return handle;
  };
  const from = makeHandle("from", "Hours of sun from"),
    to = makeHandle("to", "Hours of sun until"),
    span = el("div", { class: "span", title: "Drag to move the interval" });
  drag("both", span);
  for (const part of [toggle, from, to])
    for (const type of ["pointerenter", "focus"]) part.addEventListener(type, () => app.sunHours.expect());
  const light = el("div", { class: "light" });
  const marks = HOURS.map((hour) => {
    const mark = el("i", {}, hour);
    mark.style.left = `${(100 * hour) / 24}%`;
    return mark;
  });
  const hours = el("div", { class: "hours", "aria-hidden": "true" }, ...marks);
  const track = el("div", { class: "interval" }, light, span, from, to, hours);
  const output = el("output", { class: "typed ends" });
  const element = el("div", { class: "line" }, toggle, el("div", { class: "track" }, track), output);

  /** @type {Day | null} */
  let drawn = null;
  const update = (/** @type {State} */ state) => {
    const share = (/** @type {number} */ minutes) => `${(100 * minutes) / DAY}%`;
    const [begin, end] = state.interval,
      day = app.daylight.day(state.date);
    if (day && day !== drawn) light.style.background = makeGradient(day, zone);
    drawn = day;
    track.classList.toggle("on", state.hasSunHours);
    span.style.left = from.style.left = share(begin);
    to.style.left = share(end);
    span.style.width = share(end - begin);
    for (const [handle, minutes, low, high] of /** @type {[HTMLElement, number, number, number][]} */ ([
      [from, begin, 0, end - STEP],
      [to, end, begin + STEP, DAY],
    ])) {
      handle.setAttribute("aria-valuenow", String(minutes));
      handle.setAttribute("aria-valuemin", String(low));
      handle.setAttribute("aria-valuemax", String(high));
      handle.setAttribute("aria-valuetext", tellMinutes(minutes));
    }
    output.textContent = `${tellMinutes(begin)}–${tellMinutes(end)}`;
    toggle.setAttribute("aria-pressed", String(state.hasSunHours));
  };
  return { element, update };
};
