// The view with which a page begins.

import { isDate } from "./clock.js";
import { NOWHERE } from "./moved.js";
import { fromLink } from "./state.js";

/**
 * @typedef {object} Config
 * @property {string} name of the model, for files
 * @property {string} title
 * @property {string} subtitle
 * @property {Record<string, any>} view as umbra's window saves it, in the model's own coordinates
 * @property {boolean} isFramed whether the first view shows the whole model
 * @property {number | null} ground in the model's own coordinates [m]
 * @property {string | null} crs of the model's own coordinates
 * @property {Record<string, [number, number, number, number]>} moves of layers that `--move` moved:
 *   east, north, up [m], and clockwise about the middle of their plan [degrees]
 * @property {number[]} proposed parts of the proposal
 * @property {number[]} removed parts that it replaces
 * @property {string[]} notes
 * @property {import('./hours.js').Palette} palette of hours in shadow, and of no sun; sRGB 0 to 255
 * @property {Hours | null} hours
 * @property {boolean} hasLink whether the page's address keeps the view
 * @property {boolean} takesWheel whether the wheel zooms without Ctrl
 * @property {string} poster a picture for browsers without WebGL2
 */

/**
 * The link's view, else the one that was packed; a link's is not framed.
 * @param {App} app whose model and things are known
 * @returns {{state: State, isLinked: boolean}}
 */
export const findOpening = ({ config, model: { origin, parts }, thingOf, things }) => {
  const { view, proposed, removed, hasLink } = config;
  const given = view.viewpoint,
    target = /** @type {Vec3} */ (
      given.target.map((/** @type {number} */ v, /** @type {number} */ k) => v - origin[k])
    );
  /** @type {Map<number, Standing>} */
  const standing = new Map();
  for (const part of proposed) standing.set(thingOf[part], "proposed");
  for (const part of removed) standing.set(thingOf[part], "removed");
  const start = /** @type {State} */ ({
    viewpoint: { ...given, target },
    date: isDate(view.sun.date) ? view.sun.date : "2026-03-21",
    minutes: view.sun.minutes,
    share: 0,
    azimuth: view.sun.azimuth,
    altitude: view.sun.altitude,
    standing,
    move: NOWHERE,
    compare: standing.size ? "swipe" : "after",
    swipe: 0.5,
    place: null,
    tool: "choose",
    distances: [],
    begun: null,
    section: null,
    hasPath: true,
    hasCompass: true,
    hasHours: config.hours !== null,
    hasEdges: true,
    hasSunHours: false,
    interval: [540, 1020],
    playing: null,
  });
  const link = (hasLink && location.hash) || view.page || "";
  const linked = fromLink(link, origin, things.length, parts.length);
  return { state: { ...start, ...linked }, isLinked: linked.viewpoint !== undefined };
};
