// Handles of the proposal in the picture: one moves it on the ground, one turns it.

import { button, el, icon } from "./dom.js";
import { NOWHERE } from "./moved.js";
import { measure, move as shift } from "./vectors.js";
import { findRay, project } from "./viewpoint.js";

/** @typedef {import('./moved.js').Move} Move */

const APART = 64; // of both handles, at least [pixels]
const BELOW = 26; // from the proposal's lowest corner in the picture to the handle that moves it [pixels]
const RIM = 26; // from a handle's middle to the picture's border [pixels]
const FAR = 30; // of a place that is dragged, in sizes of the model
const KEYS = /** @type {Record<string, [number, number]>} */ ({
  ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
});

/** @param {number} value @param {number} step */
const toStep = (value, step) => Number((Math.round(value / step) * step).toFixed(3));

/**
 * @param {App} app
 * @param {{change: (move: Move, kind: string) => void, turnTo: (turn: number) => number, undo: () => void}} acts
 */
export const makeHandles = (app, { change, turnTo, undo }) => {
  const { proposal } = app;
  const grip = button(icon("move"), () => {}, {
    class: "grip",
    "aria-label": "Move the proposal: drag, or arrow keys by 1 m, with Shift by 0.1 m",
    title: "Move the proposal",
  });
  const knob = button(icon("turn"), () => {}, {
    class: "grip knob",
    "aria-label": "Turn the proposal: drag, or arrow keys by 5 degrees, with Shift by half a degree",
    title: "Turn the proposal",
  });
  const arm = el("i", { class: "arm" });
  const element = el("div", { class: "handles", role: "group", "aria-label": "Place of the proposal" }, arm, grip, knob);

  /** The part of the picture that shows the proposal [pixels]. */
  const findPicture = () => {
    const { wide, high } = app.stage.size,
      isBeside = app.state.compare === "beside";
    return { left: isBeside ? wide / 2 : 0, wide: isBeside ? wide / 2 : wide, high };
  };
  /** Where the proposal is held now, local [m]. */
  const findFoot = () => proposal.carry(proposal.foot, NOWHERE, app.state.move);
  /**
   * The place of its ground under the pointer; null above the horizon and too far away.
   * @param {PointerEvent} event
   */
  const findGround = (event) => {
    const box = app.stage.canvas.getBoundingClientRect(),
      { left, wide, high } = findPicture();
    const x = (2 * (event.clientX - box.left - left)) / wide - 1,
      y = 1 - (2 * (event.clientY - box.top)) / high;
    const { from, towards } = findRay(app.state.viewpoint, x, y, wide / high),
      foot = proposal.foot;
    const t = (foot[2] - from[2]) / towards[2],
      point = shift(from, towards, t);
    return t > 0 && measure(point, foot) < FAR * measure(...app.model.bounds) ? point : null;
  };
  /**
   * @param {HTMLElement} handle
   * @param {(start: Move, from: Vec3, to: Vec3, event: PointerEvent) => Move} act
   */
  const drag = (handle, act) => {
    /** @type {{from: Vec3, move: Move, kind: string} | null} */
    let held = null;
    handle.addEventListener("pointerdown", (event) => {
      const from = findGround(event);
      if (!from) return;
      handle.setPointerCapture(event.pointerId);
      held = { from, move: app.state.move, kind: `drag ${event.timeStamp}` };
    });
    handle.addEventListener("pointermove", (event) => {
      const to = held && handle.hasPointerCapture(event.pointerId) && findGround(event);
      if (held && to) change(act(held.move, held.from, to, event), held.kind);
    });
    for (const end of ["pointerup", "pointercancel"]) handle.addEventListener(end, () => (held = null));
  };
  drag(grip, (move, from, to) => ({
    ...move,
    dx: toStep(move.dx + to[0] - from[0], 0.01),
    dy: toStep(move.dy + to[1] - from[1], 0.01),
  }));
  drag(knob, (move, from, to, { shiftKey }) => {
    const [x, y] = findFoot(),
      angle = (/** @type {Vec3} */ at) => (Math.atan2(at[0] - x, at[1] - y) * 180) / Math.PI;
    return { ...move, turn: turnTo(toStep(move.turn + angle(to) - angle(from), shiftKey ? 15 : 0.1)) };
  });
  /** @param {HTMLElement} handle @param {(move: Move, way: [number, number], share: number) => Move} act */
  const listen = (handle, act) =>
    handle.addEventListener("keydown", (event) => {
      const way = KEYS[event.key],
        isBack = event.key === "z" && (event.ctrlKey || event.metaKey);
      if (!isBack && (!way || event.altKey || event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      event.stopPropagation();
      if (isBack) undo();
      else change(act(app.state.move, way, event.shiftKey ? 0.1 : 1), "keys");
    });
  listen(grip, (move, [x, y], share) => ({
    ...move, dx: toStep(move.dx + x * share, 0.001), dy: toStep(move.dy + y * share, 0.001),
  }));
  listen(knob, (move, [x, y], share) => ({ ...move, turn: turnTo(toStep(move.turn + 5 * (x + y) * share, 0.001)) }));

  /** @param {State} state */
  const update = (state) => {
    const { left, wide, high } = findPicture(),
      foot = findFoot(),
      [low, top] = proposal.box;
    const at = proposal.parts && state.compare !== "before" ? project(state.viewpoint, foot, wide, high) : null;
    element.hidden = !at || at.x < 0 || at.y < 0 || at.x > wide || at.y > high;
    if (!at || element.hidden) return;
    // Below the proposal, which stays seen.
    const corners = Array.from({ length: 8 }, (_, k) => {
      const corner = /** @type {Vec3} */ ([0, 1, 2].map((axis) => (k >> axis) & 1 ? top[axis] : low[axis]));
      return project(state.viewpoint, proposal.carry(corner, NOWHERE, state.move), wide, high)?.y ?? at.y;
    });
    const reach = 0.6 * Math.hypot(top[0] - low[0], top[1] - low[1]) + 1,
      angle = (state.move.turn * Math.PI) / 180;
    const end = /** @type {Vec3} */ ([foot[0] + reach * Math.sin(angle), foot[1] + reach * Math.cos(angle), foot[2]]);
    const there = project(state.viewpoint, end, wide, high);
    let [x, y] = there ? [there.x - at.x, there.y - at.y] : [0, -APART];
    const length = Math.hypot(x, y),
      longer = length < 1 ? 0 : Math.max(1, APART / length);
    [x, y] = longer ? [x * longer, y * longer] : [0, -APART];
    const inside = (/** @type {number} */ value, /** @type {number} */ most) => Math.max(RIM, Math.min(most - RIM, value));
    const to = { x: inside(at.x + x, wide), y: inside(at.y + y, high) };
    const under = { x: inside(at.x, wide), y: inside(Math.max(...corners) + BELOW, high) };
    for (const [handle, spot] of /** @type {[HTMLElement, {x: number, y: number}][]} */ ([[grip, under], [knob, to]])) {
      handle.style.left = `${left + spot.x}px`;
      handle.style.top = `${spot.y}px`;
    }
    arm.style.left = `${left + at.x}px`;
    arm.style.top = `${at.y}px`;
    arm.style.width = `${Math.hypot(to.x - at.x, to.y - at.y)}px`;
    arm.style.transform = `rotate(${Math.atan2(to.y - at.y, to.x - at.x)}rad)`;
  };
  return { element, update };
};
