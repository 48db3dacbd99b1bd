// The sky above the chosen place, in the panel and, on narrow screens, small in the picture.

import { button, el, fill, fold } from "./dom.js";
import { makeSkyBox } from "./sky_box.js";
import { Chart } from "./sky_charts.js";
import { drawSmallSky } from "./sky_picture.js";

/** @typedef {import('./sky_view.js').SkyPlace} SkyPlace */

const SMALL = 104; // of the picture in the model's picture [CSS pixels]

/**
 * @param {App} app
 * @param {(state: State, place: Place) => {title: string, parts: Mask, sun: import('./place.js').Sunlight | null}[]} findDays
 */
export const makeSkyPanel = (app, findDays) => {
  const { model, daylight, north, things, thingOf: objectOf } = app;
  const names = things.map((thing) => thing.label),
    box = makeSkyBox({ model, names, objectOf, daylight, north });
  const element = fold("Sky above the place", box.body);
  element.open = true;
  /** @type {SkyPlace | null} */
  let view = null;
  /** @type {Map<number, string>} of the objects that hide the most of the sky */
  let colors = new Map();
  let key = "",
    setSun = (/** @type {Vec3} */ _) => {};
  const canvas = el("canvas", { "aria-hidden": "true" });
  const small = button(canvas, () => view && box.dialog.open(view), {
    class: "sky-small",
    "aria-label": "The sky above the place, larger",
    hidden: true,
  });

  /** @param {State} state @param {Place} place */
  const draw = (state, place) => {
    const days = findDays(state, place),
      shown = state.compare === "before" ? days[0] : days[days.length - 1],
      other = days.find((day) => day !== shown);
    const object = place.part < 0 ? null : objectOf[place.part],
      title = object === null ? "the ground" : names[object] || "(no name)";
    const { parts: cast, sun: sunlight } = shown;
    view = { place, cast, date: state.date, sunlight, now: app.sun.direction, title };
    const drawn = box.show(view, other && { title: other.title, cast: other.parts });
    setSun = drawn.setSun;
    colors = drawn.sky.colors;
    drawSmallSky(canvas, drawn.sky, new Chart("stereographic", drawn.sky.normal, north), SMALL);
  };
  /** @param {State} state */
  const update = (state) => {
    const { place } = state;
    small.hidden = !place;
    if (!place) {
      if (key !== "none") {
        const words = "Click or tap a place: what it sees of the sky, and what hides the rest.";
        fill(box.body, el("p", { class: "quiet" }, words));
      }
      key = "none";
      return;
    }
    if (state.playing === "year" || (!element.open && !small.offsetParent)) return;
    const which = [app.revision, state.compare === "before", state.date];
    const now = [...which, ...place.position, ...(place.normal ?? [])].join("|");
    if (now !== key) draw(state, place);
    key = now;
    if (view) view.now = app.sun.direction;
    setSun(app.sun.direction);
  };
  const { element: dialog, dispose } = box.dialog;
  return { element, small, colors: () => colors, dialog, update, dispose };
};
