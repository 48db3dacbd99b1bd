// The sky above a place as a box: picture, numbers, key, spells; a button shows it large.

import { Daylight } from "./daylight.js";
import { button, el, fill } from "./dom.js";
import { listThings } from "./parts.js";
import { findSunlight } from "./place.js";
import {
  COARSE,
  describeSky,
  drawView,
  findSky,
  makeSkyDialog,
  tellChart,
  tellSky,
} from "./sky_view.js";

/** @typedef {import('./sky_view.js').SkyPlace} SkyPlace */
/** @typedef {import('./sky_view.js').SkyScene} SkyScene */

const WIDE = 298; // of the picture [CSS pixels]

/** @param {SkyScene} scene */
export const makeSkyBox = (scene) => {
  const dialog = makeSkyDialog(scene),
    body = el("div", { class: "sky" });
  /**
   * Draw the sky of a place.
   * @param {SkyPlace} view
   * @param {{title: string, cast: Mask}} [other] the other state of a change, whose numbers are told
   */
  const show = (view, other) => {
    const sky = findSky(scene, view.place, view.cast, COARSE),
      chart = drawView(scene, view, sky, "stereographic", WIDE);
    chart.setSun(view.now);
    const text = other && tellSky(findSky(scene, view.place, other.cast, COARSE).sums);
    fill(
      body,
      other && el("p", {}, `${other.title}: ${text}; here:`),
      chart.element,
      el("p", { class: "quiet" }, tellChart(scene, sky, "stereographic")),
      button("Larger, other projections", () => dialog.open(view)),
      ...describeSky(scene, view, sky, COARSE),
    );
    return { sky, setSun: chart.setSun };
  };
  return { body, dialog, show };
};

/**
 * The sky above places of a model that no live page shows.
 * @param {Model} model
 */
export const makeModelSky = (model) => {
  const things = listThings(model),
    daylight = new Daylight(model.site);
  /** @type {number[]} */
  const objectOf = [];
  things.forEach((thing, k) => {
    for (const part of thing.parts) objectOf[part] = k;
  });
  const names = things.map((thing) => thing.label),
    north = model.site?.trueNorth ?? 0;
  const box = makeSkyBox({ model, names, objectOf, daylight, north });
  let setSun = (/** @type {Vec3} */ _) => {};
  /** @param {{date: string, minutes: number}} when */
  const findNow = (when) => daylight.sun({ ...when, azimuth: 0, altitude: 0 }).direction;
  /**
   * @param {Place} place @param {Mask} cast
   * @param {{date: string, minutes: number}} when @param {string} title
   */
  const show = (place, cast, when, title) => {
    const { site } = daylight,
      day = daylight.day(when.date);
    const sunlight = site && day ? findSunlight(model, site, day, place, cast) : null;
    const view = { place, cast, date: when.date, sunlight, now: findNow(when), title };
    setSun = box.show(view).setSun;
  };
  /** @param {{date: string, minutes: number}} when */
  const moveSun = (when) => setSun(findNow(when));
  return { body: box.body, dialog: box.dialog.element, show, moveSun };
};
