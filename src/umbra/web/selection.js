// What is drawn and casts for one choice of parts: index lists on the card.

import { SeenFaces } from "./seen.js";
import { CREASE } from "./mark_shaders.js";
import { Shadows, findFloor } from "./shadows.js";
import { dot } from "./vectors.js";
import { isBeyond } from "./view.js";
import { List } from "./volumes.js";

/**
 * What all selections of a model share.
 * @typedef {object} Shared
 * @property {Device} device
 * @property {Model} model
 * @property {Uint32Array} corners vertex of each corner of each face
 * @property {ReturnType<typeof import('./surfaces.js').findCreases>} creases
 * @property {WebGLBuffer | null} surface vertices with normals and colours
 * @property {number} stride bytes of each
 * @property {WebGLBuffer | null} doubled vertices, each with w = 1 and w = 0
 */

/** Sixths of the pixels in a metre, below which creases are not drawn. */
export const WEAKEST = 0.15;

/** Creases that are seen: one list serves all selections. */
const creases = new List();

/** Faces and creases of the shown parts, and the shadows of the casting ones. */
export class Selection {
  /**
   * @param {Shared} shared
   * @param {Mask} cast
   * @param {Mask} show
   * @param {boolean} isSolid whether glass is drawn as a wall, as counts take it
   */
  constructor(shared, cast, show, isSolid) {
    const { device, model, doubled } = shared;
    const { gl } = device;
    this.shared = shared;
    this.cast = cast && Array.from(cast);
    this.show = show && Array.from(show);
    this.isSolid = isSolid;
    /** Parts that hide what is behind them; null: all. */
    this.opaque = findOpaque(model, show, isSolid);
    const { opaque } = this;
    this.shadows = new Shadows(device, model, doubled, cast, opaque);
    const { lines, part, shell } = shared.creases;
    this.lines = show ? lines.filter((_, i) => show[part[i >> 1]]) : lines;
    /** where the lines of each shell begin */
    this.lineStarts = new Uint32Array(model.shellCount + 1);
    for (let i = 0; i < shell.length; i++) {
      if (!show || show[part[i]]) this.lineStarts[shell[i] + 1] += 2;
    }
    for (let k = 0; k < model.shellCount; k++) this.lineStarts[k + 1] += this.lineStarts[k];
    this.seen = new SeenFaces(shared, show, opaque);
    this.creaseLines = gl.createBuffer();
    this.creaseCount = 0;
    /** @type {Sight | null} whose creases are listed */
    this.creaseSight = null;
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
   * @param {boolean} isSolid
   */
  isOf(cast, show, isSolid) {
    return this.isSolid === isSolid && isSame(this.cast, cast) && isSame(this.show, show);
  }

  /**
   * List the faces that a view sees.
   * @param {Sight} sight
   * @param {boolean} cutsInto whether something may cut into solids
   * @param {number | null} ground
   */
  look(sight, cutsInto, ground) {
    this.seen.list(sight, cutsInto, cutsInto ? -Infinity : findFloor(sight, ground));
  }

  /**
   * List the creases of what a view sees large enough.
   * @param {Sight} sight
   * @param {number} pixels in a metre at distance 1, or anywhere in an orthographic view
   */
  listCreases(sight, pixels) {
    const { device, model } = this.shared,
      { gl } = device,
      { shells, shellCount } = model;
    if (sight === this.creaseSight) return;
    this.creaseSight = sight;
    const planes = sight.findPlanes(),
      farthest = sight.isPerspective ? pixels / (6 * WEAKEST) : Infinity;
    const at = -dot(sight.forward, sight.eye),
      { lineStarts, lines } = this;
    const drawn = creases.reserve(lines.length);
    let [n, begin] = [0, -1];
    if (sight.isPerspective || pixels > 6 * WEAKEST) {
      for (let shell = 0; shell <= shellCount; shell++) {
        const isKept =
          shell < shellCount &&
          findDepth(shells, shell, sight.forward) + at < farthest &&
          !isBeyond(planes, shells, 6 * shell);
        if (isKept && begin < 0) begin = lineStarts[shell];
        if (isKept || begin < 0) continue;
        drawn.set(lines.subarray(begin, lineStarts[shell]), n);
        n += lineStarts[shell] - begin;
        begin = -1;
      }
    }
    this.creaseCount = n;
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.creaseLines);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, drawn, gl.STREAM_DRAW, 0, n);
  }

  delete() {
    const { gl } = this.shared.device;
    this.shadows.delete();
    this.seen.delete();
    gl.deleteBuffer(this.creaseLines);
    gl.deleteVertexArray(this.creases);
  }
}

/**
 * The depth of the nearest corner of a box, from the origin along a direction.
 * @param {Float64Array} boxes
 * @param {number} box
 * @param {Vec3} forward
 */
function findDepth(boxes, box, forward) {
  let low = 0;
  for (let axis = 0; axis < 3; axis++) {
    low += forward[axis] * boxes[6 * box + (forward[axis] > 0 ? axis : axis + 3)];
  }
  return low;
}

/**
 * The shown parts that are not seen through; null: all.
 * @param {Model} model
 * @param {Mask} show
 * @param {boolean} isSolid
 * @returns {Uint8Array | null}
 */
function findOpaque({ parts, hasGlass }, show, isSolid) {
  if (isSolid || !hasGlass) return show && Uint8Array.from(show, Number);
  return Uint8Array.from(parts, ({ opacity }, part) =>
    opacity === 1 && (!show || show[part]) ? 1 : 0,
  );
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
