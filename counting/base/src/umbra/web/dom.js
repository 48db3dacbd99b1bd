// Elements made from names, attributes and text. Text is never read as HTML: names come from files.

/**
 * @typedef {Node | string | number | null | false | undefined} Child
 */

/**
 * Make an element. Attributes named ``on...`` listen; true and false set or leave out.
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag
 * @param {Record<string, unknown>} [attributes]
 * @param {...Child} children
 * @returns {HTMLElementTagNameMap[T]}
 */
export const el = (tag, attributes = {}, ...children) => {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on"))
      made.addEventListener(name.slice(2), /** @type {EventListener} */ (value));
    else made.setAttribute(name, value === true ? "" : String(value));
  }
  fill(made, ...children);
  return made;
};

/**
 * Replace what an element holds.
 * @param {Element} element
 * @param {...Child} children
 */
export const fill = (element, ...children) => {
  const shown = children.filter(
    (child) => child !== null && child !== false && child !== undefined,
  );
  element.replaceChildren(...shown.map((child) => (child instanceof Node ? child : String(child))));
};

/**
 * A button that acts on a click.
 * @param {Child} words
 * @param {() => void} act
 * @param {Record<string, unknown>} [attributes]
 */
export const button = (words, act, attributes = {}) =>
  el("button", { type: "button", onclick: act, ...attributes }, words);

/**
 * A choice of one of some values, each with its words.
 * @param {string} label
 * @param {readonly (readonly [string, string])[]} options
 * @param {(value: string) => void} act
 */
export const choice = (label, options, act) => {
  const select = el(
    "select",
    { "aria-label": label, onchange: () => act(select.value) },
    ...options.map(([value, words]) => el("option", { value }, words)),
  );
  return select;
};

/**
 * A part of the panel that folds.
 * @param {string} title
 * @param {...Child} children
 */
export const fold = (title, ...children) =>
  el("details", {}, el("summary", {}, title), ...children);

const PATHS = {
  play: "M5 3l11 7-11 7z",
  pause: "M5 3h4v14H5zM11 3h4v14h-4z",
  plus: "M9 4h2v5h5v2h-5v5H9v-5H4V9h5z",
  minus: "M4 9h12v2H4z",
  home: "M10 3l8 7h-2.5v7h-4v-5h-3v5h-4v-7H2z",
  above: "M10 2l8 4.5v7L10 18l-8-4.5v-7zM10 4.3L4.2 7.5 10 10.8l5.8-3.3z",
  sun: "M10 6a4 4 0 1 0 .01 0zM9.2 1h1.6v3H9.2zM9.2 16h1.6v3H9.2zM1 9.2h3v1.6H1zM16 9.2h3v1.6h-3zM3 4.1L4.1 3l2.2 2.2-1.1 1.1zM13.7 14.8l1.1-1.1 2.2 2.2-1.1 1.1zM3 15.9l2.2-2.2 1.1 1.1L4.1 17zM13.7 5.2L15.9 3 17 4.1l-2.2 2.2z",
  move: "M10 1l3 4h-2v4h4V7l4 3-4 3v-2h-4v4h2l-3 4-3-4h2v-4H5v2l-4-3 4-3v2h4V5H7z",
  turn: "M10 4V1l5 4-5 4V6a5 5 0 1 0 5 5h2a7 7 0 1 1-7-7z",
  needle: "M10 1l4.2 9H5.8z",
  tail: "M10 19l4.2-9H5.8z",
};

/**
 * Draw a small picture for a button, hidden from screen readers.
 * @param {...keyof typeof PATHS} names one shape each
 */
export const icon = (...names) => {
  const space = "http://www.w3.org/2000/svg",
    svg = document.createElementNS(space, "svg");
  svg.setAttribute("viewBox", "0 0 20 20");
  svg.setAttribute("aria-hidden", "true");
  for (const name of names) {
    const path = document.createElementNS(space, "path");
    path.setAttribute("d", PATHS[name]);
    path.setAttribute("class", `icon-${name}`);
    svg.append(path);
  }
  return svg;
};

/**
 * A slider with its label above.
 * @param {string} label
 * @param {{min: number, max: number, step: number | "any", value: number}} range
 * @param {(value: number) => void} act
 * @param {(value: number) => string} tell what the value means, for screen readers
 */
export const slider = (label, range, act, tell) => {
  const input = el("input", {
    type: "range",
    ...range,
    "aria-label": label,
    "aria-valuetext": tell(range.value),
    oninput: () => act(Number(input.value)),
  });
  const set = (/** @type {number} */ value) => {
    input.value = String(value);
    input.setAttribute("aria-valuetext", tell(value));
  };
  return { input, set };
};
