// A model in an element of a page, or a picture of it where it cannot be drawn.

import { App } from "./app.js";
import { el, fill } from "./dom.js";
import { unpackModel } from "./model.js";
import { followTheme } from "./theme.js";

/**
 * Show a model in an element; without WebGL2 a picture of it.
 * @param {HTMLElement} root
 * @param {Uint8Array} block as umbra packs it
 * @param {Config} config
 * @param {(state: State) => void} [notify] after each change
 * @returns {Promise<App | null>}
 */
export const mount = async (root, block, config, notify) => {
  root.classList.add("umbra");
  const stop = followTheme(root);
  try {
    const app = new App(root, await unpackModel(block), config, notify);
    app.listening.signal.addEventListener("abort", stop);
    return app;
  } catch (error) {
    const words = error instanceof Error ? error.message : String(error);
    fill(
      root,
      el(
        "div",
        { class: "missing" },
        el("h1", {}, config.title),
        config.poster &&
          el("img", {
            src: config.poster,
            alt: `${config.title}: a picture of the model with its shadows`,
          }),
        el("p", { role: "alert" }, `The model cannot be moved in this browser: ${words}`),
      ),
    );
    return null;
  }
};
