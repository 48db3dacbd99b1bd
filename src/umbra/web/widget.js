// The live model in a notebook's cell: the page's app, its state shared with Python.

import { isDate, parseMinutes, tellMinutes } from "./clock.js";
import { mount } from "./mount.js";

/**
 * The part of a widget's model that is used here.
 * @typedef {object} Shared
 * @property {(name: string) => any} get
 * @property {(name: string, value: unknown) => void} set
 * @property {() => void} save_changes
 * @property {(event: string, act: () => void) => void} on
 * @property {(event: string, act: () => void) => void} off
 */

const DELAY = 120; // from a change to Python [ms]
const NAMES = ["date", "time", "azimuth", "altitude", "viewpoint"];

/** @param {number} value @param {number} digits */
const round = (value, digits) => Number(value.toFixed(digits));

/**
 * What Python reads of a state.
 * @param {App} app
 * @param {State} state
 */
const describe = (app, state) => {
  const own = (/** @type {Vec3} */ point) =>
    point.map((value, k) => round(value + app.model.origin[k], 3));
  const { viewpoint: view, place } = state,
    object = place && place.part >= 0 ? app.things[app.thingOf[place.part]] : null;
  return {
    date: state.date,
    time: tellMinutes(state.minutes),
    azimuth: round(app.sun.azimuth, 4),
    altitude: round(app.sun.altitude, 4),
    viewpoint: {
      target: own(view.target),
      heading: round(view.heading, 3),
      tilt: round(view.tilt, 3),
      distance: round(view.distance, 3),
      fov: round(view.fov, 3),
    },
    place: place && {
      position: own(place.position),
      object: object ? object.label : null,
      in_sun: app.isLit(true),
    },
  };
};

/**
 * Bring the page to what Python has set.
 * @param {App} app
 * @param {Shared} shared
 */
const follow = (app, shared) => {
  const described = describe(app, app.state);
  /** @type {Partial<State>} */
  const changes = {};
  const [date, time] = [shared.get("date"), parseMinutes(shared.get("time"))];
  if (date !== described.date && isDate(date)) changes.date = date;
  if (time !== null && shared.get("time") !== described.time) changes.minutes = time;
  if (!app.daylight.site) {
    for (const name of /** @type {const} */ (["azimuth", "altitude"])) {
      if (shared.get(name) !== described[name]) changes[name] = shared.get(name);
    }
  }
  if (Object.keys(changes).length) app.set({ ...changes, playing: null, share: 0 });
  const view = shared.get("viewpoint");
  if (
    view &&
    Array.isArray(view.target) &&
    JSON.stringify(view) !== JSON.stringify(described.viewpoint)
  ) {
    const target = /** @type {Vec3} */ (
      view.target.map((/** @type {number} */ v, /** @type {number} */ k) => v - app.model.origin[k])
    );
    app.orbit.set({ ...app.orbit.viewpoint, ...view, target });
  }
};

/**
 * Show the widget in a cell.
 * @param {{model: Shared, el: HTMLElement}} cell
 */
export const render = async ({ model: shared, el: cell }) => {
  const root = document.createElement("div");
  root.style.height = `${shared.get("height")}px`;
  cell.append(root);
  const block = shared.get("block");
  let timer = 0,
    isClosed = false;
  /** @type {App | null} */
  let app = null;
  const send = () => {
    timer = 0;
    if (!app || isClosed) return;
    for (const [name, value] of Object.entries(describe(app, app.state))) {
      if (JSON.stringify(shared.get(name)) !== JSON.stringify(value)) shared.set(name, value);
    }
    shared.save_changes();
  };
  const sendLater = () => {
    timer ||= setTimeout(send, DELAY);
  };
  app = await mount(
    root,
    new Uint8Array(block.buffer, block.byteOffset, block.byteLength),
    shared.get("config"),
    sendLater,
  );
  if (!app) return undefined;
  const shown = app,
    act = () => follow(shown, shared);
  act();
  for (const name of NAMES) shared.on(`change:${name}`, act);
  root.dataset.ready = "yes";
  return () => {
    isClosed = true;
    clearTimeout(timer);
    for (const name of NAMES) shared.off(`change:${name}`, act);
    shown.dispose();
  };
};
