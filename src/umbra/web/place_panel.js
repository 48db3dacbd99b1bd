// The chosen place: its hours of sun on the date, and who stands in the sun's way now.

import { findInstant, tellMinutes } from "./clock.js";
import { tellClock } from "./timebar.js";
import { button, el, fill, fold } from "./dom.js";
import { findCasters } from "./place.js";
import { dot } from "./vectors.js";


const NAMED = 4; // casters that are named

/**
 * Show hours and minutes: 3 h 05 min.
 * @param {number} hours
 */
export const tellHours = (hours) => {
  const minutes = Math.round(hours * 60);
  return minutes < 60
    ? `${minutes} min`
    : `${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, "0")} min`;
};

/** @param {App} app */
export const makePlacePanel = (app) => {
  const body = el("div", { class: "place" });
  const element = fold("At a place", body);
  element.open = true;
  const zone = app.daylight.site?.zone ?? "UTC";

  /** What is kept while place, date and parts stay: only the sun's way changes with the time. */
  let cached = {
    key: "",
    days: /** @type {{title: string, parts: Mask, sun: import('./place.js').Sunlight | null}[]} */ ([]),
  };
  const findDays = (/** @type {State} */ state, /** @type {Place} */ place) => {
    const key = [app.revision, state.date, place.position.join()].join("|");
    if (cached.key !== key) {
      const count = (/** @type {Mask} */ parts) => app.findSunlight(place, state.date, parts);
      const days = [
        { title: app.hasChanges ? "After" : "", parts: app.after, sun: count(app.after) },
      ];
      if (app.hasChanges)
        days.unshift({ title: "Before", parts: app.before, sun: count(app.before) });
      cached = { key, days };
    }
    return cached.days;
  };
  /**
   * Hours of sun, of those that it is up.
   * @param {import('./place.js').Sunlight} sun
   * @param {string} date
   */
  const tellShare = (sun, date) => {
    const up = (app.daylight.day(date)?.up ?? []).reduce((sum, [from, to]) => sum + to - from, 0);
    return `${tellHours(sun.hours)} of ${tellHours(up / 3.6e6)}`;
  };
  /**
   * Hours of sun in the interval of the page.
   * @param {import('./place.js').Sunlight} sun
   */
  const tellInterval = (sun) => {
    const { interval, date } = app.state;
    const [from, to] = interval.map((minutes) => findInstant(zone, date, minutes));
    const lit = sun.spells.reduce(
      (sum, [begin, end]) => sum + Math.max(0, Math.min(end, to) - Math.max(begin, from)),
      0,
    );
    return `${interval.map(tellMinutes).join("–")}: ${tellHours(lit / 3.6e6)} of sun.`;
  };
  const tellWhere = (/** @type {Place} */ place) => {
    const own = place.position.map((value, k) => (value + app.model.origin[k]).toFixed(2));
    return `x ${own[0]}, y ${own[1]}, z ${own[2]} m`;
  };
  /** @param {Place} place @param {Mask} parts */
  const tellNow = (place, parts) => {
    const { sun } = app;
    if (sun.altitude <= 0) return "The sun is below the horizon.";
    if (sun.isBehind) return "Now in shadow: the sun is behind the land.";
    const direction = sun.direction;
    if (place.normal && dot(place.normal, direction) <= 0) {
      return "Now in shadow: the surface is turned away from the sun.";
    }
    const names = findCasters(app.model, place, direction, parts);
    if (!names.length) return "Now in the sun.";
    const more = names.length > NAMED ? ` and ${names.length - NAMED} more` : "";
    return `Now in shadow of ${names.slice(0, NAMED).join(", ")}${more}.`;
  };
  /**
   * A strip of the day: night, shadow, sun.
   * @param {import('./place.js').Sunlight} sun @param {string} date
   */
  const drawStrip = (sun, date) => {
    const day = app.daylight.day(date);
    if (!day) return null;
    const share = (/** @type {number} */ instant) =>
      (100 * (instant - day.begin)) / (day.end - day.begin);
    const strip = el("div", { class: "strip", "aria-hidden": "true" });
    const put = (
      /** @type {string} */ name,
      /** @type {number} */ from,
      /** @type {number} */ to,
    ) => {
      const bar = el("i", { class: name });
      bar.style.left = `${share(from)}%`;
      bar.style.width = `${share(to) - share(from)}%`;
      strip.append(bar);
    };
    for (const [from, to] of day.up) put("dark", from, to);
    for (const [from, to] of sun.spells) put("lit", from, to);
    const now = el("i", { class: "now" });
    now.style.left = `${share(app.daylight.instant(app.state))}%`;
    strip.append(now);
    return strip;
  };
  /** @param {Place} place @param {State} state @param {ReturnType<typeof findDays>[number]} one */
  const drawDay = (place, state, { title, parts, sun }) => {
    const figures =
      sun &&
      el(
        "dl",
        { class: "figures" },
        ...[
          ["Sun", tellShare(sun, state.date)],
          ["First", sun.spells.length ? tellClock(zone, sun.spells[0][0]) : "none"],
          ["Last", sun.spells.length ? tellClock(zone, sun.spells.at(-1)?.[1] ?? 0) : "none"],
        ].map(([name, figure]) => el("div", {}, el("dt", {}, name), el("dd", {}, figure))),
      );
    const spells =
      sun &&
      sun.spells.length > 1 &&
      el(
        "p",
        { class: "quiet" },
        `In the sun ${sun.spells.map(([from, to]) => `${tellClock(zone, from)}–${tellClock(zone, to)}`).join(", ")}.`,
      );
    return el(
      "div",
      { class: "day" },
      title && el("h2", {}, title),
      figures,
      sun && drawStrip(sun, state.date),
      sun && el("p", { class: "within" }, tellInterval(sun)),
      spells,
      el("p", { class: "now-words", "data-now": title }, tellNow(place, parts)),
    );
  };
  /** In a line over the picture, for screens on which the panel is far below it, and to be read out. */
  const brief = el("p", { class: "brief hidden", role: "status" });
  /** @param {Place} place @param {ReturnType<typeof findDays>[number]} one */
  const tellDay = (place, { title, parts, sun }) => {
    const [first, last] = [sun?.spells[0], sun?.spells.at(-1)];
    const ends = first && last ? `, ${tellClock(zone, first[0])}–${tellClock(zone, last[1])}` : "";
    const hours = sun ? `${tellShare(sun, app.state.date)} in the sun${ends}. ` : "";
    return `${title ? `${title}: ` : ""}${hours}${tellNow(place, parts)}`;
  };
  /** @param {State} state */
  const update = (state) => {
    const { place } = state;
    if (!place) {
      brief.textContent = "";
      if (body.dataset.key !== "none") {
        fill(
          body,
          el(
            "p",
            { class: "quiet" },
            "Click or tap a place on the model or the ground: its hours of sun on this date, " +
              "and who casts a shadow on it now.",
          ),
        );
      }
      body.dataset.key = "none";
      return;
    }
    if (!element.open || state.playing === "year") return;
    const key = [
      app.revision,
      state.date,
      Math.floor(state.minutes),
      state.azimuth,
      state.altitude,
      state.interval,
      place.position.join(),
    ].join("|");
    if (body.dataset.key === key) return;
    body.dataset.key = key;
    const object = place.part < 0 ? null : app.thingOf[place.part];
    const name = object === null ? "The ground" : app.things[object].label || "(no name)";
    const hadFocus =
      body.contains(document.activeElement) && document.activeElement instanceof HTMLSelectElement;
    const days = findDays(state, place);
    if (!state.playing) brief.textContent = days.map((shown) => tellDay(place, shown)).join(" ");
    fill(
      body,
      el(
        "p",
        { class: "where" },
        el("strong", {}, name),
        " ",
        el("span", { class: "quiet" }, tellWhere(place)),
      ),
      ...days.map((shown) => drawDay(place, state, shown)),
      el(
        "div",
        { class: "line" },
        object !== null &&
          el(
            "label",
            { class: "line quiet" },
            "This object is",
            app.parts.choose("This object is", state.standing.get(object) ?? "on", (where) =>
              app.parts.put([object], where),
            ),
          ),
        button("Go there", () => app.orbit.goTo(place.position)),
        button("Clear", () => app.set({ place: null })),
      ),
    );
    if (hadFocus) body.querySelector("select")?.focus();
  };
  return { element, brief, findDays, update };
};
