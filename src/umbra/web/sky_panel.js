// The sky above the chosen place, in the panel and, on narrow screens, small in the picture.

import { button, el, fill, fold } from "./dom.js";
import { Chart } from "./sky_charts.js";
import { drawSmallSky } from "./sky_picture.js";
import { COARSE, describeSky, drawView, findSky, makeSkyDialog, tellChart, tellSky } from "./sky_view.js";

/** @typedef {import('./sky_view.js').SkyPlace} SkyPlace */

const WIDE = 298; // of the picture in the panel,
const SMALL = 104; // and of that in the model's picture [CSS pixels]

/**
 * @param {App} app
 * @param {(state: State, place: Place) => {title: string, parts: Mask, sun: import('./place.js').Sunlight | null}[]} findDays
 */
export const makeSkyPanel = (app, findDays) => {
  const scene = {
    model: app.model, names: app.things.map((thing) => thing.label), objectOf: app.thingOf,
    daylight: app.daylight, north: app.north,
  }; // prettier-ignore
  const dialog = makeSkyDialog(scene);
  const body = el("div", { class: "sky" }),
    element = fold("Sky above the place", body);
  element.open = true;
  const canvas = el("canvas", { "aria-hidden": "true" });
  const small = button(canvas, () => view && dialog.open(view), {
    class: "sky-small", "aria-label": "The sky above the place, larger", hidden: true,
  }); // prettier-ignore
  /** @type {SkyPlace | null} */
  let view = null;
  /** @type {Map<number, string>} of the objects that hide the most of the sky */
  let colors = new Map();
  let key = "",
    setSun = (/** @type {Vec3} */ _) => {};

  /** @param {State} state @param {Place} place */
  const draw = (state, place) => {
    const days = findDays(state, place),
      shown = state.compare === "before" ? days[0] : days[days.length - 1];
    const object = place.part < 0 ? null : app.thingOf[place.part];
    const title = object === null ? "the ground" : app.things[object].label || "(no name)";
    view = { place, cast: shown.parts, date: state.date, sunlight: shown.sun, now: app.sun.direction, title };
    const sky = findSky(scene, place, shown.parts, COARSE);
    colors = sky.colors;
    const other = days.length > 1 && days.find((one) => one !== shown);
    const chart = drawView(scene, view, sky, "stereographic", WIDE);
    setSun = chart.setSun;
    fill(
      body,
      other &&
        el("p", {}, el("strong", {}, shown.title), ` (${other.title.toLowerCase()}: ` +
          `${tellSky(findSky(scene, place, other.parts, COARSE).sums)})`), // prettier-ignore
      chart.element,
      el("p", { class: "quiet" }, tellChart(scene, sky, "stereographic")),
      button("Larger, other projections", () => view && dialog.open(view)),
      ...describeSky(scene, view, sky, COARSE),
    );
    drawSmallSky(canvas, sky, new Chart("stereographic", sky.normal, app.north), SMALL);
  };
  /** @param {State} state */
  const update = (state) => {
    const { place } = state;
    small.hidden = !place;
    if (!place) {
      if (key !== "none")
        fill(body, el("p", { class: "quiet" }, "Click or tap a place: what it sees of the sky, and what hides the rest."));
      key = "none";
      return;
    }
    if (state.playing === "year" || (!element.open && !small.offsetParent)) return;
    const [x, y, z] = place.normal ?? [];
    const now = [app.revision, state.compare === "before", state.date, ...place.position, x, y, z].join("|");
    if (now !== key) draw(state, place);
    key = now;
    if (view) view.now = app.sun.direction;
    setSun(app.sun.direction);
  };
  return { element, small, colors: () => colors, dialog: dialog.element, update, dispose: dialog.dispose };
};
