// The picture: the renderer's canvas below, lines and words on a canvas above it.

import { el } from "./dom.js";
import { describeHours } from "./legend.js";
import { Renderer } from "./renderer.js";
import { LEVELS, DrawQuality } from "./quality.js";
import { Dome } from "./paths.js";
import { SignPainter } from "./signs.js";
import { move } from "./vectors.js";
import { findAxes, findEye, findHeight, isPlan } from "./viewpoint.js";

/** @typedef {{sky: Vec3, horizon: Vec3, ground: Vec3}} Colors of the picture behind the model */

const DAY = /** @type {Colors} */ ({ sky: [0.55, 0.71, 0.9], horizon: [0.9, 0.93, 0.96], ground: [0.95, 0.93, 0.89] });
const DUSK = /** @type {Colors} */ ({ sky: [0.36, 0.42, 0.58], horizon: [0.93, 0.78, 0.62], ground: [0.7, 0.68, 0.68] });
const NIGHT = /** @type {Colors} */ ({ sky: [0.1, 0.12, 0.2], horizon: [0.22, 0.25, 0.34], ground: [0.36, 0.37, 0.42] });

/** How bright the sky is under the sun, as a photograph is exposed (umbra.scene.pale). */
const UNDER_SUN = 0.65;
const RISE = 0.72, // sine of the altitude below which the sun's light is raised
  BRIGHTEST = 1.7; // by how much at most: no sunlit wall turns white

/**
 * The light of a sun, so that level ground is as bright at all times of day and shadows stand out on
 * it: raised where the sun is low, and where it is too low for that, bent, so that the ground takes
 * no less and a wall before the sun no more.
 * @param {number} rise sine of its altitude
 */
const exposeSun = (rise) => {
  const intensity = Math.max(RISE / Math.max(rise, 1e-6), 1);
  if (intensity <= BRIGHTEST) return { intensity, bend: 1 };
  return { intensity: BRIGHTEST, bend: Math.log(RISE / BRIGHTEST) / Math.log(Math.max(rise, 1e-6)) };
};

const NARROW = 760; // as in page.css [CSS pixels]
const MOST_FINE = 9e6; // pixels with several samples each
const NIGHTFALL = -3; // altitude of the sun below which words are light [degrees]

/**
 * Mix two sets of colours.
 * @param {Colors} a @param {Colors} b @param {number} t
 */
const mix = (a, b, t) => {
  const blend = (/** @type {number[]} */ x, /** @type {number[]} */ y) =>
    /** @type {Vec3} */ (x.map((value, k) => value + (y[k] - value) * Math.max(0, Math.min(1, t))));
  return {
    sky: blend(a.sky, b.sky),
    horizon: blend(a.horizon, b.horizon),
    ground: blend(a.ground, b.ground),
  };
};

/**
 * Colours of sky and ground at an altitude of the sun [degrees].
 * @param {number} altitude
 */
const findColors = (altitude) =>
  altitude > 0 ? mix(DUSK, DAY, altitude / 12) : mix(DUSK, NIGHT, -altitude / 8);

/**
 * Part before from after in a picture that is saved, as the page does.
 * @param {CanvasRenderingContext2D} pen
 * @param {number} at @param {number} high [pixels] @param {number} unit pixels of a CSS pixel
 */
const drawDivider = (pen, at, high, unit) => {
  const x = Math.round(at);
  pen.fillStyle = "rgba(20, 20, 30, 0.55)";
  pen.fillRect(x - 2 * unit, 0, 4 * unit, high);
  pen.fillStyle = "#ffffff";
  pen.fillRect(x - unit, 0, 2 * unit, high);
  pen.font = `600 ${13 * unit}px system-ui, sans-serif`;
  pen.textBaseline = "middle";
  for (const [words, side] of /** @type {[string, number][]} */ ([
    ["Before", -1],
    ["After", 1],
  ])) {
    const wide = pen.measureText(words).width + 20 * unit;
    const left = side < 0 ? x - 26 * unit - wide : x + 26 * unit;
    pen.fillStyle = "rgba(255, 255, 255, 0.88)";
    pen.fillRect(left, 10 * unit, wide, 24 * unit);
    pen.fillStyle = "#1c1c22";
    pen.fillText(words, left + 10 * unit, 22 * unit);
  }
};

export class Stage {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    this.canvas = el("canvas", {
      class: "model",
      tabindex: 0,
      role: "application",
      "aria-label": `${app.config.title}: the model with its shadows. Arrow keys turn it, plus and minus come nearer, Enter chooses the place in the middle.`,
    });
    this.cover = el("canvas", { class: "signs", "aria-hidden": "true" });
    this.renderer = new Renderer(this.canvas, app.model, {});
    this.renderer.onrestored = () => app.redraw();
    this.quality = new DrawQuality(() => app.redraw());
    const pen = this.cover.getContext("2d");
    if (!pen) throw new Error("this browser draws no 2D canvas");
    this.pen = pen;
    /** The compass and the paths, which change with the date and the view. */
    this.lined = { key: "", lines: /** @type {Line[]} */ ([]) };
    this.hidden = { key: "", places: /** @type {Map<string, boolean>} */ (new Map()) };
    this.canvas.addEventListener("focus", () => app.redraw(false));
    this.canvas.addEventListener("blur", () => app.redraw(false));
  }

  /** Whether the last picture was drawn for the canvas as large as it is. */
  get isFitted() {
    const { wide, high } = this.size;
    return wide === this.drawn.wide && high === this.drawn.high;
  }

  drawn = { wide: 0, high: 0 };

  get size() {
    return { wide: this.canvas.clientWidth || 1, high: this.canvas.clientHeight || 1 };
  }

  /**
   * Bring the renderer to a state and draw.
   * @param {State} state
   * @param {number} [times] draw finely, even while things move, with so many times the pixels
   */
  draw(state, times = 0) {
    const { app, renderer } = this,
      { wide, high } = this.size,
      { viewpoint } = state;
    this.drawn = { wide, high };
    const near = Math.max(0.05, Math.min(viewpoint.distance / 200, 1));
    renderer.camera = { ...this.#findLens(viewpoint), target: viewpoint.target, near };
    const { altitude, direction, isBehind } = app.sun;
    const isLit = altitude > 0 && !isBehind;
    renderer.lights = isLit ? [{ direction, ...exposeSun(direction[2]) }] : [];
    renderer.setStyle({
      skylight: isLit && !state.hasSunHours ? UNDER_SUN : 1,
      ...(state.hasSunHours ? DAY : findColors(isBehind ? 0 : altitude)),
    });
    renderer.clip = app.plane;
    renderer.setViews(this.#findViews(state, wide, high));
    if (state.compare !== "swipe" && state.compare !== "beside") {
      renderer.setParts(app[state.compare], app.seen[state.compare]);
    }
    renderer.lines = this.#findLines(state, this.#makeDome(state));
    const now = performance.now(),
      dot = window.devicePixelRatio || 1;
    renderer.hours = times ? app.sunHours.findAll(state, dot * times) : app.sunHours.find(state);
    // Hours that are still being counted are drawn again soon: one sample will do, and no edges.
    const isPassing = renderer.hours !== null && !app.sunHours.isWhole;
    renderer.setStyle({ edges: state.hasEdges && !(isPassing && !app.sunHours.isMoving) });
    const level = times ? 0 : Math.max(this.quality.begin(now), Number(isPassing));
    const { samples, scale } = LEVELS[level];
    const ratio = dot * (times || scale);
    renderer.samples = ratio * ratio * wide * high > MOST_FINE ? 1 : samples;
    renderer.options.pixelRatio = ratio;
    renderer.draw();
    this.quality.watch(renderer.device.gl, level, now);
    this.drawSigns(state, times);
  }

  /** @param {State} state */
  #makeDome({ viewpoint }) {
    const { middle, radius, north } = this.app;
    return new Dome(viewpoint, middle, radius, north);
  }

  /** @param {State} state */
  #isNight(state) {
    return this.app.sun.altitude < NIGHTFALL && !state.hasSunHours;
  }

  /**
   * A plan shows its scale; other pictures that are saved, that of their middle.
   * @param {State} state
   */
  #findScale({ viewpoint }) {
    const isEverywhere = isPlan(viewpoint);
    if (!isEverywhere && !this.isSaved) return null;
    return { metres: findHeight(viewpoint) / this.size.high, isEverywhere };
  }

  isSaved = false;

  /**
   * The camera of a viewpoint; a plan's eye is above all, wherever the viewpoint's is.
   * @param {Viewpoint} viewpoint
   */
  #findLens(viewpoint) {
    const eye = findEye(viewpoint),
      [low, high] = this.app.model.bounds;
    if (!isPlan(viewpoint)) return { eye, fov: viewpoint.fov };
    eye[2] = Math.max(eye[2], high[2] + Math.max(1, high[2] - low[2]));
    return { eye, up: findAxes(viewpoint).up, height: findHeight(viewpoint) };
  }

  /** @param {State} state @param {Dome} dome */
  #findLines(state, dome) {
    const isNight = this.#isNight(state);
    const key = [state.hasCompass, state.hasPath, state.date, isNight, dome.isSky, ...dome.centre].join();
    if (key !== this.lined.key) {
      const { daylight } = this.app,
        day = daylight.day(state.date);
      const compass = state.hasCompass ? dome.drawCompass(isNight) : [];
      const paths = state.hasPath ? dome.drawPaths(day, this.app.solstices(state.date)) : [];
      this.lined = { key, lines: [...compass, ...paths] };
    }
    return state.hasPath ? [...this.lined.lines, ...dome.drawRay(this.app.sun)] : this.lined.lines;
  }

  /**
   * Whether the model stands before a place; kept while the view and the parts stay.
   * @param {State} state @param {Dome} dome
   * @param {ArrayLike<number> | null} parts that are seen; null: all
   */
  #findHidden(state, dome, parts) {
    const { app } = this,
      eye = findEye(state.viewpoint);
    const key = [app.revision, ...eye].join();
    if (key !== this.hidden.key) this.hidden = { key, places: new Map() };
    return (/** @type {Vec3} */ point) => {
      const name = `${point}|${parts ? parts === app.before : ""}`;
      let isHidden = this.hidden.places.get(name);
      if (isHidden === undefined) {
        const isOnDome = point[2] !== app.middle[2],
          reach = isOnDome && dome.isSky ? Infinity : 1;
        const [from, towards] = isPlan(state.viewpoint)
          ? [point, /** @type {Vec3} */ ([0, 0, 1])]
          : [eye, move(point, eye, -1)];
        isHidden = app.model.trace(from, towards, { cast: parts, reach: towards[2] === 1 ? Infinity : reach }).length > 0;
        this.hidden.places.set(name, isHidden);
      }
      return isHidden;
    };
  }

  /** @param {State} state @param {number} wide @param {number} high @returns {View[] | null} */
  #findViews({ compare, swipe }, wide, high) {
    const before = { cast: this.app.before, show: this.app.seen.before };
    const after = { cast: this.app.after, show: this.app.seen.after };
    const x = Math.round(compare === "swipe" ? wide * swipe : wide / 2);
    const left = /** @type {[number, number, number, number]} */ ([0, 0, x, high]);
    const right = /** @type {[number, number, number, number]} */ ([x, 0, wide - x, high]);
    if (compare === "swipe")
      return [
        { ...before, scissor: left },
        { ...after, scissor: right },
      ];
    if (compare === "beside")
      return [
        { ...before, viewport: left },
        { ...after, viewport: right },
      ];
    return null;
  }

  /**
   * Draw what lies over the model's picture: its names, places, distances, scale and legend.
   * @param {State} state @param {number} [times] as of `draw`
   */
  drawSigns(state, times = 0) {
    const { pen, cover, app } = this,
      { wide, high } = this.size,
      dome = this.#makeDome(state),
      dot = times ? (window.devicePixelRatio || 1) * times : Math.min(window.devicePixelRatio || 1, 3);
    if (cover.width !== Math.round(wide * dot)) cover.width = Math.round(wide * dot);
    if (cover.height !== Math.round(high * dot)) cover.height = Math.round(high * dot);
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, cover.width, cover.height);
    const isBeside = state.compare === "beside",
      width = isBeside ? wide / 2 : wide;
    for (let k = 0; k < (isBeside ? 2 : 1); k++) {
      pen.save();
      pen.setTransform(dot, 0, 0, dot, k * width * dot, 0);
      pen.beginPath();
      pen.rect(0, 0, width, high);
      pen.clip();
      const isAfter = isBeside ? k === 1 : state.compare !== "before";
      new SignPainter(pen, this.#findSigns(state, dome, isAfter), width, high).draw();
      pen.restore();
    }
  }

  /** @param {State} state @param {Dome} dome @param {boolean} isAfter @returns {Signs} */
  #findSigns(state, dome, isAfter) {
    const { app } = this;
    return {
      viewpoint: state.viewpoint,
      dome,
      sun: app.sun,
      day: app.daylight.day(state.date),
      isHidden: this.#findHidden(state, dome, app.seen[isAfter ? "after" : "before"]),
      isNight: this.#isNight(state),
      scale: this.#findScale(state),
      isNarrow: app.root.clientWidth <= NARROW,
      divider: state.compare === "swipe" ? Math.round(this.size.wide * state.swipe) : null,
      hasPath: state.hasPath,
      hasCompass: state.hasCompass,
      distances: state.distances,
      begun: state.begun,
      place: state.place && { position: state.place.position, lit: app.isLit(isAfter) },
      legend: isAfter || state.compare === "before" ? describeHours(app) : null,
      hasCross: this.canvas.matches(":focus-visible"),
    };
  }

  /**
   * The picture with its lines, and a caption below, as PNG.
   * @param {State} state @param {() => string} tell what the caption says
   * @param {number} times as many pixels along an edge as on the screen
   * @returns {Promise<Blob>}
   */
  shoot(state, tell, times) {
    const focused = this.canvas.matches(":focus-visible");
    if (focused) this.canvas.blur();
    const { wide, high } = this.size,
      dot = window.devicePixelRatio || 1;
    this.isSaved = true;
    // As large as the card draws; in this task, as the browser clears the canvas after it.
    this.draw(state, Math.min(times, this.renderer.device.largest / (dot * Math.max(wide, high))));
    this.isSaved = false;
    this.app.redraw();
    const { width, height } = this.canvas,
      line = Math.round((26 * width) / this.size.wide);
    const sheet = el("canvas", { width, height: height + line }),
      pen = sheet.getContext("2d");
    if (!pen) throw new Error("this browser draws no 2D canvas");
    pen.fillStyle = "#ffffff";
    pen.fillRect(0, 0, width, height + line);
    pen.drawImage(this.canvas, 0, 0);
    pen.drawImage(this.cover, 0, 0, width, height);
    if (state.compare === "swipe" || state.compare === "beside")
      drawDivider(pen, width * (state.compare === "swipe" ? state.swipe : 0.5), height, line / 26);
    pen.fillStyle = "#1c1c22";
    pen.font = `${Math.round(line * 0.52)}px system-ui, sans-serif`;
    pen.textBaseline = "middle";
    pen.fillText(tell(), line * 0.4, height + line / 2, width - line * 0.8);
    return new Promise((done, fail) =>
      sheet.toBlob(
        (blob) => (blob ? done(blob) : fail(new Error("the picture is empty"))),
        "image/png",
      ),
    );
  }

  dispose() {
    this.quality.stop();
    this.renderer.dispose();
  }
}
