// What both pages measure of their `draw`, which draws a frame in `gl` while the sun moves.

const DRAWS = ["drawArrays", "drawArraysInstanced", "drawElements", "clear", "blitFramebuffer"];
const pixel = new Uint8Array(4);

/** Draw some frames, each until its picture is there; return the time of one [ms]. */
globalThis.frames = (count, ...how) => {
  const begun = performance.now();
  for (let k = 0; k < count; k++) {
    draw(...how);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  }
  return (performance.now() - begun) / count;
};

/** Run the JavaScript of some frames, of which the card draws nothing. */
globalThis.script = (count, ...how) => {
  for (const name of DRAWS) gl[name] = () => {};
  for (let k = 0; k < count; k++) draw(...how);
  for (const name of DRAWS) delete gl[name];
};
