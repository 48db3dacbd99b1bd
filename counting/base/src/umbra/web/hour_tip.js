// The hours of sun under the pointer.

import { el } from "./dom.js";
import { tellHours } from "./place_panel.js";

/**
 * @param {App} app
 * @param {HTMLElement} canvas
 */
export const makeHourTip = (app, canvas) => {
  const element = el("p", { class: "tip", "aria-hidden": "true" });
  element.hidden = true;
  let waits = 0;
  const hide = () => {
    cancelAnimationFrame(waits);
    element.hidden = true;
  };
  canvas.addEventListener("pointermove", ({ offsetX: x, offsetY: y, buttons, pointerType }) => {
    if (!app.state.hasSunHours || buttons || pointerType === "touch") return hide();
    cancelAnimationFrame(waits);
    waits = requestAnimationFrame(() => {
      const hours = app.sunHours.read(x, y);
      element.hidden = hours === null;
      if (hours === null) return;
      element.textContent = `${app.sunHours.isWhole ? "" : "about "}${tellHours(hours)} of sun`;
      const { wide } = app.stage.size;
      element.style.left = `${Math.min(x + 14, wide - element.offsetWidth - 4)}px`;
      element.style.top = `${Math.max(y - 34, 4)}px`;
    });
  });
  canvas.addEventListener("pointerleave", hide);
  canvas.addEventListener("pointerdown", hide);
  return element;
};
