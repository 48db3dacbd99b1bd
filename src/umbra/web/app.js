// The live model: its picture, its controls, and one state that both show.
//
// Data flows one way: a control or a gesture sets the state; a frame later the picture and the
// controls are brought to it.

import { nameZone, tellDate, tellMinutes } from "./clock.js";
import { Daylight, tellSun } from "./daylight.js";
import { fill } from "./dom.js";
import { makeFrame } from "./frame.js";
import { layHours } from "./hours.js";
import { isShortcut } from "./keys.js";
import { describeHours } from "./legend.js";
import { findOpening } from "./opening.js";
import { makeMove } from "./move_panel.js";
import { isMoved, Proposal, tellMove } from "./moved.js";
import { Orbit } from "./orbit.js";
import { Dome, isUp } from "./paths.js";
import { findShown, listThings, makeParts } from "./parts.js";
import { findSunlight, isLit } from "./place.js";
import { makePlacePanel } from "./place_panel.js";
import { makeShare } from "./share.js";
import { makeSkyPanel } from "./sky_panel.js";
import { SunHours } from "./sun_hours.js";
import { Stage } from "./stage.js";
import { fromLink, toFile, toLink } from "./state.js";
import { makeTimebar } from "./timebar.js";
import { findBuilt, findDense, findRise, frame, isPlan } from "./viewpoint.js";
import { makeYearPanel } from "./year_panel.js";
import { findPlane, makeDrawn, makeHours, makeMeasure, makeSection } from "./tools.js";

const SPARSE =
  "The objects stand far apart: the view opens where most of them are; " +
  "the button with the house shows all.";
/** What of a state lies over the model's picture, which stays as it is. */
const OVER = new Set(["place", "begun", "distances", "tool"]);
const HIGHEST = -50; // tilt of a first view that is seen from higher up [degrees]
const STATE_DELAY = 400; // from a change to the address [ms]
let number = 0;

export class App {
  /**
   * @param {HTMLElement} root
   * @param {Model} model
   * @param {Config} config
   * @param {(state: State) => void} [notify] after each change
   */
  constructor(root, model, config, notify = () => {}) {
    this.id = ++number;
    this.root = root;
    this.model = model;
    this.config = config;
    this.notify = notify;
    const { site } = model;
    this.north = site?.trueNorth ?? 0;
    this.daylight = new Daylight(site);
    this.things = listThings(model);
    /** @type {number[]} object of each part */
    this.thingOf = [];
    this.things.forEach((thing, k) => {
      for (const part of thing.parts) this.thingOf[part] = k;
    });
    /** what a first view shows: all, or where most of it stands */
    const built = findBuilt(model),
      dense = findDense(model, this.thingOf, built);
    this.box = dense ?? built;
    this.notes = [...config.notes, ...(dense ? [SPARSE] : [])];
    const [low, high] = this.box;
    /** level ground, local [m] */
    this.ground = config.ground === null ? null : config.ground - model.origin[2];
    this.radius = Math.max(
      0.58 * Math.max(high[0] - low[0], high[1] - low[1]),
      high[2] - low[2],
      1,
    );
    const centre = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
    this.middle = /** @type {Vec3} */ ([
      ...centre,
      this.ground ?? findRise(model, centre, this.radius, low[2]),
    ]);
    this.revision = 0;
    const opening = findOpening(this);
    this.state = opening.state;
    this.sun = this.daylight.sun(this.state);
    /** @type {ArrayLike<number> | null} which parts cast before a change; null: all */
    this.before = null;
    /** @type {ArrayLike<number> | null} */
    this.after = null;
    /** @type {Record<'before' | 'after', ArrayLike<number> | null>} which are seen; null: all */
    this.seen = { before: null, after: null };
    this.hasChanges = false;
    this.plane = findPlane(this, this.state);
    this.#findParts();

    this.proposal = new Proposal(model);
    this.stage = new Stage(this);
    this.#put();
    this.sunHours = new SunHours(this);
    this.parts = makeParts(this);
    this.timebar = makeTimebar(this);
    this.place = makePlacePanel(this);
    this.sky = makeSkyPanel(this, this.place.findDays);
    this.year = makeYearPanel(this);
    this.move = makeMove(this);
    const share = makeShare(this);
    const hours = makeHours(this);
    this.panels = [
      this.timebar,
      this.place,
      this.sky,
      ...(this.year ? [this.year] : []),
      this.parts,
      this.move,
      ...(hours ? [hours] : []),
      makeMeasure(this),
      makeSection(this),
      makeDrawn(this),
      share,
    ];
    /** @type {Orbit} */
    this.orbit = new Orbit(this.stage.canvas, {
      viewpoint: this.state.viewpoint,
      bounds: built,
      floor: this.ground,
      north: this.north,
      takesWheel: config.takesWheel,
      columns: () => (this.state.compare === "beside" ? 2 : 1),
      frame: (viewpoint) => this.frameAll(viewpoint, built),
      find: (x, y) => this.stage.renderer.pick(x, y)?.position ?? null,
      tap: (x, y) => this.choose(x, y),
      changed: () => this.set({ viewpoint: this.orbit.viewpoint }),
    });
    this.frame = makeFrame(
      this,
      this.panels.slice(1).map((panel) => panel.element),
      share.keys,
    );
    this.stage.renderer.ground = this.ground;
    this.timebar.update(this.state); // it is as high now as it stays: the picture is drawn once
    this.#layHours();
    if (!opening.isLinked && config.isFramed) this.orbit.set(this.#open());
    this.listening = new AbortController();
    const { signal } = this.listening;
    this.stage.canvas.addEventListener("keydown", (event) => this.#key(event), { signal });
    // A page of its own takes keys wherever the focus is; in a notebook other cells have their own.
    const whole = config.hasLink ? document : this.root;
    whole.addEventListener("keydown", (event) => this.#keyElsewhere(/** @type {KeyboardEvent} */ (event)), { signal });
    if (config.hasLink)
      addEventListener("hashchange", () => this.#follow(location.hash), { signal });
    // Its first call may tell the size that has just been drawn.
    this.watch = new ResizeObserver(() => this.stage.isFitted || this.redraw());
    this.watch.observe(this.stage.canvas);
    this.redraw();
  }

  /** Width over height of each picture: two stand side by side. */
  get aspect() {
    const { wide, high } = this.stage.size;
    return wide / (this.state.compare === "beside" ? 2 : 1) / high;
  }

  /**
   * Look at a box with the compass and the sun's path of the date whole.
   * @param {Viewpoint} viewpoint @param {[Vec3, Vec3]} box
   */
  frameAll(viewpoint, box) {
    const { hasPath, hasCompass, date } = this.state,
      dome = new Dome({ ...viewpoint, distance: 1e9 }, this.middle, this.radius, this.north);
    const suns = (hasPath && this.daylight.day(date)?.path.filter(isUp)) || [],
      winds = hasCompass ? [0, 1, 2, 3, 4, 5, 6, 7] : [];
    return frame(viewpoint, box, this.aspect, [
      ...suns.map((sun) => dome.at(sun, 1.06)),
      ...winds.map((wind) => dome.onRing(45 * wind, 1.1)),
    ]);
  }

  /** The first view: in a picture that is high, from higher up, so that the model fills it. */
  #open() {
    let view = this.frameAll(this.state.viewpoint, this.box);
    while (!isPlan(view) && view.tilt > HIGHEST) {
      const next = this.frameAll({ ...view, tilt: view.tilt - 2 }, this.box);
      if (next.distance > view.distance) break;
      view = next;
    }
    return view;
  }

  /** When the picture becomes narrower or wider, as much of the model stays in it. */
  #fitAspect() {
    const {
        aspect,
        state: { viewpoint },
      } = this,
      was = this.framedAspect;
    this.framedAspect = aspect;
    if (!was || Math.abs(aspect / was - 1) < 1e-3) return;
    const [before, after] = [was, aspect].map((parts) => frame(viewpoint, this.box, parts).distance);
    this.orbit.set({ ...viewpoint, distance: (viewpoint.distance * after) / before });
  }

  framedAspect = 0;

  /**
   * Change the state; everything follows at the next frame.
   * @param {Partial<State>} changes
   */
  set(changes) {
    const { state } = this;
    this.state = { ...state, ...changes };
    if (changes.standing || changes.compare) {
      this.revision++;
      this.#findParts();
    }
    if (changes.standing && !this.hasChanges && this.state.compare !== "after")
      this.state.compare = "after";
    if (changes.standing || changes.move) this.#put();
    if (changes.section !== undefined) this.plane = findPlane(this, this.state);
    const isAway = isMoved(this.state.move);
    if (this.state.hasHours !== state.hasHours || isAway !== isMoved(state.move)) this.#layHours();
    this.sun = this.daylight.sun(this.state);
    this.redraw(Object.keys(changes).some((name) => !OVER.has(name)));
  }

  /**
   * Draw at the next frame.
   * @param {boolean} [isModel] whether the model's picture changes, too, not only what lies over it
   */
  redraw(isModel = true) {
    this.isStale ||= isModel;
    if (this.waits) return;
    this.waits = requestAnimationFrame((now) => {
      this.waits = 0;
      const plays = this.timebar.play(now);
      this.#fitAspect();
      this.#update();
      if (plays) this.redraw();
    });
  }

  waits = 0;
  isStale = true;

  #update() {
    const { state } = this;
    if (this.isStale) this.stage.draw(state);
    else this.stage.drawSigns(state);
    this.isStale = false;
    for (const panel of this.panels) panel.update(state);
    this.frame.update(state);
    this.notify(state);
    if (!this.config.hasLink) return;
    clearTimeout(this.saving);
    this.saving = setTimeout(() => {
      if (!this.state.playing)
        history.replaceState(null, "", `#${toLink(this.state, this.model.origin)}`);
    }, STATE_DELAY);
  }

  saving = 0;

  /** Bring the proposal to its place. */
  #put() {
    const { standing, move } = this.state;
    const parts = [...standing].flatMap(([k, status]) => (status === "proposed" ? this.things[k].parts : []));
    const moved = this.proposal.put(parts, move);
    if (!moved) return;
    this.revision++;
    this.stage.renderer.remake(moved.faces, moved.turned, move.turn);
  }

  #findParts() {
    const { standing } = this.state,
      count = this.model.parts.length;
    const { no_cast: silent = [] } = this.config.view;
    for (const state of /** @type {const} */ (["before", "after"])) {
      const shown = findShown(this.things, standing, state === "after", count);
      this.seen[state] = shown;
      this[state] = silent.length
        ? (shown ?? new Uint8Array(count).fill(1)).map((isShown, part) =>
            silent.includes(part) ? 0 : isShown,
          )
        : shown;
    }
    this.hasChanges = [...standing.values()].some((status) => status === "proposed" || status === "removed");
  }

  /**
   * Whether the chosen place is in the sun now; null at night or without a place.
   * @param {boolean} isAfter
   */
  isLit(isAfter) {
    const { place } = this.state;
    if (!place || this.sun.altitude <= 0) return null;
    if (this.sun.isBehind) return false;
    return isLit(this.model, place, this.sun.direction, isAfter ? this.after : this.before);
  }

  /**
   * Find when the sun reaches a place on a date; null without a site.
   * @param {Place} place
   * @param {string} date
   * @param {Mask} parts that cast; null: all
   */
  findSunlight(place, date, parts) {
    const { site } = this.daylight,
      day = this.daylight.day(date);
    return site && day ? findSunlight(this.model, site, day, place, parts) : null;
  }

  /** The view as a file, which umbra reads, too. */
  describe() {
    return toFile(this.state, this.model.origin, this.config.view);
  }

  /**
   * The days of the longest, the shortest and an even path in a date's year.
   * @param {string} date
   */
  solstices(date) {
    const year = date.slice(0, 4);
    return ["06-21", "12-21", "03-20"].flatMap((day) => this.daylight.day(`${year}-${day}`) ?? []);
  }

  /**
   * Choose the place at a pixel, or measure from and to it.
   * @param {number} x @param {number} y
   */
  choose(x, y) {
    const place = this.stage.renderer.pick(x, y),
      { state } = this;
    if (state.tool !== "measure") {
      this.set({ place });
      return;
    }
    if (!place) return;
    if (!state.begun) this.set({ begun: place.position });
    else this.set({ begun: null, distances: [...state.distances, [state.begun, place.position]] });
  }

  /**
   * A PNG of the picture with its caption.
   * @param {number} [times] as many pixels along an edge as on the screen
   */
  shoot(times = 1) {
    return this.stage.shoot(this.state, () => this.tellView(), times);
  }

  /** Title, date, time and sun in one line. */
  tellView() {
    const { state, sun, config } = this,
      { site } = this.daylight;
    const when = site
      ? `${tellDate(state.date)}, ${tellMinutes(state.minutes)} ${nameZone(site.zone, this.daylight.instant(state))}`
      : "";
    const hours = state.hasSunHours && describeHours(this);
    return [
      config.title,
      tellMove(this.proposal),
      ...(hours
        ? [`${hours.title}, ${hours.when}`]
        : [when, tellSun(sun)]),
      "umbra",
    ]
      .filter(Boolean)
      .join(" · ");
  }

  dispose() {
    cancelAnimationFrame(this.waits);
    clearTimeout(this.saving);
    this.listening.abort();
    this.watch.disconnect();
    this.orbit.dispose();
    this.sunHours.dispose();
    this.stage.dispose();
    this.sky.dispose();
    fill(this.root);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const { wide, high } = this.stage.size;
    if (event.key === "Enter")
      this.choose(this.state.compare === "beside" ? (3 * wide) / 4 : wide / 2, high / 2);
    else if (event.key === "Escape")
      this.set({ begun: null, tool: "choose", ...(this.state.tool === "choose" ? { place: null } : {}) });
    else if (event.key === "f" && this.state.place) this.orbit.goTo(this.state.place.position);
    else if (event.key === " ") this.set({ playing: this.state.playing ? null : "day" });
    else return;
    event.preventDefault();
  }

  /**
   * The picture's shortcuts while something else has the focus, which keeps its own keys.
   * @param {KeyboardEvent} event
   */
  #keyElsewhere(event) {
    if (event.target === this.stage.canvas || !isShortcut(event, this.root)) return;
    if (!event.altKey && !event.metaKey && !event.ctrlKey) this.#key(event);
    if (!event.defaultPrevented) this.orbit.key(event);
  }

  /** @param {string} link */
  #follow(link) {
    const { model, things } = this;
    if (link.replace(/^#/, "") === toLink(this.state, model.origin)) return;
    const state = fromLink(link, model.origin, things.length, model.parts.length);
    this.set(state);
    if (state.viewpoint) this.orbit.set(state.viewpoint);
  }

  async #layHours() {
    const { hours } = this.config,
      isShown = () => hours && this.state.hasHours && !isMoved(this.state.move);
    const overlay = hours && isShown() ? await layHours(hours, this.config.palette, this.model) : null;
    if (overlay && !isShown()) return;
    this.stage.renderer.setOverlay(overlay);
    this.redraw();
  }
}
