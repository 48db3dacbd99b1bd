// What is drawn and casts for one choice of parts: index lists on the card.

import { CREASE, SURFACE } from './shaders.js';
import { Shadows } from './shadows.js';
import { List } from './volumes.js';

/** @typedef {import('./device.js').Device} Device */
/** @typedef {import('./model.js').Model} Model */
/** @typedef {import('./volumes.js').Mask} Mask */

/**
 * What all selections of a model share.
 * @typedef {object} Shared
 * @property {Device} device
 * @property {Model} model
 * @property {Uint32Array} corners vertex of each corner of each face
 * @property {{lines: Uint32Array, part: Uint32Array}} creases
 * @property {WebGLBuffer | null} surface vertices with normals and colours
 * @property {number} stride bytes of each
 * @property {WebGLBuffer | null} doubled vertices, each with w = 1 and w = 0
 */

// Lists of faces are filled anew whenever a light moves: one pair serves all selections.
const fronts = new List();
const backs = new List();

/** Faces, lit faces and creases of the shown parts, and the shadows of the casting ones. */
export class Selection {
  /**
   * @param {Shared} shared
   * @param {Mask} cast
   * @param {Mask} show
   */
  constructor(shared, cast, show) {
    const { device, model, surface, stride, doubled } = shared;
    const { gl } = device;
    this.shared = shared;
    this.cast = cast && Array.from(cast);
    this.show = show && Array.from(show);
    this.shadows = new Shadows(device, model, doubled, cast, show);
    let { corners } = shared;
    const { lines, part } = shared.creases;
    let drawn = lines;
    if (show) {
      const shown = model.facePart.map((p) => (show[p] ? 1 : 0));
      corners = corners.filter((_, i) => shown[Math.floor(i / 3)]);
      drawn = lines.filter((_, i) => show[part[i >> 1]]);
    }
    /** @type {Record<string, [WebGLBuffer | null, number, number, number, number]>} */
    const attributes = {
      place: [surface, 3, gl.FLOAT, stride, 0],
      normal: [surface, 3, gl.SHORT, stride, 12],
      color: [surface, 4, gl.UNSIGNED_BYTE, stride, 20],
    };
    this.faces = device.makeBuffer(corners, gl.ELEMENT_ARRAY_BUFFER);
    this.count = corners.length;
    this.all = device.makeArray(SURFACE, attributes, this.faces);
    this.litFaces = gl.createBuffer();
    /** Numbers of indices of faces lit at their fronts, then of those lit at their backs. */
    this.front = 0;
    this.back = 0;
    this.lit = device.makeArray(SURFACE, attributes, this.litFaces);
    this.creaseLines = device.makeBuffer(drawn, gl.ELEMENT_ARRAY_BUFFER);
    this.creaseCount = drawn.length;
    this.creases = device.makeArray(
      CREASE,
      { place: [doubled, 4, gl.FLOAT, 16, 0] },
      this.creaseLines,
    );
  }

  /**
   * Whether this is the selection of two masks.
   * @param {Mask} cast
   * @param {Mask} show
   */
  isOf(cast, show) {
    return isSame(this.cast, cast) && isSame(this.show, show);
  }

  /**
   * List the shown faces that the light shines on: at their fronts, or where the back can be seen
   * at their backs. Call it when the light's side of faces is new.
   */
  listLit() {
    const { device, model, corners } = this.shared;
    const { gl } = device;
    const { show } = this;
    const { faceCount, facePart, faceComponent, isClosed, isInward } = model;
    const { volumes, opened } = this.shadows;
    const front = fronts.reserve(3 * faceCount);
    const back = backs.reserve(3 * faceCount);
    const { side } = volumes;
    // Inside a solid nothing is lit, unless the light or the eye is there, too.
    const isSolid = isClosed.map((is, k) => is & volumes.isClosed[k] & ~(opened?.[k] ?? 0) & ~isInward[k] & 1);
    let [n, m] = [0, 0];
    for (let f = 0; f < faceCount; f++) {
      const mine = side[f];
      if (mine === 0 || (show && !show[facePart[f]])) continue;
      if (mine > 0) {
        front[n] = corners[3 * f];
        front[n + 1] = corners[3 * f + 1];
        front[n + 2] = corners[3 * f + 2];
        n += 3;
      } else if (!isSolid[faceComponent[f]]) {
        back[m] = corners[3 * f];
        back[m + 1] = corners[3 * f + 1];
        back[m + 2] = corners[3 * f + 2];
        m += 3;
      }
    }
    this.front = n;
    this.back = m;
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.litFaces);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, 4 * (n + m), gl.STREAM_DRAW);
    if (n) gl.bufferSubData(gl.ELEMENT_ARRAY_BUFFER, 0, front, 0, n);
    if (m) gl.bufferSubData(gl.ELEMENT_ARRAY_BUFFER, 4 * n, back, 0, m);
  }

  delete() {
    const { gl } = this.shared.device;
    this.shadows.delete();
    for (const buffer of [this.faces, this.litFaces, this.creaseLines]) gl.deleteBuffer(buffer);
    for (const array of [this.all, this.lit, this.creases]) gl.deleteVertexArray(array);
  }
}

/**
 * @param {Mask} a
 * @param {Mask} b
 */
function isSame(a, b) {
  if (a === b) return true;
  if (!a || !b || a.length !== b.length) return false;
  for (let i = 0; i < a.length; i++) if (Boolean(a[i]) !== Boolean(b[i])) return false;
  return true;
}
