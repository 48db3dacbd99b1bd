// The shadow volumes of one light in one view: what is thrown, listed, uploaded and counted.

import { findGap, makeBoxes, widen } from "./boxes.js";
import { findOpened } from "./opened.js";
import { CLAMPED_VOLUME, VOLUME } from "./volume_shaders.js";
import { dot, measure, move, subtract, unit } from "./vectors.js";
import { Volumes } from "./volumes.js";

const BELOW = 0.002; // from the lowest receiver to the bottom of volumes, in sizes of the scene
const LEAST_TIP = 1e-4; // a lamp's volumes end at 10,000 times the distance, or at infinity
const PARALLEL_TIP = 1e-3; // and at a thousand times in parallel views, which have no infinity
const LOWEST = 0.01; // sine of a sun's altitude, below which its volumes end at infinity

/**
 * A light as a homogeneous place, (4,); a direction has length 1.
 * @param {Light} light
 */
export function findPlace(light) {
  return "direction" in light ? [...unit(light.direction), 0] : [...light.position, 1];
}

/**
 * The z up to which a ground hides all from the eye; -Infinity: nothing.
 * @param {Sight} sight
 * @param {number | null} ground
 */
export function findFloor(sight, ground) {
  return ground !== null && sight.isAbove(ground) ? ground : -Infinity;
}

/** The volumes of a model whose parts cast as a view says. */
export class Shadows {
  /**
   * @param {Device} device
   * @param {Model} model
   * @param {WebGLBuffer | null} doubled each vertex with w = 1, then with w = 0
   * @param {Mask} cast
   * @param {Mask} show
   */
  constructor(device, model, doubled, cast, show) {
    const { gl } = device;
    this.device = device;
    this.model = model;
    this.volumes = new Volumes(model);
    this.volumes.setParts(cast, show);
    this.indices = gl.createBuffer();
    this.room = 0; // of indices on the card
    /** @type {{isBehind: boolean, kind: 'wound' | 'cap' | 'turned', first: number, size: number}[]} */
    this.draws = [];
    this.array = device.makeArray(VOLUME, { place: [doubled, 4, gl.FLOAT, 16, 0] }, this.indices);
    /** @type {Sight | null} of the last view */
    this.sight = null;
    this.key = "";
    this.lightKey = "";
    this.casters = 0;
    this.behind = 0;
    /** @type {Throw} */
    this.thrown = { light: [0, 0, 1, 0], range: Infinity, bottom: 0, floor: 0, tip: 0 };
  }

  /**
   * Prepare the volumes of a light for a view; nothing is done while both stay as they are.
   * @param {Light} light
   * @param {Sight} sight
   * @param {number | null} ground
   * @param {boolean} isCut whether surfaces are cut off by a section
   */
  prepare(light, sight, ground, isCut) {
    const source = findPlace(light);
    const range = "position" in light ? (light.range ?? Infinity) : Infinity;
    const key = [...source, range, isCut].join();
    if (sight === this.sight && key === this.key) return;
    this.sight = sight;
    this.key = key;
    const opened = findOpened(this.volumes, sight, source);
    const isOverLand = !isCut && ground === null && Boolean(this.volumes.land?.isSeenFromAbove(sight));
    const lightKey = `${source} ${isOverLand} ${opened ?? ""}`;
    if (lightKey !== this.lightKey) this.volumes.setLight(source, opened, isOverLand);
    this.lightKey = lightKey;
    const bottom = this.findBottom(source, sight, ground);
    // Where volumes end below a ground that is seen from above, it hides all that is below it.
    const floor = bottom === -Infinity ? bottom : findFloor(sight, ground);
    const tip = this.findTip(sight, source, ground);
    this.thrown = { light: source, range, bottom, floor, tip };
    const { casters, behind } = this.volumes.list(sight, this.thrown, isCut);
    this.casters = casters;
    this.behind = behind;
    this.upload();
  }

  /**
   * Find the z at which volumes of a light above them end, below all receivers; -Infinity: none.
   * @param {number[]} light
   * @param {Sight} sight
   * @param {number | null} ground
   */
  findBottom(light, sight, ground) {
    const [low, high] = this.model.bounds;
    const size = measure(high, low);
    const lowest = Math.min(low[2], ground ?? Infinity);
    const [x, y, z, w] = light;
    if (!(w ? z > high[2] + BELOW * size : z > LOWEST)) return -Infinity;
    // A pixel below what is farthest away is enough.
    let pixel = Infinity;
    if (!w) {
      const farthest = size + ((high[2] - lowest) * Math.hypot(x, y)) / z;
      const away = sight.isPerspective ? farthest + measure(sight.eye, low) : 1;
      pixel = (2 * sight.half * away) / sight.rows;
    }
    const bottom = lowest - Math.min(BELOW * size, pixel);
    // An eye below the bottom would look through it, and z-pass draws none.
    return sight.isAbove(bottom) ? bottom : -Infinity;
  }

  /**
   * Find the weight of the far ends: 0 at infinity, or 1 / how far they are, in lengths of the way
   * from the light, where that is beyond every receiver. Parallel rays never meet what lies at
   * infinity, and rasterisers lose digits on the way there.
   * @param {Sight} sight
   * @param {number[]} light
   * @param {number | null} ground
   */
  findTip(sight, light, ground) {
    if (sight.isPerspective && ground !== null) return 0; // the ground is endless
    const [low, high] = this.model.bounds;
    const middle = move(low, high, 1).map((v) => v / 2);
    let reach = 1.1 * measure(high, low);
    // No ray from the eye to what it sees passes a far end.
    if (sight.isPerspective) reach += measure(sight.eye, middle);
    else reach += sight.far + 2 * sight.half * (1 + sight.aspect);
    if (!light[3]) return 1 / reach;
    const least = findDistance(this.model, light);
    const tip = least / (1.1 * (reach + measure(light, middle)));
    return sight.isPerspective ? (tip > LEAST_TIP ? tip : 0) : Math.max(tip, PARALLEL_TIP);
  }

  /** Send all lists to the card, one after the other. */
  upload() {
    const { gl } = this.device;
    const { zPass, zFail } = this.volumes;
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices);
    const size = zPass.size + zFail.size;
    if (size > this.room) this.room = Math.ceil(1.5 * size);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, 4 * this.room, gl.STREAM_DRAW);
    this.draws = [];
    let first = 0;
    for (const faces of [zPass, zFail]) {
      for (const kind of /** @type {const} */ (["wound", "cap", "turned"])) {
        const { data, size } = faces[kind];
        if (!size) continue;
        gl.bufferSubData(gl.ELEMENT_ARRAY_BUFFER, 4 * first, data, 0, size);
        this.draws.push({ isBehind: faces === zFail, kind, first, size });
        first += size;
      }
    }
  }

  /**
   * Count, in the stencil, the volumes that hold each visible surface.
   *
   * Before: depth holds the scene, the stencil 0. After: the stencil is 0 where the light is
   * visible.
   * @param {Sight} sight
   * @param {Record<string, any>} common uniforms of the view
   */
  count(sight, common) {
    const { device, thrown } = this;
    const { gl } = device;
    const [x, y, z, w] = thrown.light;
    const isCut = thrown.bottom !== -Infinity;
    gl.bindVertexArray(this.array);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.ALWAYS, 0, 255);
    gl.colorMask(false, false, false, false);
    gl.depthMask(false);
    gl.depthFunc(device.nearer);
    for (const { isBehind, kind, first, size } of this.draws) {
      // Light caps have the depth of surfaces, which only the rasteriser itself computes.
      const isClamped = isBehind && kind === "wound" && !sight.isPerspective;
      device.use(isClamped ? CLAMPED_VOLUME : VOLUME).set({
        ...common,
        light: w ? [...subtract([x, y, z], sight.eye), 1] : [x, y, z, 0],
        bottom: isCut ? thrown.bottom - sight.eye[2] : 0,
        isCut,
        tip: thrown.tip,
        isClamped,
        reverses: device.reverses,
      });
      const [front, back] = kind === "turned" ? [gl.BACK, gl.FRONT] : [gl.FRONT, gl.BACK];
      if (isBehind) {
        gl.stencilOpSeparate(front, gl.KEEP, gl.DECR_WRAP, gl.KEEP);
        gl.stencilOpSeparate(back, gl.KEEP, gl.INCR_WRAP, gl.KEEP);
      } else {
        gl.stencilOpSeparate(front, gl.KEEP, gl.KEEP, gl.INCR_WRAP);
        gl.stencilOpSeparate(back, gl.KEEP, gl.KEEP, gl.DECR_WRAP);
      }
      gl.drawElements(gl.TRIANGLES, size, gl.UNSIGNED_INT, 4 * first);
    }
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
    gl.colorMask(true, true, true, true);
  }

  /**
   * The pixels that a lamp's range reaches: left, bottom, width, height; null: all.
   * @param {Sight} sight
   * @returns {[number, number, number, number] | null}
   */
  findScissor(sight) {
    const { light, range } = this.thrown;
    if (!light[3] || range === Infinity) return null;
    let [left, top, right, bottom] = [Infinity, Infinity, -Infinity, -Infinity];
    for (let corner = 0; corner < 8; corner++) {
      const away = [0, 1, 2].map((k) => ((corner >> k) & 1 ? range : -range));
      const point = move(light, away, 1);
      if (sight.isPerspective && dot(subtract(point, sight.eye), sight.forward) < sight.near)
        return null;
      const pixel = sight.project(point);
      if (!pixel) return null;
      left = Math.min(left, pixel.x);
      right = Math.max(right, pixel.x);
      top = Math.min(top, pixel.y);
      bottom = Math.max(bottom, pixel.y);
    }
    const x = Math.min(Math.max(Math.floor(left) - 1, 0), sight.columns);
    const y = Math.min(Math.max(Math.floor(sight.rows - bottom) - 1, 0), sight.rows);
    const end = Math.min(Math.ceil(right) + 1, sight.columns);
    const above = Math.min(Math.ceil(sight.rows - top) + 1, sight.rows);
    return [x, y, Math.max(end - x, 0), Math.max(above - y, 0)];
  }

  delete() {
    const { gl } = this.device;
    gl.deleteBuffer(this.indices);
    gl.deleteVertexArray(this.array);
  }
}

/**
 * A lower bound of the distance from a place to the faces: to their boxes and their planes.
 * @param {Model} model
 * @param {number[]} point
 */
function findDistance({ blocks, blockFaces, faceCount, faces, places, planes }, point) {
  let least = Infinity;
  const box = makeBoxes(1);
  for (let block = 0; block < blocks.length / 6; block++) {
    if (findGap(blocks, block, point) >= least) continue;
    for (let f = blockFaces[block]; f < blockFaces[block + 1]; f++) {
      box.fill(Infinity, 0, 3).fill(-Infinity, 3);
      for (let k = 0; k < 3; k++) widen(box, 0, places, faces[3 * f + k]);
      const normal = [planes[f], planes[faceCount + f], planes[2 * faceCount + f]];
      const height =
        Math.abs(dot(normal, point) + planes[3 * faceCount + f]) / Math.hypot(...normal);
      least = Math.min(least, Math.max(findGap(box, 0, point), height || 0));
    }
  }
  return least;
}
