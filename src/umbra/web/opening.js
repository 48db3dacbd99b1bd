// The view with which a page begins.

import { isDate } from "./clock.js";
import { fromLink } from "./state.js";

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
