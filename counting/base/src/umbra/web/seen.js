// The faces that a view sees, and those of them that a light reaches: index lists on the card.
//
// A face is listed for the side that is turned to the eye. So half of a solid is left out, and what
// is out of view: the card would compute all of that anew for each pass.

import { SURFACE } from "./surface_shaders.js";
import { isBeyond } from "./view.js";
import { List } from "./volumes.js";

/** @typedef {import('./selection.js').Shared} Shared */

/** Kinds of faces; the backs of solids are seen only where something cuts into them. */
const [HIDDEN, SOLID, SHEET, PANE] = [0, 1, 2, 3];
/** Lists that all selections fill in turn: fronts and backs. */
const lists = [new List(), new List(), new List(), new List(), new List(), new List()];

/**
 * A run of indices.
 * @typedef {{side: 1 | -1, first: number, size: number}} Run
 */

export class SeenFaces {
  /**
   * @param {Shared} shared
   * @param {Mask} show
   * @param {Mask} opaque
   */
  constructor({ device, model, corners, surface, stride }, show, opaque) {
    const { gl } = device,
      { facePart, faceComponent } = model;
    this.device = device;
    this.model = model;
    this.corners = corners;
    const whole = findWhole(model, opaque);
    this.kinds = Uint8Array.from(facePart, (part, f) => {
      if (show && !show[part]) return HIDDEN;
      if (opaque && !opaque[part]) return PANE;
      return whole[faceComponent[f]] ? SOLID : SHEET;
    });
    this.hasPanes = this.kinds.includes(PANE);
    /** Which side of each face is seen: 1 its front, -1 its back, 0 none. */
    this.sides = new Int8Array(model.faceCount);
    /** The seen faces that are not seen through, and how many there are. */
    this.opaque = new Uint32Array(model.faceCount);
    this.count = 0;
    this.indices = [gl.createBuffer(), gl.createBuffer()];
    /** @type {Record<string, [WebGLBuffer | null, number, number, number, number]>} */
    const attributes = {
      place: [surface, 3, gl.FLOAT, stride, 0],
      normal: [surface, 4, gl.SHORT, stride, 12],
      color: [surface, 4, gl.UNSIGNED_BYTE, stride, 20],
    };
    this.arrays = this.indices.map((buffer) => device.makeArray(SURFACE, attributes, buffer));
    /** @type {Record<'solid' | 'opaque' | 'panes' | 'lit', Run[]>} */
    this.runs = { solid: [], opaque: [], panes: [], lit: [] };
    /** @type {Sight | null} of the last view */
    this.sight = null;
    this.cutsInto = false;
  }

  /**
   * List what a view sees.
   * @param {Sight} sight
   * @param {boolean} cutsInto whether backs of solids may be seen
   * @param {number} floor z up to which a ground hides all
   */
  list(sight, cutsInto, floor) {
    if (sight === this.sight && cutsInto === this.cutsInto) return;
    this.sight = sight;
    this.cutsInto = cutsInto;
    const { model, kinds, sides, opaque } = this;
    const { faceCount: n, faceStarts, planes, shellCount, shells } = model;
    const [x, y, z, w] = sight.apex;
    const view = sight.findPlanes();
    sides.fill(0);
    for (let shell = 0; shell < shellCount; shell++) {
      if (isBeyond(view, shells, 6 * shell) || shells[6 * shell + 5] < floor) continue;
      for (let f = faceStarts[shell]; f < faceStarts[shell + 1]; f++) {
        const at = planes[f] * x + planes[n + f] * y + planes[2 * n + f] * z + planes[3 * n + f] * w;
        if (kinds[f] !== HIDDEN && (at >= 0 || kinds[f] !== SOLID || cutsInto))
          sides[f] = at >= 0 ? 1 : -1;
      }
    }
    this.begin();
    let count = 0;
    for (let f = 0; f < n; f++) {
      if (!sides[f]) continue;
      this.add(2 * kinds[f] - (sides[f] > 0 ? 2 : 1), f);
      if (kinds[f] !== PANE) opaque[count++] = f;
    }
    this.count = count;
    const [solid, hollow, sheet, under, pane, behind] = this.upload(0, [0, 1, 2, 3, 4, 5]);
    this.runs.solid = [solid, hollow];
    this.runs.opaque = [solid, hollow, sheet, under];
    this.runs.panes = [pane, behind];
  }

  /**
   * List the seen sides that face a light; only there can it be missing.
   * @param {Int8Array} lit on which side of each face the light is
   */
  listLit(lit) {
    const { sides, opaque, count } = this;
    this.begin();
    for (let i = 0; i < count; i++) {
      const f = opaque[i];
      if (lit[f] === sides[f]) this.add(lit[f] > 0 ? 0 : 1, f);
    }
    this.runs.lit = this.upload(1, [0, 1]);
  }

  begin() {
    for (const list of lists) {
      list.size = 0;
      list.reserve(3 * this.model.faceCount);
    }
  }

  /** @param {number} k of the list @param {number} f */
  add(k, f) {
    const { corners } = this,
      list = lists[k],
      at = list.size;
    list.data[at] = corners[3 * f];
    list.data[at + 1] = corners[3 * f + 1];
    list.data[at + 2] = corners[3 * f + 2];
    list.size = at + 3;
  }

  /**
   * Send lists to the card, one after the other; even ones hold fronts.
   * @param {number} array
   * @param {number[]} which
   * @returns {Run[]}
   */
  upload(array, which) {
    const { gl } = this.device;
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices[array]);
    const total = which.reduce((sum, k) => sum + lists[k].size, 0);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, 4 * total, gl.STREAM_DRAW);
    let end = 0;
    return which.map((k) => {
      const { data, size } = lists[k],
        first = end;
      if (size) gl.bufferSubData(gl.ELEMENT_ARRAY_BUFFER, 4 * first, data, 0, size);
      end += size;
      return { side: k % 2 ? -1 : 1, first, size };
    });
  }

  /**
   * Draw runs of indices, each with its side.
   * @param {'solid' | 'opaque' | 'panes' | 'lit'} what
   * @param {(side: 1 | -1) => void} [turn] what to set before a run
   */
  draw(what, turn = () => {}) {
    const { gl } = this.device;
    gl.bindVertexArray(this.arrays[what === "lit" ? 1 : 0]);
    for (const { side, first, size } of this.runs[what]) {
      if (!size) continue;
      turn(side);
      gl.drawElements(gl.TRIANGLES, size, gl.UNSIGNED_INT, 4 * first);
    }
  }

  delete() {
    const { gl } = this.device;
    for (const buffer of this.indices) gl.deleteBuffer(buffer);
    for (const array of this.arrays) gl.deleteVertexArray(array);
  }
}

/**
 * Find the closed components, wound outward, all of which is drawn.
 * @param {Model} model
 * @param {Mask} opaque
 */
function findWhole({ facePart, faceComponent, isClosed, isInward }, opaque) {
  const whole = isClosed.map((is, k) => is & ~isInward[k] & 1);
  if (opaque)
    facePart.forEach((part, f) => {
      if (!opaque[part]) whole[faceComponent[f]] = 0;
    });
  return whole;
}
