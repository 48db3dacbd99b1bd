// The option that places a proposal in the shell as the page does.

import { isMoved, turnPlan } from "./moved.js";
import { makeBoxes, widen } from "./boxes.js";

/**
 * The middle of a layer's plan as packed, turned about the origin first, local [m].
 * @param {App} app @param {string} layer @param {number} turn [degrees]
 */
const findMiddle = ({ model, proposal }, layer, turn) => {
  const { faces, facePart, parts } = model,
    places = proposal.packed ?? model.places,
    box = makeBoxes(1),
    at = new Float64Array(3);
  facePart.forEach((part, f) => {
    if (parts[part].layer !== layer) return;
    for (let k = 0; k < 3; k++) {
      const vertex = 3 * faces[3 * f + k];
      [at[0], at[1]] = turnPlan(places[vertex], places[vertex + 1], turn);
      widen(box, 0, at, 0);
    }
  });
  return [(box[0] + box[3]) / 2, (box[1] + box[4]) / 2];
};

/** @param {number} value @param {number} digits */
const show = (value, digits) => String(Number(value.toFixed(digits)) || 0);

/**
 * Write `--move LAYER=DX,DY[,DZ][,TURN]` for a layer of the proposal: all of its move, with the one
 * with which the page was made, as an option that is given again replaces it.
 * @param {App} app @param {string} layer
 */
const writeOption = (app, layer) => {
  const { move } = app.state,
    [x0, y0, z0, turn0] = app.config.moves[layer] ?? [0, 0, 0, 0];
  const [cx, cy] = app.proposal.foot;
  // Both turn about middles of their own: the layer's before any move, and the proposal's.
  const back = findMiddle(app, layer, -turn0),
    there = turnPlan(back[0], back[1], turn0);
  const turned = turnPlan(there[0] - cx, there[1] - cy, move.turn);
  const dx = cx + turned[0] + move.dx - (there[0] - x0),
    dy = cy + turned[1] + move.dy - (there[1] - y0),
    turn = (((turn0 + move.turn + 180) % 360) + 360) % 360 - 180;
  const numbers = [show(dx, 3), show(dy, 3)];
  if (z0 || turn) numbers.push(z0 ? show(z0, 3) : "");
  if (turn) numbers.push(show(turn, 2));
  const words = `${layer}=${numbers.join(",")}`;
  return `--move ${/^[\w.,=/+-]+$/.test(words) ? words : `'${words.replaceAll("'", "'\\''")}'`}`;
};

/**
 * The option, or why there is none.
 * @param {App} app
 */
export const tellOption = (app) => {
  const { state, things } = app;
  if (!isMoved(state.move)) return { words: "", why: "Drag the handle in the picture, or type." };
  const isProposed = (/** @type {number} */ k) => state.standing.get(k) === "proposed";
  const layers = [...new Set(things.flatMap(({ layer }, k) => (isProposed(k) ? [layer] : [])))];
  const shared = layers.find((layer) => things.some((thing, k) => thing.layer === layer && !isProposed(k)));
  if (shared !== undefined || layers.includes("")) {
    const why = "The shell moves whole layers: give the proposal a file of its own, new=FILE, to copy its option.";
    return { words: "", why };
  }
  return { words: layers.map((layer) => writeOption(app, layer)).join(" "), why: "In the shell:" };
};
