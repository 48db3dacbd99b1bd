// A camera in a picture of some pixels: its matrix, its rays, and the planes around what it sees.

import { cross, dot, length, move, scale, subtract, unit } from "./vectors.js";

const NEAR = 0.1; // [m]
const MARGIN = 1e-6; // widening of planes, relative to the near rectangle's coordinates
/** @type {Vec3[]} upward first: most casters lie below the eye, and all suns above */
const AXES = [[0, 0, 1], [0, 0, -1], [0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0]];
const HORIZON = 300; // depth of an orthographic view, in sizes of what it sees

/**
 * One view. Depth from 0 to 1 has more digits where the near plane is moved up to what is nearest; a
 * depth that is reversed has as many with a near plane at the eye, between which and a light few
 * casters stand: their volumes are counted by their sides alone.
 */
export class Sight {
  /**
   * @param {Camera} camera
   * @param {number} columns
   * @param {number} rows
   * @param {boolean} reverses whether depth runs from 1 at the near plane to 0 at infinity
   */
  constructor(camera, columns, rows, reverses) {
    this.columns = columns;
    this.rows = rows;
    this.reverses = reverses;
    this.eye = camera.eye;
    this.cameraNear = camera.near ?? NEAR;
    this.near = this.cameraNear;
    /** depth of what is nearest, or of the camera's near plane that may cut it [m] */
    this.nearest = this.cameraNear;
    this.far = Infinity;
    this.isPerspective = camera.height === undefined;
    const forward = unit(subtract(camera.target, camera.eye));
    let right = cross(forward, camera.up ?? [0, 0, 1]);
    if (!(length(right) > 1e-9)) right = cross(forward, [0, 1, 0]); // straight down: north is up
    this.forward = forward;
    this.right = unit(right);
    this.up = cross(this.right, forward);
    const half = Math.tan(((camera.fov ?? 50) * Math.PI) / 360);
    /** half the height of the picture, at distance 1 in perspective [m] */
    this.half = camera.height === undefined ? half : camera.height / 2;
    this.aspect = columns / rows;
  }

  /**
   * Find what is nearest, a box or the ground, move the near plane there, and end an orthographic view.
   * @param {Float64Array} boxes of all that is drawn
   * @param {number | null} ground
   */
  fit(boxes, ground) {
    let [nearest, farthest] = [Infinity, -Infinity];
    const at = dot(this.forward, this.eye);
    const sides = this.findSides(1);
    for (let box = 0; box < boxes.length; box += 6) {
      let [low, high] = [-at, -at];
      for (let axis = 0; axis < 3; axis++) {
        const a = this.forward[axis] * boxes[box + axis];
        const b = this.forward[axis] * boxes[box + 3 + axis];
        low += Math.min(a, b);
        high += Math.max(a, b);
      }
      farthest = Math.max(farthest, high);
      if (low < nearest && high > 0 && !isBeyond(sides, boxes, box)) nearest = low;
    }
    if (ground !== null) {
      // The ground is nearest, and farthest, at a corner of the picture.
      const end = HORIZON * (Math.abs(farthest) + this.half);
      const corners = this.isPerspective ? this.findCorners(1) : this.findCorners(0);
      for (const corner of corners) {
        const way = this.isPerspective ? subtract(corner, this.eye) : this.forward;
        const from = this.isPerspective ? this.eye : corner;
        const depth = (ground - from[2]) / way[2];
        // Parallel rays that begin below the ground meet it nowhere; next to them it is at 0.
        nearest = Math.min(
          nearest,
          this.isPerspective && depth < 0 ? Infinity : Math.max(depth, 0),
        );
        if (!(depth >= 0)) continue;
        farthest = Math.max(farthest, Math.min(depth, end));
      }
    }
    this.nearest = Math.max(this.cameraNear, Number.isFinite(nearest) ? nearest * (1 - 1e-6) : 0);
    this.near = this.reverses && this.isPerspective ? this.cameraNear : this.nearest;
    if (!this.isPerspective) {
      this.far = Math.max(farthest * 1.001, this.near + 1) + 0.01 * this.half;
    }
  }

  /** The homogeneous place where all rays start: the eye, or a direction back along them. */
  get apex() {
    return this.isPerspective ? [...this.eye, 1] : [...scale(this.forward, -1), 0];
  }

  /**
   * The corners of the picture at a depth: top left, bottom left, bottom right, top right.
   * @param {number} depth
   * @returns {Vec3[]}
   */
  findCorners(depth) {
    const tall = this.isPerspective ? this.half * depth : this.half;
    const wide = tall * this.aspect;
    const middle = move(this.eye, this.forward, depth);
    /** @type {(x: number, y: number) => Vec3} */
    const corner = (x, y) => move(move(middle, this.right, x * wide), this.up, y * tall);
    return [corner(-1, 1), corner(-1, -1), corner(1, -1), corner(1, 1)];
  }

  /**
   * The planes of the picture's four sides, (4, 4), inward.
   * @param {number} depth at which their corners are taken
   */
  findSides(depth) {
    const corners = this.findCorners(depth);
    return corners.flatMap((here, k) => {
      const ray = this.isPerspective ? subtract(here, this.eye) : this.forward;
      // Corners run counter-clockwise seen from the eye, so ray x edge points outward.
      const normal = unit(cross(subtract(corners[(k + 1) % 4], here), ray));
      return [...normal, -dot(normal, here)];
    });
  }

  /**
   * The planes of the view, (5, 4): near and four sides, inward, widened a little; no far plane.
   */
  findPlanes() {
    const corner = this.findCorners(this.near)[0];
    const planes = [...this.forward, -dot(this.forward, corner), ...this.findSides(this.near)];
    const slack = MARGIN * this.findSize();
    return planes.map((value, k) => (k % 4 === 3 ? value + slack : value));
  }

  /**
   * The planes around all segments from the near rectangle to a light (4,), inward: McGuire's
   * occlusion pyramid (umbra.volume.regions).
   * @param {ArrayLike<number>} light
   */
  findPyramid(light) {
    const corners = this.findCorners(this.near);
    const toLight = corners.map((c) => [0, 1, 2].map((k) => light[k] - light[3] * c[k]));
    const edges = corners.map((c, k) => subtract(corners[(k + 1) % 4], c));
    const reach = Math.max(...toLight.flat().map(Math.abs));
    const size = Math.max(...edges.flat().map(Math.abs));
    const rise = dot(this.forward, toLight[0]);
    const isOff = Math.abs(rise) > (light[3] ? 1e-9 * Math.max(reach, size) : 1e-12 * reach);
    const ahead = scale(this.forward, rise > 0 || !isOff ? 1 : -1);
    // The pyramid's box, too: no side of a thin pyramid parts it from a wide terrain far below.
    const normals = [...AXES, ...(isOff ? [ahead] : [ahead, scale(ahead, -1)])];
    const middle = scale(
      corners.reduce((a, b) => move(a, b, 1)),
      0.25,
    );
    edges.forEach((edge, k) => {
      const normal = cross(edge, isOff ? toLight[k] : this.forward);
      const tall = length(normal);
      if (tall <= 1e-12 * size * (isOff ? reach : 1)) return;
      const isOut = dot(normal, subtract(middle, corners[k])) < 0;
      normals.push(scale(normal, (isOut ? -1 : 1) / tall));
    });
    // A plane is valid if the whole pyramid is inside: move it until it is.
    const slack = MARGIN * this.findSize();
    return normals.flatMap((normal) => {
      const ends = corners.map((corner) => dot(normal, corner));
      if (light[3]) ends.push(dot(normal, light) / light[3]);
      else if (dot(normal, light) < -1e-12 * reach) return [];
      return [...normal, slack - Math.min(...ends)];
    });
  }

  /** The near rectangle's largest coordinate [m]. */
  findSize() {
    return Math.max(...this.findCorners(this.near).flat().map(Math.abs));
  }

  /**
   * From coordinates relative to the eye to clip space, (4, 4) row-major.
   * @param {number} [guard] how many times as wide and high as the picture the clip space is
   */
  findMatrix(guard = 1) {
    const { near, far, forward, reverses } = this;
    const tall = 1 / (guard * this.half);
    const x = [...scale(this.right, tall / this.aspect), 0];
    const y = [...scale(this.up, tall), 0];
    if (this.isPerspective) {
      // At infinity depth equals w exactly, so that nothing is clipped there.
      const z = reverses ? [0, 0, 0, near] : [...forward, -2 * near];
      return [...x, ...y, ...z, ...forward, 0];
    }
    const deep = far - near;
    const z = reverses
      ? [...scale(forward, -1 / deep), far / deep]
      : [...scale(forward, 2 / deep), -(far + near) / deep];
    return [...x, ...y, ...z, 0, 0, 0, 1];
  }

  /**
   * The corners of what is seen of a level plane, homogeneous and relative to the eye: 3 to 5, at
   * infinity along the horizon; none where it is not seen. All lie in view, so nothing is clipped.
   * @param {number} height of the plane above the eye [m]
   * @returns {number[][]}
   */
  findGround(height) {
    const corners = this.findCorners(this.isPerspective ? 1 : 0).map((c) => subtract(c, this.eye));
    if (!this.isPerspective) {
      if (Math.abs(this.forward[2]) < 1e-6) return [];
      return corners.map((corner) => {
        return [...move(corner, this.forward, (height - corner[2]) / this.forward[2]), 1];
      });
    }
    // A ray (x, y, z) meets the plane at (x, y, z) height / z.
    /** @type {number[][]} */
    const planes = [];
    corners.forEach((ray, k) => {
      const next = corners[(k + 1) % 4];
      if (ray[2] / height > 0) planes.push([...ray, ray[2] / height]);
      if (ray[2] / height > 0 !== next[2] / height > 0) {
        const level = move(ray, subtract(next, ray), ray[2] / (ray[2] - next[2]));
        planes.push([level[0], level[1], 0, 0]);
      }
    });
    return planes;
  }

  /**
   * The part of the picture that holds all that is seen past the horizon of a level plane: left,
   * foot, right and top from -1 to 1; null: nothing.
   * @param {number} height of the plane above the eye [m]
   */
  findSky(height) {
    if (!this.isPerspective) return [-1, -1, 1, 1];
    const rays = this.findGround(-height);
    if (!rays.length) return null;
    const x = rays.map((ray) => dot(ray, this.right) / (this.half * this.aspect));
    const y = rays.map((ray) => dot(ray, this.up) / this.half);
    const pixel = 2 / this.rows;
    const low = [Math.min(...x) - pixel, Math.min(...y) - pixel];
    return [...low, Math.max(...x) + pixel, Math.max(...y) + pixel];
  }

  /**
   * Whether all that is seen is seen from above a level.
   * @param {number} z
   */
  isAbove(z) {
    return this.findCorners(this.near).every((corner) => corner[2] > z);
  }

  /**
   * The ray through a pixel's place; (0, 0) is the picture's upper left corner.
   * @param {number} column
   * @param {number} row
   * @returns {{from: Vec3, towards: Vec3}}
   */
  findRay(column, row) {
    const x = ((2 * column) / this.columns - 1) * this.half * this.aspect;
    const y = (1 - (2 * row) / this.rows) * this.half;
    if (this.isPerspective) {
      return { from: this.eye, towards: move(move(this.forward, this.right, x), this.up, y) };
    }
    return { from: move(move(this.eye, this.right, x), this.up, y), towards: this.forward };
  }

  /**
   * Where a place is seen, in pixels; null behind the eye.
   * @param {Vec3} point
   */
  project(point) {
    const from = subtract(point, this.eye);
    const depth = this.isPerspective ? dot(from, this.forward) : 1;
    if (!(depth > 0)) return null;
    const tall = this.half * depth;
    const [x, y] = [dot(from, this.right) / (tall * this.aspect), dot(from, this.up) / tall];
    return { x: ((x + 1) * this.columns) / 2, y: ((1 - y) * this.rows) / 2 };
  }
}

/**
 * Whether a box lies wholly beyond one of some planes.
 * @param {ArrayLike<number>} planes
 * @param {Float64Array} boxes
 * @param {number} at where the box begins
 */
export function isBeyond(planes, boxes, at) {
  for (let p = 0; p < planes.length; p += 4) {
    const [a, b, c] = [planes[p], planes[p + 1], planes[p + 2]];
    const x = boxes[at + (a > 0 ? 3 : 0)];
    const y = boxes[at + (b > 0 ? 4 : 1)];
    const z = boxes[at + (c > 0 ? 5 : 2)];
    if (a * x + b * y + c * z + planes[p + 3] < 0) return true;
  }
  return false;
}
