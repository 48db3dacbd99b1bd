// The hours of sun of an interval, in the picture: coarsely while things change, then in full.
//
// A change of the view, the date or the parts counts few pixels and as many instants as the card
// counts in a moment. At rest the interval's instants are counted at each pixel, in batches that
// leave the page responsive, and then those of the rest of the day: an interval that changes needs
// no new volumes.

import { findInstant } from "./clock.js";
import { findSteps, findWithin, spread, STEP } from "./steps.js";
import { SunMasks } from "./sun_masks.js";

const COARSE = 1 / 3; // pixels along an edge while things change
const MOMENT = 100; // that a coarse count, or a batch, may take [ms]
const LEAST = 4; // instants of a coarse count
const REST = 200; // from the last change to the full count [ms]
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
    /** what the full masks were begun for */
    this.begun = "";
    /** which instants the shown sums hold */
    this.summed = "";
    this.cost = 20; // of an instant in a coarse count [ms]
    this.batch = 4;
    this.timer = 0;
    this.looking = 0;
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

  /** Whether what is shown is counted at each pixel and instant. */
  get isWhole() {
    return this.layer !== null && this.layer.masks === this.masks?.fine;
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
    const key = this.#tellView(state);
    if (key !== this.key) {
      this.key = key;
      this.summed = this.begun = "";
      this.#plan(REST);
    }
    const { fine, coarse } = this.masks,
      sums = `${this.wanted[0]} ${this.wanted.length}`;
    const isWhole = this.begun === key && this.wanted.every((k) => fine.isCounted[k]);
    if (this.summed === `${sums} ${isWhole}`) return this.layer;
    this.summed = `${sums} ${isWhole}`;
    if (isWhole) {
      this.layer = this.#sum(fine, this.wanted);
      return this.layer;
    }
    this.#plan(REST);
    const batch = spread(this.wanted, Math.max(LEAST, Math.floor(MOMENT / this.cost)));
    coarse.begin(
      COARSE * (window.devicePixelRatio || 1),
      batch.map((k) => this.steps[k].direction),
    );
    const begun = performance.now();
    batch.forEach((_, at) => coarse.count(at));
    this.#await(() => (this.cost = (performance.now() - begun) / Math.max(batch.length, 1)));
    this.layer = this.#sum(coarse, [...batch.keys()]);
    return this.layer;
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
    this.key = this.begun = this.summed = ""; // the picture's masks are not the page's
    fine.begin(ratio, this.#directions());
    for (const k of this.wanted) fine.count(k);
    this.layer = this.#sum(fine, this.wanted);
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
      this.key = "";
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

  /** Count a batch of instants at each pixel: the interval's first, evenly spread. */
  #refine() {
    const { masks, renderer, steps, key, turn } = this;
    if (!masks || renderer.isLost) return;
    const { fine } = masks;
    if (this.begun !== key) {
      fine.begin(window.devicePixelRatio || 1, this.#directions());
      this.begun = key;
    }
    const isOpen = (/** @type {number} */ k) => !fine.isCounted[k];
    const own = this.wanted.filter(isOpen),
      others = steps.map((_, k) => k).filter(isOpen);
    const next = spread(own.length ? own : others, this.batch);
    if (!next.length) return;
    const begun = performance.now();
    for (const k of next) fine.count(k);
    this.#await(() => {
      const cost = (performance.now() - begun) / next.length;
      this.batch = Math.max(1, Math.min(32, Math.round(MOMENT / cost)));
      if (this.turn !== turn) return;
      if (own.length && own.length === next.length) this.app.redraw();
      this.#refine();
    });
  }

  /**
   * Act when the card has done what it was asked for.
   * @param {() => void} act
   */
  #await(act) {
    const { gl } = this.renderer.device,
      fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (!fence) return;
    gl.flush();
    const look = () => {
      if (gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED) this.looking = setTimeout(look, LOOK);
      else {
        gl.deleteSync(fence);
        act();
      }
    };
    this.looking = setTimeout(look, LOOK);
  }

  #halt() {
    this.turn += 1;
    clearTimeout(this.timer);
  }

  /** Show no hours, and count none. */
  stop() {
    this.#halt();
    this.layer = null;
    this.key = this.summed = "";
  }
}
