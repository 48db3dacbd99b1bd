// A model as Python packed it (pack.py), unpacked for drawing and for rays.

import { findAssumedGround } from "./assumed_ground.js";
import { BLOCK, makeBoxes, widen } from "./boxes.js";
import { findPlane } from "./planes.js";
import { traceRay } from "./trace.js";

/**
 * @typedef {object} Header
 * @property {number} version
 * @property {number} step of positions [m]
 * @property {Vec3} origin
 * @property {number | null} ground
 * @property {import('./sun.js').Site | null} site
 * @property {[string, string, string, string, Vec3, number][]} parts name, kind, layer, label,
 *   linear
 *   RGB, opacity
 * @property {[string, number, number, boolean][]} streams name, count, bytes of each, differences
 */

const VERSION = 3;

/**
 * Unpack a block made by `umbra.web.pack_model`.
 * @param {ArrayBuffer | Uint8Array} block
 * @returns {Promise<Model>}
 */
export async function unpackModel(block) {
  const inflated = new Response(
    new Blob([block]).stream().pipeThrough(new DecompressionStream("deflate")),
  );
  const bytes = new Uint8Array(await inflated.arrayBuffer());
  const size = new DataView(bytes.buffer).getUint32(0, true);
  /** @type {Header} */
  const header = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + size)));
  if (header.version !== VERSION) {
    throw new Error(`the model is packed as version ${header.version}; this page reads ${VERSION}`);
  }
  /** @type {Record<string, Int32Array>} */
  const streams = {};
  let at = 4 + size;
  for (const [name, count, width, differs] of header.streams) {
    streams[name] = readIntegers(bytes, at, count, width);
    if (name === "places") addUp(streams[name], count / 3, 3);
    else if (differs) addUp(streams[name], count, 1);
    at += count * width;
  }
  return new Model(header, streams);
}

/**
 * Read integers that are stored as planes of bytes, the sign in the lowest bit.
 * @param {Uint8Array} bytes @param {number} at @param {number} count @param {number} width
 */
function readIntegers(bytes, at, count, width) {
  const values = new Int32Array(count);
  for (let plane = 0; plane < width; plane++) {
    const from = at + plane * count;
    for (let i = 0; i < count; i++) values[i] |= bytes[from + i] << (8 * plane);
  }
  for (let i = 0; i < count; i++) values[i] = (values[i] >>> 1) ^ -(values[i] & 1);
  return values;
}

/**
 * Turn differences into values, column by column.
 * @param {Int32Array} values
 * @param {number} rows
 * @param {number} columns
 */
function addUp(values, rows, columns) {
  for (let column = 0; column < columns; column++) {
    for (let i = column * rows + 1; i < (column + 1) * rows; i++) values[i] += values[i - 1];
  }
}

/** Geometry, adjacency and bounds. Faces lie in the order of their shells. */
export class Model {
  /** @param {Header} header @param {Record<string, Int32Array>} streams */
  constructor(header, streams) {
    /** @type {Vec3} add it to local positions for the model's own coordinates [m] */
    this.origin = header.origin;
    this.site = header.site;
    /** @type {number | null} level ground that the file states, local [m] */
    this.ground = header.ground;
    /** @type {Part[]} */
    this.parts = header.parts.map(([name, kind, layer, label, color, opacity]) => {
      return { name, kind, layer, label, color, opacity, faces: 0 };
    });
    /** whether any part is seen through */
    this.hasGlass = this.parts.some(({ opacity }) => opacity < 1);
    /** @type {number} */
    this.faceCount = streams.part.length;
    /** positions are whole multiples of it [m] @type {number} */
    this.step = header.step;
    this.places = findPlaces(streams.places, header.step);
    this.faces = findFaces(streams.corners);
    this.facePart = streams.part;
    this.faceComponent = streams.component;
    this.isClosed = Uint8Array.from(streams.closed);
    for (const part of this.facePart) this.parts[part].faces += 1;
    /** (faces, 3, 2) octahedral normals in steps, if the file has any */
    this.normals = streams.normals ?? null;
    /** surface of a study's samples of each face; -1: none */
    this.surface = (streams.surface ?? new Int32Array(this.faceCount)).map((index) => index - 1);

    const { faces, faceCount, places } = this;
    const edges = streams.edge;
    /** Edge i runs from edgeFrom[i] to edgeTo[i] as face edgeA[i] winds it. */
    this.edgeCount = edges.length;
    this.edgeFrom = new Uint32Array(edges.length);
    this.edgeTo = new Uint32Array(edges.length);
    this.edgeA = new Uint32Array(edges.length);
    this.edgeB = new Uint32Array(edges.length); // a border's is the face that never adds
    this.edgeTurn = new Int8Array(edges.length); // 1: b winds the edge as a does, else -1
    for (let i = 0; i < edges.length; i++) {
      const a = Math.floor(edges[i] / 3);
      const corner = edges[i] - 3 * a;
      this.edgeFrom[i] = faces[edges[i]];
      this.edgeTo[i] = faces[3 * a + ((corner + 1) % 3)];
      this.edgeA[i] = a;
      this.edgeB[i] = streams.pair[i] === 2 ? faceCount : a + streams.across[i];
      this.edgeTurn[i] = streams.pair[i] === 1 ? 1 : -1;
    }
    this.planes = findPlanes(this.places, faces);
    this.isInward = findInward(this);

    // Where each shell's faces, edges and blocks of faces begin, and their bounds.
    const shell = streams.shell;
    this.shellCount = shell[faceCount - 1] + 1;
    this.faceStarts = new Uint32Array(this.shellCount + 1);
    this.edgeStarts = new Uint32Array(this.shellCount + 1);
    this.blockStarts = new Uint32Array(this.shellCount + 1);
    for (let f = 0; f < faceCount; f++) this.faceStarts[shell[f] + 1] = f + 1;
    for (let i = 0; i < this.edgeCount; i++) this.edgeStarts[shell[this.edgeA[i]] + 1] = i + 1;
    for (let k = 0; k < this.shellCount; k++) {
      const size = this.faceStarts[k + 1] - this.faceStarts[k];
      this.blockStarts[k + 1] = this.blockStarts[k] + Math.ceil(size / BLOCK);
    }
    this.shells = makeBoxes(this.shellCount);
    this.blocks = makeBoxes(this.blockStarts[this.shellCount]);
    /** Block k owns the faces from blockFaces[k] to blockFaces[k + 1]. */
    this.blockFaces = new Uint32Array(this.blockStarts[this.shellCount] + 1).fill(faceCount);
    for (let f = 0; f < faceCount; f++) {
      const block =
        this.blockStarts[shell[f]] + Math.floor((f - this.faceStarts[shell[f]]) / BLOCK);
      if (f < this.blockFaces[block]) this.blockFaces[block] = f;
      for (let corner = 0; corner < 3; corner++) {
        widen(this.blocks, block, places, faces[3 * f + corner]);
        widen(this.shells, shell[f], places, faces[3 * f + corner]);
      }
    }
    const whole = makeBoxes(1);
    for (let i = 0; i < places.length / 3; i++) widen(whole, 0, places, i);
    const [x, y, z, right, back, top] = whole;
    /** @type {[Vec3, Vec3]} lowest and highest corner [m] */
    this.bounds = [
      [x, y, z],
      [right, back, top],
    ];
  }

  /** The ground that umbra assumed, found when it is first asked for; null: none. */
  findAssumedGround() {
    this.assumedGround ??= { ground: findAssumedGround(this) };
    return this.assumedGround.ground;
  }

  /** @type {{ground: ReturnType<typeof findAssumedGround>} | null} to be found anew after a move */
  assumedGround = null;

  /**
   * Find the faces that a ray meets, nearest first.
   * @param {Vec3} from
   * @param {Vec3} towards distances are in its length
   * @param {{cast?: Mask, every?: boolean, reach?: number}} [options]
   *   parts that count; every face or the nearest; how far
   */
  trace(from, towards, options = {}) {
    return traceRay(this, from, towards, options);
  }

  /**
   * The unit normal of a face.
   * @param {number} face
   * @returns {Vec3}
   */
  faceNormal(face) {
    const { planes, faceCount: n } = this,
      x = planes[face],
      y = planes[n + face],
      z = planes[2 * n + face];
    const size = Math.hypot(x, y, z) || 1;
    return [x / size, y / size, z / size];
  }
}

/**
 * Positions (n, 3) [m] of columns of steps.
 * @param {Int32Array} columns
 * @param {number} step
 */
function findPlaces(columns, step) {
  const count = columns.length / 3;
  const places = new Float64Array(3 * count);
  for (let axis = 0; axis < 3; axis++) {
    for (let i = 0; i < count; i++) places[3 * i + axis] = columns[axis * count + i] * step;
  }
  return places;
}

/**
 * Corners, which are stored as how far they are below the next new vertex.
 * @param {Int32Array} below
 */
function findFaces(below) {
  const faces = new Uint32Array(below.length);
  let next = 0;
  for (let i = 0; i < below.length; i++) {
    faces[i] = next - below[i];
    if (below[i] === 0) next += 1;
  }
  return faces;
}

/**
 * Planes (4, n), row by row.
 * @param {Float64Array} places
 * @param {Uint32Array} faces
 */
function findPlanes(places, faces) {
  const count = faces.length / 3;
  const planes = new Float64Array(4 * count);
  for (let f = 0; f < count; f++) {
    const plane = findPlane(places, faces, f);
    for (let row = 0; row < 4; row++) planes[row * count + f] = plane[row];
  }
  return planes;
}

/**
 * Find the closed components that are wound inward.
 * @param {Model} model
 */
function findInward({ faceCount, faceComponent, faces, places, planes, isClosed }) {
  const volume = new Float64Array(isClosed.length);
  for (let f = 0; f < faceCount; f++) {
    const at = 3 * faces[3 * f];
    volume[faceComponent[f]] +=
      planes[f] * places[at] +
      planes[faceCount + f] * places[at + 1] +
      planes[2 * faceCount + f] * places[at + 2];
  }
  return Uint8Array.from(volume, (v, k) => (v < 0 && isClosed[k] ? 1 : 0));
}
