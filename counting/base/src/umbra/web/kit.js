// What a study's report takes from here: its model, drawn and read, and the live model.

export { mount } from "./mount.js";
export { unpackModel } from "./model.js";
export { decode, inflate, unpack } from "./packed.js";
export { Patches, packColor } from "./patches.js";
export { Renderer } from "./renderer.js";
export { makeModelSky } from "./sky_box.js";
