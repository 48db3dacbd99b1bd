// A whole page of one model, which lies in the page as text.

import { mount } from "./mount.js";
import { decode } from "./packed.js";

/** @param {string} id */
const read = (id) => document.getElementById(id)?.textContent ?? "";

/** Show the page's model in its element; the page says when it has been drawn. */
export const show = async () => {
  const root = document.getElementById("umbra");
  if (!root) throw new Error("the page has no place for the model");
  const app = await mount(root, decode(read("block")), JSON.parse(read("config")));
  document.documentElement.dataset.ready = app ? "yes" : "no";
  return app;
};
