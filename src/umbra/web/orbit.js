// Moving the view by mouse, fingers and keys, as Blender and Google Earth do.
//
// Left or middle button turns about the place under the pointer; right button, or Shift, takes
// hold of the ground; the wheel zooms towards the pointer. One finger turns, two hold the
// ground between them: they move, spread and twist it. Keys: see `KEYS`.

import { measure, move } from "./vectors.js";
import { blend, findEye, findRay, pan, turn, turnAbout, zoom } from "./viewpoint.js";

/**
 * @typedef {object} OrbitOptions
 * @property {Viewpoint} viewpoint
 * @property {[Vec3, Vec3]} bounds of the model
 * @property {number} north azimuth of true north in the plan [degrees]
 * @property {number | null} floor the eye stays above [m]
 * @property {(x: number, y: number) => Vec3 | null} find the place that is seen at a pixel
 * @property {(x: number, y: number, event: PointerEvent) => void} tap a click or tap, not a drag
 * @property {() => void} changed
 * @property {(viewpoint: Viewpoint) => Viewpoint} frame the whole model, from the same direction
 * @property {() => number} columns how many pictures of the same view stand side by side
 * @property {boolean} [takesWheel] whether the wheel zooms without Ctrl and before a click
 */

const TURN = 0.3; // [degrees a pixel]
const DRAG = 5; // pixels that make a click a drag
const NEAREST = 0.5,
  FARTHEST = 40; // distances [m], and in sizes of the model
const GLIDE = 350; // [ms]
const CLEAR = 0.5; // of the eye above the floor [m]

/** The keys, and what each does, for the help. */
export const KEYS = [
  ["Arrow keys", "turn"],
  ["Shift + arrow keys", "move"],
  ["+  −", "nearer, farther"],
  ["N", "north up"],
  ["T or 7", "from above"],
  ["1, 3", "from the south, from the east"],
  ["Home or 0", "the whole model"],
  ["F", "to the chosen place"],
  ["Enter", "choose the place in the middle"],
];

export class Orbit {
  /** @param {HTMLElement} element @param {OrbitOptions} options */
  constructor(element, options) {
    this.element = element;
    this.options = options;
    this.viewpoint = options.viewpoint;
    /** @type {Map<number, {x: number, y: number}>} */
    this.fingers = new Map();
    /** @type {Vec3 | null} */
    this.held = null;
    this.dragged = 0;
    this.wheeled = 0;
    /** whether it was clicked and has the focus since: else the wheel is the page's */
    this.isTaken = false;
    this.gliding = 0;
    this.most = 0;
    this.stop = new AbortController();
    const listen = (/** @type {string} */ type, /** @type {(event: any) => void} */ act) =>
      element.addEventListener(type, act, { signal: this.stop.signal, passive: false });
    listen("pointerdown", (event) => this.#press(event));
    listen("pointermove", (event) => this.#drag(event));
    listen("pointerup", (event) => this.#lift(event));
    listen("pointercancel", (event) => this.#lift(event));
    listen("blur", () => (this.isTaken = false));
    listen("wheel", (event) => this.#wheel(event));
    listen("dblclick", (event) => this.#approach(event));
    listen("contextmenu", (event) => event.preventDefault());
    listen("keydown", (event) => this.key(event));
  }

  /**
   * Look from elsewhere at once.
   * @param {Viewpoint} viewpoint
   */
  set(viewpoint) {
    const size = Math.max(measure(...this.options.bounds), 1);
    const distance = Math.max(NEAREST, Math.min(FARTHEST * size, viewpoint.distance));
    this.viewpoint = { ...viewpoint, distance };
    this.#stayAbove();
    this.options.changed();
  }

  /**
   * Look from elsewhere, gliding there where motion is welcome.
   * @param {Viewpoint} viewpoint
   */
  glide(viewpoint) {
    cancelAnimationFrame(this.gliding);
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) return this.set(viewpoint);
    const from = this.viewpoint,
      start = performance.now();
    const step = (/** @type {number} */ now) => {
      const t = Math.max(0, Math.min(1, (now - start) / GLIDE)),
        eased = t * t * (3 - 2 * t);
      this.set(blend(from, viewpoint, eased));
      if (t < 1) this.gliding = requestAnimationFrame(step);
    };
    this.gliding = requestAnimationFrame(step);
  }

  /** Show the whole model, from the same direction. */
  showAll() {
    this.glide(this.options.frame(this.viewpoint));
  }

  /**
   * Look from a side of the model.
   * @param {number} heading @param {number} tilt [degrees]
   */
  look(heading, tilt) {
    const { viewpoint, options } = this,
      turned = { ...viewpoint, heading, tilt },
      { target, distance } = options.frame(viewpoint);
    // Who sees the whole model, and nothing nearer, sees all of it from there, too.
    const isWhole =
      measure(viewpoint.target, target) < 0.02 * distance &&
      viewpoint.distance > 0.98 * distance;
    this.glide(isWhole ? options.frame(turned) : turned);
  }

  /** @param {number} times above 1 to come nearer */
  approach(times) {
    this.set(zoom(this.viewpoint, times));
  }

  /**
   * Look at a place, from nearer.
   * @param {Vec3} point
   */
  goTo(point) {
    const size = Math.max(measure(...this.options.bounds), 1);
    this.glide({
      ...this.viewpoint,
      target: point,
      distance: Math.min(this.viewpoint.distance, size / 6),
    });
  }

  dispose() {
    this.stop.abort();
    cancelAnimationFrame(this.gliding);
  }

  /** Keep the eye above the floor by tilting the view. */
  #stayAbove() {
    const { floor } = this.options,
      view = this.viewpoint;
    if (floor === null || findEye(view)[2] >= floor + CLEAR) return;
    if (view.target[2] < floor) view.target = [view.target[0], view.target[1], floor];
    const sine = (view.target[2] - floor - CLEAR) / view.distance;
    view.tilt = Math.min(view.tilt, Math.asin(Math.max(-1, Math.min(1, sine))) * (180 / Math.PI));
  }

  /**
   * The place that a pointer holds: on the model, or as far as the target.
   * @param {number} x @param {number} y @returns {Vec3}
   */
  #findHold(x, y) {
    return (
      this.options.find(x, y) ??
      this.#reach(x, y)
    );
  }

  /**
   * The place at the target's depth under a pixel.
   * @param {number} x @param {number} y of the element
   */
  #reach(x, y) {
    const { from, towards } = this.#ray(x, y);
    return move(from, towards, 1);
  }

  /** @param {number} x @param {number} y of the element */
  #ray(x, y) {
    const { clientWidth, clientHeight: high } = this.element;
    const wide = clientWidth / this.options.columns(),
      across = (((x % wide) + wide) % wide) / wide;
    return findRay(this.viewpoint, 2 * across - 1, 1 - (2 * y) / high, wide / high);
  }

  /**
   * Let the place that is held follow the pointer: level where one looks down, else in the
   * picture's plane.
   * @param {number} x @param {number} y @param {number} dx @param {number} dy
   */
  #follow(x, y, dx, dy) {
    const { from, towards } = this.#ray(x, y),
      held = this.held;
    const t = held ? (held[2] - from[2]) / towards[2] : -1;
    const is = move(from, towards, t),
      far = 4 * this.viewpoint.distance;
    if (held && this.viewpoint.tilt < -12 && t > 0 && measure(is, held) < far) {
      this.set({ ...this.viewpoint, target: move(this.viewpoint.target, move(held, is, -1)) });
    } else {
      const high = this.element.clientHeight;
      this.set(pan(this.viewpoint, -dx / high, dy / high));
    }
  }

  /**
   * Place of an event in the element.
   * @param {PointerEvent | WheelEvent | MouseEvent} event
   */
  #at(event) {
    const box = this.element.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** @param {PointerEvent} event */
  #press(event) {
    cancelAnimationFrame(this.gliding);
    this.isTaken = true;
    const at = this.#at(event);
    this.fingers.set(event.pointerId, at);
    this.element.setPointerCapture(event.pointerId);
    if (this.fingers.size === 1) this.dragged = this.most = 0;
    this.most = Math.max(this.most, this.fingers.size);
    const { x, y } = this.#middle();
    this.held = this.#findHold(x, y);
  }

  #middle() {
    const fingers = [...this.fingers.values()];
    const sum = fingers.reduce((a, b) => ({ x: a.x + b.x, y: a.y + b.y }));
    return { x: sum.x / fingers.length, y: sum.y / fingers.length };
  }

  /** Distance and direction between two fingers. */
  #spread() {
    const [a, b] = [...this.fingers.values()];
    return {
      apart: Math.hypot(a.x - b.x, a.y - b.y) || 1,
      angle: Math.atan2(b.y - a.y, b.x - a.x),
    };
  }

  /** @param {PointerEvent} event */
  #drag(event) {
    const was = this.fingers.get(event.pointerId);
    if (!was) return;
    const at = this.#at(event),
      dx = at.x - was.x,
      dy = at.y - was.y;
    const before = this.fingers.size === 2 ? this.#spread() : null;
    this.fingers.set(event.pointerId, at);
    this.dragged += Math.hypot(dx, dy);
    if (this.dragged < DRAG) return;
    if (before && this.held) {
      const after = this.#spread(),
        { x, y } = this.#middle();
      const twist = (after.angle - before.angle) * (180 / Math.PI);
      const view = turnAbout(this.viewpoint, ((twist + 540) % 360) - 180, 0, this.held);
      this.set(zoom(view, after.apart / before.apart, this.held));
      this.#follow(x, y, dx / 2, dy / 2);
    } else if (this.fingers.size === 1) {
      if (event.buttons & 4 && event.ctrlKey) this.set(zoom(this.viewpoint, Math.exp(-dy * 0.006)));
      else if (event.shiftKey || event.buttons & 2) this.#follow(at.x, at.y, dx, dy);
      else
        this.set(
          turnAbout(this.viewpoint, dx * TURN, -dy * TURN, this.held ?? this.viewpoint.target),
        );
    }
  }

  /** @param {PointerEvent} event */
  #lift(event) {
    if (!this.fingers.delete(event.pointerId)) return;
    const isTap =
      event.type === "pointerup" && this.most === 1 && this.dragged < DRAG && event.button === 0;
    if (this.fingers.size) {
      const { x, y } = this.#middle();
      this.held = this.#findHold(x, y);
    } else if (isTap) {
      const { x, y } = this.#at(event);
      this.options.tap(x, y, event);
    }
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    if (!(event.ctrlKey || event.metaKey || this.options.takesWheel || this.isTaken)) return;
    event.preventDefault();
    const { x, y } = this.#at(event);
    // The place is found once a gesture: zooming keeps it under the pointer.
    if (event.timeStamp - this.wheeled > 250) this.held = this.#findHold(x, y);
    this.wheeled = event.timeStamp;
    const pixels = event.deltaY * [1, 16, 400][event.deltaMode];
    const times = Math.exp(
      -Math.max(-240, Math.min(240, pixels)) * (event.ctrlKey ? 0.008 : 0.002),
    );
    this.set(zoom(this.viewpoint, times, this.held ?? this.viewpoint.target));
  }

  /** @param {MouseEvent} event */
  #approach(event) {
    const { x, y } = this.#at(event),
      point = this.options.find(x, y);
    if (point)
      this.glide({
        ...this.viewpoint,
        target: point,
        distance: this.viewpoint.distance / (event.shiftKey ? 0.5 : 2),
      });
  }

  /**
   * Do what a key asks for, on the picture or on a slider beside it.
   * @param {KeyboardEvent} event
   */
  key(event) {
    if (event.altKey || event.metaKey || event.ctrlKey) return;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[
      event.key
    ];
    if (arrow && event.shiftKey) this.set(pan(this.viewpoint, arrow[0] * 0.05, arrow[1] * 0.05));
    else if (arrow) this.set(turn(this.viewpoint, -arrow[0] * 5, -arrow[1] * 3));
    else if (event.key === "+" || event.key === "=") this.approach(1.25);
    else if (event.key === "-") this.approach(0.8);
    else if (event.key === "n" || event.key === "N")
      this.look(this.options.north, this.viewpoint.tilt);
    else if (event.key === "t" || event.key === "7") this.look(this.options.north, -89.9);
    else if (event.key === "1") this.look(this.options.north, -20);
    else if (event.key === "3") this.look(this.options.north - 90, -20);
    else if (event.key === "Home" || event.key === "0") this.showAll();
    else return;
    event.preventDefault();
  }
}
