// Which keys are the picture's while something else has the focus.

const SLIDERS = "input[type=range], [role=slider]";
const TYPED = "input:not([type=range], [type=checkbox], [type=radio], [type=file])";

/**
 * Whether a key that was pressed elsewhere is a shortcut of the picture: what has the focus keeps its own.
 * @param {KeyboardEvent} event
 * @param {HTMLElement} root of the page
 */
export const isShortcut = ({ target, key, defaultPrevented }, root) => {
  const from = /** @type {Element} */ (target);
  if (defaultPrevented || key === "Tab") return false;
  if (from.closest("dialog, textarea, select") || from.matches(TYPED)) return false;
  if (from === document.body || from === root) return true;
  return !/^(Arrow|Page|Home|End|Enter)/.test(key) && (key !== " " || from.matches(SLIDERS));
};
