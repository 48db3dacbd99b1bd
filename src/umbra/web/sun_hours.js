// The hours of sun of an interval, in the picture: coarsely while things change, then in full.
//
// While the view moves, few pixels and as many instants are counted as the card counts in a moment.
// At rest the interval's instants are counted at each pixel: some of them, evenly spread, are shown
// at once, and the others follow in batches that leave the page responsive. Then come those of the
// rest of the day: an interval that changes needs no new volumes.

import { findInstant } from "./clock.js";
import { findSteps, findWithin, spread, STEP } from "./steps.js";
import { SunMasks } from "./sun_masks.js";

const COARSE = 1 / 3; // pixels along an edge while things change
const MOMENT = 100; // that a coarse count, or a batch, may take [ms]
const LEAST = 4; // instants that are shown first
const MOVING = 500; // changes that follow each other so soon are a motion [ms]
const REST = 200; // from the last change of a motion to the full count [ms]
const QUEUED = 2; // batches that the card is given at a time, so that it waits for none
const LOOK = 5; // between looks whether a batch is counted [ms]

/** @typedef {import('./hour_pass.js').HourLayer} HourLayer */

export class SunHours {
  /** @param {App} app */
  constructor(app) {
    const { ramp, noSun } = app.config.palette;
    this.app = app;
    this.colors = [noSun, ...[...ramp].reverse()];
    /** @type {{coarse: SunMasks, fine: SunMasks} | null} */
    this.masks = null;
    this.key = "";
    /** the view and the interval that are shown; "": none */
    this.asked = "";
    /** when they last changed [ms] */
    this.changed = -Infinity;
    this.isMoving = false;
    /** what the full masks were begun for */
    this.begun = "";
    /** whether what is shown is counted at each pixel and instant */
    this.isWhole = false;
    /** of an instant [ms] */
    this.costs = { coarse: 20, fine: 25 };
    this.timer = 0;
    /** batches that are not counted yet, and when the last one was [ms] */
    this.queued = 0;
    this.done = 0;
    /** number of the full count: an older one ends */
    this.turn = 0;
    this.date = "";
    /** @type {import('./steps.js').Step[]} */
    this.steps = [];
    /** @type {number[]} the interval's */
    this.wanted = [];
    /** @type {HourLayer | null} */
    this.layer = null;
  }

  get renderer() {
    return this.app.stage.renderer;
  }

  /** Hours of the interval with the sun up [h]. */
  get most() {
    return (this.wanted.length * STEP) / 60;
  }

  /**
   * Count what a state asks for, and return what is drawn; null: light and shadow.
   * @param {State} state with the renderer's camera, views and section set to it
   * @returns {HourLayer | null}
   */
  find(state) {
    if (!this.#prepare(state) || !this.masks) return null;
    const { fine } = this.masks,
      key = this.#tellView(state),
      asked = `${key} ${this.wanted[0]} ${this.wanted.length}`,
      isNew = asked !== this.asked;
    if (isNew) this.#note(asked, key);
    else if (this.#isCounted === this.isWhole) return this.layer;
    this.isWhole = this.#isCounted;
    if (this.isWhole) this.layer = this.#sum(fine, this.wanted);
    else if (this.isMoving && this.begun !== key) this.layer = this.#countCoarsely();
    else this.layer = this.#countSome();
    this.#plan(this.isMoving || this.isWhole ? REST : 0);
    return this.layer;
  }

  /** Whether all instants that are asked for are counted at each pixel. */
  get #isCounted() {
    const { begun, key, masks, wanted } = this;
    return begun === key && wanted.every((k) => masks?.fine.isCounted[k]);
  }

  /**
   * Note that something else is asked for than before, and whether it moves.
   * @param {string} asked @param {string} key
   */
  #note(asked, key) {
    const now = performance.now(),
      camera = JSON.stringify(this.renderer.camera);
    const hasTurned = this.asked !== "" && camera !== this.camera;
    this.isMoving = hasTurned || now - this.changed < MOVING;
    Object.assign(this, { asked, camera, key, changed: now });
  }

  camera = "";

  /**
   * Some of the interval's instants, evenly spread: as many as are counted in a moment.
   * @param {'coarse' | 'fine'} how
   */
  #choose(how) {
    return spread(this.wanted, Math.max(LEAST, Math.floor(MOMENT / this.costs[how])));
  }

  /** Count some instants at few pixels. */
  #countCoarsely() {
    const { coarse } = /** @type {{coarse: SunMasks}} */ (this.masks),
      some = this.#choose("coarse");
    coarse.begin(
      COARSE * (window.devicePixelRatio || 1),
      some.map((k) => this.steps[k].direction),
    );
    const begun = performance.now();
    some.forEach((_, at) => coarse.count(at));
    this.#await(() => (this.costs.coarse = (performance.now() - begun) / Math.max(some.length, 1)));
    return this.#sum(coarse, [...some.keys()]);
  }

  /** Count some instants at each pixel, and draw them, or all if they are counted. */
  #countSome() {
    const { fine, some } = this.#countChosen();
    this.isWhole = this.#isCounted;
    return this.#sum(fine, this.isWhole ? this.wanted : some);
  }

  #countChosen() {
    const fine = this.#begin(),
      some = this.#choose("fine");
    for (const k of some) if (!fine.isCounted[k]) fine.count(k);
    return { fine, some };
  }

  /** The masks of all pixels, begun for the view. */
  #begin() {
    const { fine } = /** @type {{fine: SunMasks}} */ (this.masks);
    if (this.begun !== this.key) fine.begin(window.devicePixelRatio || 1, this.#directions(), this.wanted);
    this.begun = this.key;
    return fine;
  }

  /** Count the first instants before hours are asked for: a pointer is at what asks for them. */
  expect() {
    const state = { ...this.app.state, hasSunHours: true };
    if (this.app.state.hasSunHours || !this.#prepare(state)) return;
    this.key = this.#tellView(state);
    this.#countChosen();
    this.renderer.device.gl.flush();
  }

  /**
   * Count everything now, for a picture of any size.
   * @param {State} state
   * @param {number} ratio pixels in a CSS pixel
   * @returns {HourLayer | null}
   */
  findAll(state, ratio) {
    if (!this.#prepare(state) || !this.masks) return null;
    const { fine } = this.masks;
    this.#halt();
    this.asked = this.begun = ""; // the picture's masks are not the page's
    fine.begin(ratio, this.#directions(), this.wanted);
    for (const k of this.wanted) fine.count(k);
    this.layer = this.#sum(fine, this.wanted);
    this.isWhole = true;
    return this.layer;
  }

  /**
   * The hours at a pixel of the picture; null where nothing is seen or nothing is shown.
   * @param {number} x @param {number} y [CSS pixels]
   */
  read(x, y) {
    if (!this.layer) return null;
    const { masks, most } = this.layer,
      { width, height, clientWidth, clientHeight } = masks.sheet;
    const column = Math.floor((x / clientWidth) * width),
      row = height - 1 - Math.floor((y / clientHeight) * height);
    if (column < 0 || row < 0 || column >= width || row >= height) return null;
    const [lit] = masks.read(column, row, 1, 1);
    return lit < 0 ? null : (lit / most) * this.most;
  }

  /** End the count, and free its masks on the card. */
  dispose() {
    this.stop();
    if (!this.masks) return;
    this.masks.coarse.delete();
    this.masks.fine.delete();
    this.masks = null;
  }

  /**
   * Steps, interval and masks of a state; whether there are hours to show.
   * @param {State} state
   */
  #prepare(state) {
    const { site } = this.app.daylight,
      { renderer } = this;
    if (!state.hasSunHours || !site || renderer.isLost) {
      this.stop();
      return false;
    }
    if (this.masks?.fine.device !== renderer.device) {
      this.masks = { coarse: new SunMasks(renderer, true), fine: new SunMasks(renderer, false) };
      this.asked = this.begun = "";
    }
    if (this.date !== state.date) {
      this.date = state.date;
      this.steps = findSteps(site, state.date);
    }
    const [from, to] = state.interval.map((at) => findInstant(site.zone, state.date, at));
    this.wanted = findWithin(this.steps, from, to);
    return true;
  }

  #directions() {
    return this.steps.map(({ direction }) => direction);
  }

  /**
   * All that bits depend on.
   * @param {State} state
   */
  #tellView({ date, compare, swipe }) {
    const { app, renderer } = this,
      { wide, high } = app.stage.size;
    return JSON.stringify([
      renderer.camera, renderer.clip, renderer.ground, app.revision, date, compare, swipe,
      wide, high, window.devicePixelRatio,
    ]);
  }

  /**
   * @param {SunMasks} masks @param {number[]} instants
   * @returns {HourLayer}
   */
  #sum(masks, instants) {
    masks.sum(instants);
    return { masks, most: Math.max(instants.length, 1), colors: this.colors };
  }

  /**
   * Go on with the full count later.
   * @param {number} delay [ms]
   */
  #plan(delay) {
    this.#halt();
    this.timer = setTimeout(() => this.#refine(), delay);
  }

  /** Count batches of instants at each pixel: the interval's first, evenly spread. */
  #refine() {
    const { masks, renderer, steps, turn } = this;
    if (!masks || renderer.isLost) return;
    const fine = this.#begin(),
      isOpen = (/** @type {number} */ k) => !fine.isCounted[k];
    const isDone = () => this.#isCounted && !this.isWhole;
    while (!isDone() && this.queued < QUEUED) {
      const own = this.wanted.filter(isOpen),
        others = steps.map((_, k) => k).filter(isOpen);
      const size = Math.max(1, Math.min(32, Math.round(MOMENT / this.costs.fine)));
      const next = spread(own.length ? own : others, size);
      if (!next.length) return;
      const asked = performance.now();
      this.queued += 1;
      for (const k of next) fine.count(k);
      this.#await(() => {
        const now = performance.now();
        // A batch that is seen to end together with the one before tells nothing of its own cost.
        const cost = (now - Math.max(asked, this.done)) / next.length;
        this.costs.fine = Math.max(cost, this.costs.fine / 2);
        this.done = now;
        this.queued -= 1;
        if (this.turn === turn) this.#refine();
      });
    }
    if (!isDone()) return;
    this.#halt();
    this.app.redraw(); // the card draws it after what it was given to count
  }

  /**
   * Act when the card has done what it was asked for.
   * @param {() => void} act
   */
  #await(act) {
    const { gl } = this.renderer.device,
      fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (!fence) return act(); // the context is lost
    gl.flush();
    const look = () => {
      if (gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED) setTimeout(look, LOOK);
      else {
        gl.deleteSync(fence);
        act();
      }
    };
    setTimeout(look, LOOK);
  }

  #halt() {
    this.turn += 1;
    clearTimeout(this.timer);
  }

  /** Show no hours, and count none. */
  stop() {
    this.#halt();
    this.layer = null;
    this.asked = "";
    this.isWhole = false;
  }
}
