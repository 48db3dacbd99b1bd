// Hours of a study, a section through the model, measured distances, and what is drawn besides.

import { button, choice, el, fill, fold, slider } from "./dom.js";
import { tellLength } from "./signs.js";
import { AXES } from "./state.js";
import { measure } from "./vectors.js";

/**
 * @param {App} app
 * @param {'hasPath' | 'hasCompass' | 'hasHours' | 'hasEdges'} name
 * @param {string} words
 */
const makeSwitch = (app, name, words) => {
  const input = el("input", {
    type: "checkbox",
    onchange: () => app.set({ [name]: input.checked }),
  });
  return { input, name, label: el("label", { class: "switch" }, input, words) };
};

/**
 * The hours of a study, with the key of their colours.
 * @param {App} app
 */
export const makeHours = (app) => {
  const { hours, palette } = app.config;
  if (!hours) return null;
  const toggle = makeSwitch(app, "hasHours", hours.title);
  const ramp = el("div", { class: "ramp", "aria-hidden": "true" });
  const stops = palette.ramp.map(([r, g, b]) => `rgb(${r},${g},${b})`);
  const dark = el("i", { "aria-hidden": "true" });
  dark.style.background = `rgb(${palette.noSun})`;
  ramp.style.background = `linear-gradient(to ${hours.isSun ? "left" : "right"}, ${stops.join(", ")})`;
  const ticks = [0, 0.25, 0.5, 0.75, 1].map((share) =>
    el("span", {}, Number((share * hours.most).toFixed(1))),
  );
  const element = fold(
    "Hours of the study",
    toggle.label,
    el(
      "figure",
      { class: "scale", "aria-label": `${hours.title}, from 0 to ${hours.most.toFixed(1)} hours` },
      ramp,
      el("div", { class: "ticks", "aria-hidden": "true" }, ...ticks),
      el("p", { class: "no-sun" }, dark, "no sun"),
    ),
    el("p", { class: "quiet" }, hours.note),
  );
  element.open = true;
  return {
    element,
    update: (/** @type {State} */ state) => {
      toggle.input.checked = state.hasHours;
    },
  };
};

/**
 * Sun path, compass and edges.
 * @param {App} app
 */
export const makeDrawn = (app) => {
  const switches = [
    makeSwitch(app, "hasPath", "Sun's path and hours"),
    makeSwitch(app, "hasCompass", "Compass on the ground"),
    makeSwitch(app, "hasEdges", "Edges of the model"),
  ];
  const element = fold("What is drawn", ...switches.map((control) => control.label));
  const update = (/** @type {State} */ state) => {
    for (const { input, name } of switches) input.checked = state[name];
  };
  return { element, update };
};

/**
 * The plane of a section, with a x + b y + c z + d >= 0 where the model stays.
 * @param {App} app @param {State} state @returns {[number, number, number, number] | null}
 */
export const findPlane = (app, state) => {
  const { section } = state;
  if (!section) return null;
  const { normal, low, high } = findExtent(app, section.axis);
  const at = low + (high - low) * section.at,
    sign = section.flipped ? 1 : -1;
  return [sign * normal[0], sign * normal[1], sign * normal[2], -sign * at];
};

/** @param {App} app @param {import('./state.js').Section['axis']} axis */
const findExtent = (app, axis) => {
  const turn = (app.north * Math.PI) / 180,
    [s, c] = [Math.sin(turn), Math.cos(turn)];
  const normal = /** @type {Vec3} */ (
    { level: [0, 0, 1], north: [s, c, 0], east: [c, -s, 0] }[axis]
  );
  let low = Infinity,
    high = -Infinity;
  for (let k = 0; k < 8; k++) {
    const sum = [0, 1, 2].reduce(
      (total, i) => total + normal[i] * app.model.bounds[(k >> i) & 1][i],
      0,
    );
    [low, high] = [Math.min(low, sum), Math.max(high, sum)];
  }
  return { normal, low, high };
};

/** @param {App} app */
export const makeSection = (app) => {
  const names = {
    "": "None",
    level: "Level, a floor plan",
    north: "Across, west to east",
    east: "Along, south to north",
  };
  const select = choice("Section", Object.entries(names), (value) => {
    const axis = AXES.find((name) => name === value);
    const { at, flipped } = app.state.section ?? { at: 0.5, flipped: false };
    app.set({ section: axis ? { axis, at, flipped } : null });
    face();
  });
  /** Turn the view to the cut; a level one from above, unless what is above it stays. */
  const face = () => {
    const { section } = app.state;
    if (!section || (section.axis === "level" && section.flipped)) return;
    const side = (section.axis === "north" ? 180 : -90) + (section.flipped ? 180 : 0);
    if (section.axis === "level") app.orbit.look(app.north, -89.9);
    else app.orbit.look(app.north + side, -12);
  };
  const change = (/** @type {Partial<import('./state.js').Section>} */ changes) => {
    if (app.state.section) app.set({ section: { ...app.state.section, ...changes } });
  };
  const tell = (/** @type {number} */ at) => {
    const { section } = app.state;
    if (!section) return "";
    const { low, high } = findExtent(app, section.axis),
      metres = at * (high - low);
    return section.axis === "level"
      ? `${metres.toFixed(1)} m above the lowest point`
      : `${metres.toFixed(1)} m from the ${section.axis === "north" ? "south" : "west"}`;
  };
  const where = slider(
    "Position of the section",
    { min: 0, max: 1, step: 0.002, value: 0.5 },
    (at) => change({ at }),
    tell,
  );
  const flip = button("Other side", () => {
    change({ flipped: !app.state.section?.flipped });
    face();
  });
  const note = el("span", { class: "quiet" });
  const more = el("div", { class: "line" }, where.input, flip);
  const element = fold("Section", el("div", { class: "line" }, select), more, note);
  const update = (/** @type {State} */ { section }) => {
    select.value = section?.axis ?? "";
    more.hidden = !section;
    fill(note, section ? `${tell(section.at)}. What is cut away still casts its shadow.` : "");
    if (section) where.set(section.at);
  };
  return { element, update };
};

/** @param {App} app */
export const makeMeasure = (app) => {
  const toggle = button("Measure a distance", () =>
    app.set({ tool: app.state.tool === "measure" ? "choose" : "measure", begun: null }),
  );
  const list = el("ul", { class: "things" }),
    hint = el("p", { class: "quiet", role: "status" });
  const element = fold("Distances", toggle, hint, list);
  const update = (/** @type {State} */ { tool, begun, distances }) => {
    toggle.setAttribute("aria-pressed", String(tool === "measure"));
    fill(
      hint,
      tool !== "measure"
        ? ""
        : begun
          ? "Now the other end."
          : "Click or tap the first end, or press Enter for the place in the middle.",
    );
    if (
      list.childElementCount === distances.length &&
      list.dataset.last === String(distances[distances.length - 1])
    )
      return;
    list.dataset.last = String(distances[distances.length - 1]);
    fill(
      list,
      ...distances.map(([from, to], k) =>
        el(
          "li",
          {},
          el(
            "span",
            { class: "label" },
            tellLength(measure(from, to)),
            el(
              "small",
              {},
              `level ${tellLength(Math.hypot(to[0] - from[0], to[1] - from[1]))}, height ${tellLength(Math.abs(to[2] - from[2]))}`,
            ),
          ),
          button(
            "Remove",
            () => app.set({ distances: distances.filter((_, other) => other !== k) }),
            { "aria-label": `Remove distance ${k + 1}` },
          ),
        ),
      ),
    );
  };
  return { element, update };
};
