// The proposal's move in numbers, typed or dragged: undone, reset, and copied for the shell.

import { button, el, fill, fold } from "./dom.js";
import { makeHandles } from "./move_handles.js";
import { isMoved, NOWHERE } from "./moved.js";
import { tellOption } from "./move_option.js";
import { FARTHEST } from "./state.js";

/** @typedef {import('./moved.js').Move} Move */

const SOON = 1000; // changes of one kind within it are one step of the way back [ms]

/** @param {number} value @param {number} digits */
const show = (value, digits) => String(Number(value.toFixed(digits)));

/** @param {App} app */
export const makeMove = (app) => {
  const { proposal, model } = app;
  /** @type {Move[]} what Undo goes back to */
  const past = [];
  let last = { kind: "", at: 0 };

  /**
   * Move the proposal, with a place that was chosen on it.
   * @param {Move} move
   */
  const put = (move) => {
    const { place, move: was } = app.state;
    const isOn = place && place.part >= 0 && app.state.standing.get(app.thingOf[place.part]) === "proposed";
    const position = isOn && proposal.carry(place.position, was, move);
    app.set(position ? { move, place: { ...place, position } } : { move });
  };
  /**
   * Move it so that Undo brings it back; changes of one kind that follow each other go together.
   * @param {Move} move @param {string} kind
   */
  const change = (move, kind) => {
    const { move: was } = app.state,
      now = performance.now();
    if (!(Math.hypot(move.dx, move.dy) <= FARTHEST)) return;
    if (move.dx === was.dx && move.dy === was.dy && move.turn === was.turn) return;
    if (kind !== last.kind || now - last.at > SOON) past.push(was);
    last = { kind, at: now };
    put(move);
  };
  const undo = () => {
    const was = past.pop();
    last = { kind: "", at: 0 };
    if (was) put(was);
  };
  const turnTo = (/** @type {number} */ turn) => Number(((((turn % 360) + 540) % 360) - 180).toFixed(3)) || 0;

  /**
   * @param {string} words @param {string} unit
   * @param {(move: Move) => number} read @param {(move: Move, value: number) => Move} write
   */
  const makeField = (words, unit, read, write) => {
    const input = el("input", {
      type: "text", class: "typed", inputmode: "decimal", autocomplete: "off",
      onchange: () => {
        const value = Number(input.value.trim().replace(",", ".").replace("−", "-"));
        if (input.value.trim() && Number.isFinite(value)) change(write(app.state.move, value), "");
        update(app.state);
      },
    });
    const label = el("label", { class: "number" }, el("span", {}, words), input, unit);
    return { input, label, read };
  };
  const at = (/** @type {0 | 1} */ axis) => proposal.foot[axis] + model.origin[axis];
  const fields = [
    makeField("East", "m", (move) => move.dx, (move, dx) => ({ ...move, dx })),
    makeField("North", "m", (move) => move.dy, (move, dy) => ({ ...move, dy })),
    makeField("x", "m", (move) => at(0) + move.dx, (move, x) => ({ ...move, dx: x - at(0) })),
    makeField("y", "m", (move) => at(1) + move.dy, (move, y) => ({ ...move, dy: y - at(1) })),
    makeField("Turn", "°", (move) => move.turn, (move, turn) => ({ ...move, turn: turnTo(turn) })),
  ];
  const crs = app.config.crs ?? "the model's own coordinates";
  const back = button("Undo", undo),
    home = button("Reset", () => change(NOWHERE, ""));
  const option = el("code", { class: "option" });
  const said = el("span", { class: "quiet", role: "status" });
  const copy = button("Copy", async () => {
    const words = option.textContent ?? "";
    try {
      await navigator.clipboard.writeText(words);
      fill(said, "The option is copied.");
    } catch {
      getSelection()?.selectAllChildren(option);
      fill(said, "Copy what is marked.");
    }
  });
  const hint = el("p", { class: "quiet" });
  const element = fold(
    "Move the proposal",
    el("div", { class: "numbers" }, ...fields.map(({ label }) => label)),
    el("p", { class: "quiet" }, `East and north of the plan, from where it was; clockwise; x and y of its middle in ${crs}.`),
    el("div", { class: "line" }, back, home),
    hint,
    el("div", { class: "line" }, option, copy),
    said,
  );
  const handles = makeHandles(app, { change, turnTo, undo });
  element.addEventListener("keydown", (event) => {
    if (event.key !== "z" || !(event.ctrlKey || event.metaKey) || event.target instanceof HTMLInputElement) return;
    event.preventDefault();
    undo();
  });

  /** @type {unknown} */
  let drawn = null;
  /** @param {State} state */
  const update = (state) => {
    element.hidden = !proposal.parts;
    handles.update(state);
    if (element.hidden) return;
    for (const { input, read } of fields) {
      if (document.activeElement !== input || drawn !== state.move)
        input.value = show(read(state.move), input === fields[4].input ? 2 : 3);
    }
    if (drawn === state.move && element.dataset.key === String(app.revision)) return;
    drawn = state.move;
    element.dataset.key = String(app.revision);
    const { words, why } = tellOption(app);
    back.disabled = !past.length;
    home.disabled = !isMoved(state.move);
    fill(option, words);
    option.hidden = copy.hidden = !words;
    const isStale = app.config.hours && isMoved(state.move);
    fill(hint, `${isStale ? "Hours of the study are of where it was, and not shown. " : ""}${why}`);
    fill(said);
  };
  return { element, handles: handles.element, update };
};
