// What one takes away: a link, a file of the view, a picture.

import { KEYS } from "./orbit.js";
import { button, choice, el, fill, fold } from "./dom.js";
import { fromLink, toLink } from "./state.js";

/** @param {Blob} blob @param {string} name */
const download = (blob, name) => {
  const link = el("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
};

/** @param {App} app */
export const makeShare = (app) => {
  const said = el("p", { class: "quiet", role: "status" });
  const tell = (/** @type {string} */ words) => fill(said, words);
  const stem = app.config.name.replace(/[^\p{L}\p{N}._-]+/gu, "_").slice(0, 80) || "scene";
  const copy = async () => {
    const link = `${location.href.split("#")[0]}#${toLink(app.state, app.model.origin)}`;
    try {
      await navigator.clipboard.writeText(link);
      tell("The link is copied; it opens this file with this view.");
    } catch {
      fill(
        said,
        "Copy this link: ",
        el("input", {
          readonly: true,
          value: link,
          "aria-label": "Link to this view",
          class: "wide",
        }),
      );
      said.querySelector("input")?.select();
    }
  };
  const save = () => {
    const text = JSON.stringify(app.describe(), null, 2);
    download(new Blob([text, "\n"], { type: "application/json" }), `${stem}.view.json`);
    tell("Open it here, or with umbra view --view.");
  };
  const shoot = async () => {
    download(await app.shoot(Number(size.value)), `${stem}.png`);
    tell("The picture is saved.");
  };
  const size = choice(
    "Size of the picture",
    [1, 2, 3, 4].map((times) => /** @type {[string, string]} */ ([String(times), `${times}×`])),
    () => {},
  );
  size.value = "2";
  const file = el("input", {
    type: "file",
    accept: ".json,application/json",
    class: "hidden",
    "aria-label": "File of a view",
    tabindex: -1,
    onchange: async () => {
      try {
        const given = JSON.parse(await /** @type {File} */ (file.files?.[0]).text());
        const { model, things } = app;
        if (typeof given.page !== "string") throw new Error("it was not saved here");
        const state = fromLink(given.page, model.origin, things.length, model.parts.length);
        app.set(state);
        if (state.viewpoint) app.orbit.set(state.viewpoint);
        tell("The view is open.");
      } catch (error) {
        tell(`This is no view of this page: ${error instanceof Error ? error.message : error}.`);
      }
      file.value = "";
    },
  });
  const keys = fold(
    "Mouse, fingers and keys",
    el(
      "p",
      { class: "quiet" },
      "Drag turns about what is under the pointer; the right button, or Shift, moves; the wheel " +
        `${app.config.takesWheel ? "" : "with Ctrl, or after a click in the picture, "}zooms ` +
        "toward the pointer; a double click goes there. " +
        "One finger turns; two move, spread and twist.",
    ),
    el(
      "dl",
      { class: "keys" },
      ...KEYS.map(([key, words]) => el("div", {}, el("dt", {}, key), el("dd", {}, words))),
    ),
  );
  const element = fold(
    "Share and save",
    el(
      "div",
      { class: "line" },
      app.config.hasLink && button("Copy link", copy),
      el("span", { class: "pair" }, button("Picture (PNG)", shoot), size),
      button("Save view", save),
      button("Open view", () => file.click()),
      file,
    ),
    said,
  );
  return { element, keys, update: () => {} };
};
