// The faces of a model as they are drawn: vertices with normals and colours, creases.

import { turnPlan } from "./moved.js";
import { dot } from "./vectors.js";

const STRIDE = 24; // bytes: place 12, normal 8, colour 4
const CREASE = Math.cos((25 * Math.PI) / 180); // normals that differ by more meet in a crease
const SMOOTH = 511; // steps of an octahedral normal to each side (pack.py)

/**
 * Vertices of faces: places that share normal and colour share one.
 * @param {Model} model
 * @returns {{vertices: ArrayBuffer, corners: Uint32Array}}
 */
export function makeSurfaces(model) {
  const { faces, faceCount, facePart, places, parts } = model;
  const colors = parts.map(({ color, opacity }) => [
    ...color.map((c) => Math.round(255 * Math.sqrt(Math.min(Math.max(c, 0), 1)))),
    Math.round(255 * opacity),
  ]);
  const corners = new Uint32Array(3 * faceCount);
  const buffer = new ArrayBuffer(3 * faceCount * STRIDE);
  const floats = new Float32Array(buffer);
  const shorts = new Int16Array(buffer);
  const bytes = new Uint8Array(buffer);
  // Vertices at a place form a chain.
  const first = new Int32Array(places.length / 3).fill(-1);
  const next = new Int32Array(3 * faceCount);
  const keys = new Int32Array(6 * faceCount); // two for each vertex
  let count = 0;
  for (let f = 0; f < faceCount; f++) {
    const flat = model.faceNormal(f);
    const color = colors[facePart[f]];
    const paint = color[0] | (color[1] << 8) | (color[2] << 16) | (color[3] << 24);
    for (let k = 0; k < 3; k++) {
      const normal = (model.normals && readNormal(model.normals, 3 * f + k)) ?? flat;
      const [x, y, z] = normal.map((v) => Math.round(32767 * v));
      // Normals that differ by less than a thousandth are one.
      const shape = (x >> 5) * 4194304 + (y >> 5) * 2048 + (z >> 5);
      const corner = faces[3 * f + k];
      let vertex = first[corner];
      while (vertex >= 0 && (keys[2 * vertex] !== (shape | 0) || keys[2 * vertex + 1] !== paint))
        vertex = next[vertex];
      if (vertex < 0) {
        vertex = count++;
        keys[2 * vertex] = shape | 0;
        keys[2 * vertex + 1] = paint;
        next[vertex] = first[corner];
        first[corner] = vertex;
        floats.set(places.subarray(3 * corner, 3 * corner + 3), (vertex * STRIDE) / 4);
        shorts.set([x, y, z, 0], (vertex * STRIDE + 12) / 2);
        bytes.set(color, vertex * STRIDE + 20);
      }
      if (model.normals) {
        // The sine of the widest angle between a smooth normal and its faces'.
        const lean = Math.sqrt(Math.max(0, 1 - dot(normal, flat) ** 2)),
          at = (vertex * STRIDE + 18) / 2;
        shorts[at] = Math.max(shorts[at], Math.round(32767 * lean));
      }
      corners[3 * f + k] = vertex;
    }
  }
  return { vertices: buffer.slice(0, count * STRIDE), corners };
}

/**
 * Bring the vertices of faces to where the model's places are, with their normals turned.
 * @param {Model} model
 * @param {ReturnType<typeof makeSurfaces>} surfaces
 * @param {ArrayBuffer} packed their vertices before any move
 * @param {number[]} changed faces
 * @param {Set<number>} turned those of them whose normals turn; others are as packed
 * @param {number} angle clockwise in the plan [degrees]
 */
export function moveSurfaces(model, { vertices, corners }, packed, changed, turned, angle) {
  const floats = new Float32Array(vertices),
    shorts = new Int16Array(vertices),
    before = new Int16Array(packed);
  for (const f of changed) {
    for (let k = 0; k < 3; k++) {
      const vertex = corners[3 * f + k],
        at = (vertex * STRIDE + 12) / 2,
        offset = 3 * model.faces[3 * f + k];
      floats.set(model.places.subarray(offset, offset + 3), (vertex * STRIDE) / 4);
      const [x, y] = turnPlan(before[at], before[at + 1], turned.has(f) ? angle : 0);
      shorts[at] = Math.round(x);
      shorts[at + 1] = Math.round(y);
    }
  }
}

/**
 * @param {Int32Array} normals
 * @param {number} corner
 */
function readNormal(normals, corner) {
  let [x, y] = [normals[2 * corner] / SMOOTH, normals[2 * corner + 1] / SMOOTH];
  if (Math.abs(x) > 1) return null;
  const z = 1 - Math.abs(x) - Math.abs(y);
  if (z < 0) [x, y] = [(1 - Math.abs(y)) * (x < 0 ? -1 : 1), (1 - Math.abs(x)) * (y < 0 ? -1 : 1)];
  const size = Math.hypot(x, y, z);
  return [x / size, y / size, z / size];
}

/**
 * The edges where faces meet at an angle, or end, as pairs of indices of the doubled vertices.
 * @param {Model} model
 * @returns {{lines: Uint32Array, part: Uint32Array, shell: Uint32Array}} part and shell of each
 *   line
 */
export function findCreases(model) {
  const { edgeCount, edgeA, edgeB, edgeTurn, edgeFrom, edgeTo, faceCount, facePart } = model;
  const { shellCount, edgeStarts } = model;
  const lines = new Uint32Array(2 * edgeCount);
  const part = new Uint32Array(edgeCount),
    shell = new Uint32Array(edgeCount);
  let [n, own] = [0, 0];
  for (let i = 0; i < edgeCount; i++) {
    while (own + 1 < shellCount && i >= edgeStarts[own + 1]) own += 1;
    if (edgeB[i] < faceCount) {
      const [a, b] = [model.faceNormal(edgeA[i]), model.faceNormal(edgeB[i])];
      const bend = -edgeTurn[i] * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
      if (bend > CREASE) continue;
    }
    lines[2 * n] = 2 * edgeFrom[i];
    lines[2 * n + 1] = 2 * edgeTo[i];
    part[n] = facePart[edgeA[i]];
    shell[n] = own;
    n += 1;
  }
  return { lines: lines.slice(0, 2 * n), part: part.slice(0, n), shell: shell.slice(0, n) };
}

/**
 * Vertex arrays of surfaces and of doubled vertices, for volumes and creases.
 * @param {Device} device
 * @param {Model} model
 * @param {{vertices: ArrayBuffer}} surfaces
 */
export function makeBuffers(device, model, { vertices }) {
  const { places } = model;
  const doubled = new Float32Array((8 * places.length) / 3);
  for (let i = 0; i < places.length / 3; i++) {
    for (let axis = 0; axis < 3; axis++) {
      doubled[8 * i + axis] = doubled[8 * i + 4 + axis] = places[3 * i + axis];
    }
    doubled[8 * i + 3] = 1;
  }
  return {
    surface: device.makeBuffer(vertices),
    doubled: device.makeBuffer(doubled),
    stride: STRIDE,
  };
}
