// The model's objects: in both states, only after a change or only before it, or off.

import { choice, el, fill, fold } from "./dom.js";
import { COMPARE } from "./state.js";

/**
 * @typedef {object} Thing an object of the model, which may have several parts: walls, a roof
 * @property {string} label
 * @property {string} layer
 * @property {string[]} kinds
 * @property {number[]} parts
 */

const MOST = 100; // rows that are shown at once
const STANDINGS = /** @type {[Standing, string][]} */ ([
  ["on", "shown"],
  ["proposed", "proposed"],
  ["removed", "to be removed"],
  ["off", "off"],
]);
/**
 * A kind of CityGML or IFC in words: "WallSurface" is a wall, "IfcFlowTerminal" a flow terminal.
 * @param {string} kind
 */
const nameKind = (kind) =>
  kind
    .replace(/^Ifc(?=[A-Z])|Surface$/g, "")
    .replace(/[a-z](?=[A-Z])/g, "$& ")
    .toLowerCase();
const MODES = { after: "After", before: "Before", swipe: "Swipe", beside: "Side by side" };

/**
 * Join the parts of each object.
 * @param {Model} model @returns {Thing[]}
 */
export const listThings = (model) => {
  /** @type {Map<string, Thing>} */
  const things = new Map();
  model.parts.forEach(({ label, layer, kind }, part) => {
    const thing = things.get(label) ?? { label, layer, kinds: [], parts: [] };
    thing.parts.push(part);
    if (kind && !thing.kinds.includes(kind)) thing.kinds.push(kind);
    things.set(label, thing);
  });
  return [...things.values()];
};

/**
 * Which parts stand before or after a change; null: all.
 * @param {Thing[]} things
 * @param {Map<number, Standing>} standing
 * @param {boolean} isAfter
 * @param {number} partCount
 */
export const findShown = (things, standing, isAfter, partCount) => {
  if (!standing.size) return null;
  const shown = new Uint8Array(partCount).fill(1);
  for (const [object, where] of standing) {
    const stands =
      where === "on" || (where === "proposed" && isAfter) || (where === "removed" && !isAfter);
    if (!stands) for (const part of things[object].parts) shown[part] = 0;
  }
  return shown;
};

/**
 * Objects by their layers, in the order of the file.
 * @param {Thing[]} things
 * @param {number[]} objects
 * @returns {{layer: string, objects: number[]}[]}
 */
export const groupByLayer = (things, objects) => {
  /** @type {Map<string, number[]>} */
  const layers = new Map();
  for (const k of objects) {
    const own = layers.get(things[k].layer);
    if (own) own.push(k);
    else layers.set(things[k].layer, [k]);
  }
  return [...layers].map(([layer, own]) => ({ layer, objects: own }));
};

/** @param {number} count */
const tellCount = (count) => `${count.toLocaleString("en")} object${count === 1 ? "" : "s"}`;

/** @param {App} app */
export const makeParts = (app) => {
  const { things } = app,
    hasLayers = things.some((thing) => thing.layer),
    state = () => app.state;
  const list = el("ul", { class: "things", "aria-label": "Objects" });
  const count = el("p", { class: "quiet", role: "status" });
  let matches = things.map((_, k) => k);
  /** @type {Map<string, boolean>} layers that were folded or opened by hand */
  const folds = new Map();
  const put = (/** @type {number[]} */ objects, /** @type {Standing} */ where) => {
    const standing = new Map(state().standing);
    for (const object of objects) {
      if (where === "on") standing.delete(object);
      else standing.set(object, where);
    }
    app.set({ standing });
  };
  const choose = (
    /** @type {string} */ label,
    /** @type {Standing} */ value,
    /** @type {(where: Standing) => void} */ act,
  ) => {
    const select = choice(label, STANDINGS, (where) => act(/** @type {Standing} */ (where)));
    select.value = value;
    return select;
  };
  const filter = el("input", {
    type: "search",
    placeholder: "Find by name, kind or layer",
    "aria-label": "Find objects",
    oninput: () => {
      search();
      update(state(), true);
    },
  });
  const search = () => {
    const words = filter.value.trim().toLowerCase();
    matches = things.flatMap((thing, k) =>
      [thing.label, thing.layer, ...thing.kinds].some((text) => text.toLowerCase().includes(words))
        ? [k]
        : [],
    );
  };
  const setAll = choice("Set all found", [["", "Set all found…"], ...STANDINGS], (where) => {
    if (where) put(matches, /** @type {Standing} */ (where));
    setAll.value = "";
  });
  const modes = el(
    "fieldset",
    { class: "modes" },
    el("legend", { class: "hidden" }, "Before and after"),
    ...COMPARE.map((mode) =>
      el(
        "label",
        {},
        el("input", {
          type: "radio",
          name: `compare-${app.id}`,
          value: mode,
          onchange: () => app.set({ compare: mode }),
        }),
        el("span", {}, MODES[mode]),
      ),
    ),
  );
  const hint = el("p", { class: "quiet" });
  const element = fold(
    "Objects, before and after",
    modes,
    hint,
    el("div", { class: "line" }, filter, setAll),
    count,
    list,
  );
  element.addEventListener("toggle", () => update(state(), true));

  /** @type {Map<number, Standing> | null} */
  let drawn = null;
  /** @param {State} now @param {boolean} [again] */
  const update = (now, again = false) => {
    for (const input of modes.querySelectorAll("input"))
      input.checked = input.value === now.compare;
    const marks = [...now.standing.values()];
    const changes = marks.filter((standing) => standing === "proposed" || standing === "removed").length;
    fill(
      hint,
      changes
        ? `${changes === 1 ? "1 object differs" : `${changes} objects differ`} before and after.`
        : "Mark objects as proposed or to be removed, here or after a click on them, " +
          "to compare before and after.",
    );
    if (!element.open || (!again && drawn === now.standing)) return;
    drawn = now.standing;
    const row = (/** @type {number} */ k) => {
      const { label, kinds } = things[k],
        where = now.standing.get(k) ?? "on",
        about = kinds.slice(0, 3).map(nameKind).join(", ");
      return el(
        "li",
        { class: where },
        el("span", { class: "label" }, label || "(no name)", about && el("small", {}, about)),
        choose(`${label}: shown when`, where, (value) => put([k], value)),
      );
    };
    const layers = groupByLayer(things, matches);
    const isOpen = (/** @type {string} */ layer) =>
      !hasLayers || (folds.get(layer) ?? (layers.length === 1 || matches.length <= MOST));
    const turn = (/** @type {string} */ layer) => {
      folds.set(layer, !isOpen(layer));
      update(state(), true);
      list.querySelectorAll("button")[layers.findIndex((group) => group.layer === layer)]?.focus();
    };
    let left = MOST,
      listed = 0;
    fill(
      list,
      ...layers.flatMap(({ layer, objects }) => {
        const shown = isOpen(layer) ? objects.slice(0, left) : [];
        left -= shown.length;
        listed += isOpen(layer) ? objects.length : 0;
        return [
          hasLayers &&
            el(
              "li",
              { class: "layer" },
              el(
                "button",
                { type: "button", class: "label", "aria-expanded": String(isOpen(layer)), onclick: () => turn(layer) },
                layer || "(no layer)",
                el("small", {}, tellCount(objects.length)),
              ),
              choice(`Layer ${layer}: set all`, [["", "Set all…"], ...STANDINGS], (where) => {
                if (where) put(objects, /** @type {Standing} */ (where));
              }),
            ),
          ...shown.map(row),
        ];
      }),
    );
    fill(
      count,
      listed > MOST
        ? `${matches.length.toLocaleString("en")} objects; the first ${MOST} are listed`
        : tellCount(matches.length),
    );
  };
  return { element, update, choose, put };
};
