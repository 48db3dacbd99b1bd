// The frame: the picture with its buttons, the bar of time, the panel of tools.

import { button, el, fill, fold, icon } from "./dom.js";
import { makeHourTip } from "./hour_tip.js";

/**
 * @param {App} app
 * @param {Element[]} panels
 * @param {Element} keys
 */
export const makeFrame = (app, panels, keys) => {
  const { config, orbit, stage } = app;
  const sign = (
    /** @type {string} */ words,
    /** @type {Element} */ shape,
    /** @type {() => void} */ act,
  ) => button(shape, act, { "aria-label": words, title: words });
  const compass = sign("North up", icon("needle", "tail"), () =>
    orbit.look(app.north, app.state.viewpoint.tilt),
  );
  compass.classList.add("compass");
  const views = el(
    "div",
    { class: "views", role: "group", "aria-label": "View" },
    compass,
    sign("Nearer", icon("plus"), () => orbit.approach(1.4)),
    sign("Farther", icon("minus"), () => orbit.approach(1 / 1.4)),
    sign("The whole model", icon("home"), () => orbit.showAll()),
    sign("From above", icon("above"), () => orbit.look(app.north, -89.9)),
  );
  const sides = el(
    "div",
    { class: "sides", "aria-hidden": "true" },
    el("span", {}, "Before"),
    el("span", {}, "After"),
  );
  const title = el(
    "header",
    { class: "title" },
    el("h1", {}, config.title),
    config.subtitle && el("p", {}, config.subtitle),
  );
  const picture = el("main", { class: "picture" }, stage.canvas, stage.cover, sides);
  const swipe = makeSwipe(app, picture);
  picture.append(swipe, views, app.place.brief, app.sky.small, app.move.handles, makeHourTip(app, stage.canvas));
  const notes =
    app.notes.length > 0 &&
    fold(
      "Notes on the model",
      el("ul", { class: "notes" }, ...app.notes.map((note) => el("li", {}, note))),
    );
  const panel = el(
    "aside",
    { class: "panel", "aria-label": "Tools" },
    title,
    ...panels,
    keys,
    notes,
  );
  fill(app.root, el("div", { class: "frame" }, picture, app.timebar.element, panel), app.sky.dialog);

  /** @param {State} state */
  const update = (state) => {
    const isSwipe = state.compare === "swipe",
      isBeside = state.compare === "beside";
    swipe.hidden = !isSwipe;
    swipe.style.left = `${100 * state.swipe}%`;
    swipe.setAttribute("aria-valuenow", String(Math.round(100 * state.swipe)));
    sides.hidden = !isSwipe && !isBeside;
    sides.classList.toggle("beside", isBeside);
    sides.style.setProperty("--at", `${isSwipe ? 100 * state.swipe : 50}%`);
    picture.classList.toggle("measures", state.tool === "measure");
    compass.firstElementChild?.setAttribute(
      "transform",
      `rotate(${(app.north - state.viewpoint.heading).toFixed(1)})`,
    );
  };
  return { update };
};

/**
 * The line between before and after, which one drags or moves by keys.
 * @param {App} app
 * @param {HTMLElement} picture
 */
const makeSwipe = (app, picture) => {
  const handle = el("div", {
    class: "swipe",
    role: "slider",
    tabindex: 0,
    "aria-label": "Before and after",
    "aria-valuemin": 0,
    "aria-valuemax": 100,
    "aria-orientation": "horizontal",
  });
  const put = (/** @type {number} */ swipe) =>
    app.set({ swipe: Math.max(0.02, Math.min(0.98, swipe)) });
  handle.addEventListener("pointerdown", (event) => handle.setPointerCapture(event.pointerId));
  handle.addEventListener("pointermove", (event) => {
    if (!handle.hasPointerCapture(event.pointerId)) return;
    const box = picture.getBoundingClientRect();
    put((event.clientX - box.left) / box.width);
  });
  handle.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -0.02, ArrowRight: 0.02, PageDown: -0.1, PageUp: 0.1 }[event.key];
    if (by === undefined) return;
    event.preventDefault();
    put(app.state.swipe + by);
  });
  return handle;
};
