// WebGL2 renderer: exact shadows by stencil shadow volumes.
//
//   model.js     what Python packed: places, faces, adjacency
//   view.js      a camera: matrix, planes, occlusion pyramid
//   placement.js each caster's case, by bounds
//   volumes.js   silhouettes in float64, as index lists
//   shadows.js   one light's volumes: uploaded, counted in the stencil
//   uniforms.js  what all programs take of a view
//   picking.js   what is seen at a place, counts read back
//   surfaces.js  what is drawn: faces, creases
//   device.js    WebGL2 itself; targets.js: what it draws into; ..._shaders.js: its programs
//   seen.js      faces that a view sees and a light reaches
//   sun_masks.js which instants of a day reach each pixel; hour_pass.js draws their sums
//
// A view is drawn as if nothing cast a shadow; then the first light's volumes are counted in the
// stencil, and faces are drawn again without its light where the count is not 0. Each further light
// is counted, too, and added where its count is 0.

import { pickPlace, readCounts } from "./picking.js";
import { findPageRectangle, findRatio, findRectangles, fitCanvas, narrow } from "./canvas.js";
import { Device } from "./device.js";
import { HourPass } from "./hour_pass.js";
import { Passes, SKYLIGHT } from "./passes.js";
import { Selection } from "./selection.js";
import { findPlace } from "./shadows.js";
import { Targets } from "./targets.js";
import { findCreases, makeBuffers, makeSurfaces, moveSurfaces } from "./surfaces.js";
import { findUniforms } from "./uniforms.js";
import { measure, move, scale, subtract } from "./vectors.js";
import { Sight } from "./view.js";

/** Radiance that a light of intensity 1 adds to a white face (umbra.scene). */
const EXPOSURE = 0.8;

/** @type {Required<Style>} as umbra's own pictures; linear where umbra's are */
const STYLE = {
  sky: [0.42, 0.6, 0.82],
  horizon: [0.86, 0.91, 0.95],
  ground: [0.5, 0.5, 0.48],
  skylight: 1,
  edge: [0.1, 0.1, 0.11],
  edges: true,
  background: true,
};

/**
 * Draws a model with its shadows into a canvas. Its properties and `set...` keep state, `draw` draws
 * it once; nothing is drawn on its own, and nothing is computed twice while it does not change.
 */
export class Renderer {
  // On the card: made by `begin`, again after a lost context.
  device = /** @type {Device} */ (/** @type {unknown} */ (null));
  buffers = /** @type {ReturnType<typeof makeBuffers>} */ (/** @type {unknown} */ (null));
  targets = /** @type {Targets} */ (/** @type {unknown} */ (null));
  passes = /** @type {Passes} */ (/** @type {unknown} */ (null));
  hourPass = /** @type {HourPass} */ (/** @type {unknown} */ (null));
  /** @type {Selection[]} */
  stages = [];

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Model} model
   * @param {RendererOptions} [options]
   */
  constructor(canvas, model, options = {}) {
    this.canvas = canvas;
    this.model = model;
    this.options = options;
    /** @type {(() => void) | null} called when the context is lost: nothing is drawn until restored */
    this.onlost = null;
    /** @type {(() => void) | null} called when it is restored: draw again */
    this.onrestored = null;
    /** @type {Statistics} */
    this.statistics = { milliseconds: 0, sides: 0, casters: 0, behind: 0 };
    this.samples = options.samples ?? 4;
    /** @type {Light[]} none: night, ambient light alone */
    this.lights = [];
    const [low, high] = model.bounds;
    const middle = scale(move(low, high, 1), 0.5);
    this.size = measure(high, low) || 1;
    /** @type {Camera} */
    this.camera = { eye: move(middle, [1, -1.4, 0.9], 0.7 * this.size), target: middle };
    /** @type {Mask} */
    this.cast = null;
    /** @type {Mask} */
    this.show = null;
    /** @type {View[]} */
    this.views = [{}];
    /** @type {number | null} z of an endless ground plane that receives shadows [m] */
    this.ground = null;
    /** @type {Overlay | null} */
    this.overlay = null;
    /**
     * A section: surfaces are drawn where a x + b y + c z + d >= 0; what is cut off still casts.
     * @type {[number, number, number, number] | null}
     */
    this.clip = null;
    /** @type {import('./hour_pass.js').HourLayer | null} drawn in place of light and shadow */
    this.hours = null;
    /** @type {Line[]} drawn after all else */
    this.lines = [];
    this.style = { ...STYLE, ...options.style };
    this.surfaces = makeSurfaces(model);
    this.creases = findCreases(model);
    /** @type {Map<string, Sight>} cameras of the last views */
    this.sights = new Map();
    this.isLost = false;
    this.lose = (/** @type {Event} */ event) => {
      event.preventDefault(); // else it is never restored
      this.isLost = true;
      this.onlost?.();
    };
    this.restore = () => {
      this.isLost = false;
      this.begin();
      this.onrestored?.();
    };
    canvas.addEventListener("webglcontextlost", this.lose);
    canvas.addEventListener("webglcontextrestored", this.restore);
    this.begin();
  }

  /** Put on the card what does not change. */
  begin() {
    this.device = new Device(this.canvas);
    this.buffers = makeBuffers(this.device, this.model, this.surfaces);
    this.stages = [];
    this.sights.clear();
    this.targets = new Targets(this.device);
    this.passes = new Passes(this.device);
    this.hourPass = new HourPass(this.device);
    this.hours = null;
    if (this.overlay) this.passes.overlays.set(this.overlay);
  }

  /**
   * Which parts cast and which are drawn, one number per part (0 or 1); null: all.
   * @param {Mask} cast
   * @param {Mask} [show] by default as `cast`
   */
  setParts(cast, show = cast) {
    this.cast = cast;
    this.show = show;
  }

  /**
   * Draw faces where the model has them now.
   * @param {number[]} changed faces that moved
   * @param {number[]} turned those of them that are turned from where they were packed
   * @param {number} angle [degrees]
   */
  remake(changed, turned, angle) {
    const { device, model, surfaces } = this,
      { gl } = device;
    this.packed ??= surfaces.vertices.slice(0);
    moveSurfaces(model, surfaces, this.packed, changed, new Set(turned), angle);
    for (const stage of this.stages) stage.delete();
    this.stages = [];
    this.sights.clear();
    gl.deleteBuffer(this.buffers.surface);
    gl.deleteBuffer(this.buffers.doubled);
    this.buffers = makeBuffers(device, model, surfaces);
  }

  /** @type {ArrayBuffer | null} vertices of surfaces before any move */
  packed = null;

  /** @param {View[] | null} views drawn in their order; null: one of the whole canvas */
  setViews(views) {
    this.views = views?.length ? views : [{}];
  }

  /** @param {Overlay | null} overlay */
  setOverlay(overlay) {
    this.overlay = overlay;
    this.passes.overlays.set(overlay);
  }

  /** @param {Style} style changes what it names */
  setStyle(style) {
    this.style = { ...this.style, ...style };
  }

  /** Draw one frame. Call it in the same task as `canvas.toBlob` for a screenshot. */
  draw() {
    const begun = performance.now();
    if (this.isLost || !fitCanvas(this.canvas, this.options.pixelRatio)) return;
    const { device, canvas, passes, samples } = this;
    const { gl } = device;
    // Linear light in 10 bits; in sRGB's 8, each sample would be encoded and decoded again, which
    // costs software half of a frame, but a canvas that is transparent needs more alpha than 2
    // bits.
    const format = this.style.background ? gl.RGB10_A2 : gl.SRGB8_ALPHA8;
    const target = this.targets.find(canvas, samples, format);
    this.statistics = { milliseconds: 0, sides: 0, casters: 0, behind: 0 };
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.enable(gl.SCISSOR_TEST);
    for (const view of this.views) this.drawView(view);
    gl.disable(gl.SCISSOR_TEST);
    gl.disable(gl.STENCIL_TEST);
    gl.disable(gl.DEPTH_TEST);
    target.resolve();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    passes.encode(target);
    this.statistics.milliseconds = performance.now() - begun;
  }

  /** Pixels of the canvas in a CSS pixel. */
  get ratio() {
    return findRatio(this.canvas);
  }

  /**
   * The camera of a view, in its pixels, with depth fitted to what is drawn; the same object while
   * none of these change.
   * @param {View} view
   * @param {import('./sun_masks.js').Sheet} [sheet] other pixels than the canvas's
   */
  findSight(view, sheet = this.canvas) {
    const { viewport } = findRectangles(sheet, view);
    const camera = view.camera ?? this.camera;
    const key = JSON.stringify([camera, viewport[2], viewport[3], this.ground]);
    let sight = this.sights.get(key);
    if (!sight) {
      if (this.sights.size > 7) this.sights.clear();
      sight = new Sight(camera, viewport[2], viewport[3], this.device.reverses);
      sight.fit(this.model.blocks, this.ground);
      this.sights.set(key, sight);
    }
    return sight;
  }

  /** @param {View} view */
  drawView(view) {
    const { viewport, scissor } = findRectangles(this.canvas, view);
    if (!(viewport[2] > 0 && viewport[3] > 0 && scissor[2] > 0 && scissor[3] > 0)) return;
    const { device, passes, style, hours } = this;
    const { gl } = device;
    const lights = hours ? [] : this.lights;
    const sight = this.findSight(view);
    const common = findUniforms(this, sight, device.setViewport(viewport));
    const stage = this.findStage(view);
    gl.scissor(scissor[0], scissor[1], scissor[2], scissor[3]);
    this.clear();
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);

    const shone = lights.map((light) => this.describe(light, sight));
    stage.look(sight, common.cutsInto, this.ground);
    if (hours) this.hourPass.draw(stage, common, hours, passes.nothing);
    else passes.drawSurfaces(stage, common, shone[0] ?? SKYLIGHT);
    if (this.clip) passes.drawCaps(stage, common, this.clip, this.size, move(...this.model.bounds));
    if (style.background) passes.drawSky(sight, common, style);
    lights.forEach((light, k) => {
      stage.shadows.prepare(light, sight, this.ground, Boolean(this.clip));
      const within = stage.shadows.findScissor(sight);
      if (within) gl.scissor(...narrow(viewport, scissor, within));
      if (k > 0) gl.clear(gl.STENCIL_BUFFER_BIT);
      stage.seen.listLit(stage.shadows.volumes.side);
      stage.shadows.count(sight, common);
      if (k > 0) passes.addLight(stage, common, shone[k]);
      else passes.drawShadow(stage, common);
      if (within) gl.scissor(scissor[0], scissor[1], scissor[2], scissor[3]);
      this.statistics.casters += stage.shadows.casters;
      this.statistics.behind += stage.shadows.behind;
      this.statistics.sides +=
        stage.shadows.volumes.zPass.wound.size + stage.shadows.volumes.zFail.wound.size;
    });
    gl.disable(gl.STENCIL_TEST);
    if (stage.seen.hasPanes) passes.drawPanes(stage, common, this.lights);
    passes.drawOver(stage, sight, common, style, !hours);
    passes.lines.draw(this.lines, sight, common, this.ratio);
  }

  /**
   * A light as programs take it, relative to the eye.
   * @param {Light} light
   * @param {Sight} sight
   */
  describe(light, sight) {
    const source = findPlace(light);
    const strength = (light.intensity ?? 1) * (EXPOSURE / Math.sqrt(this.lights.length));
    return {
      light: source[3] ? [...subtract(source, sight.eye), 1] : source,
      tint: (light.color ?? [1, 1, 1]).map((c) => strength * c),
      range: "position" in light ? (light.range ?? 1e9) : 0,
      bend: light.bend ?? 1,
    };
  }

  /** Clear depth and stencil in the scissor. */
  clear() {
    const { gl } = this.device;
    gl.depthMask(true);
    gl.stencilMask(255);
    gl.clearStencil(0);
    gl.clear(gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
  }

  /**
   * What is drawn for a view's parts; made when first asked for.
   * @param {View} view
   * @param {boolean} [isSolid] whether glass is drawn as a wall
   * @returns {Selection}
   */
  findStage(view, isSolid = false) {
    const cast = view.cast === undefined ? this.cast : view.cast;
    const show = view.show === undefined ? (view.cast === undefined ? this.show : cast) : view.show;
    const { stages, device, buffers } = this;
    const known = stages.find((stage) => stage.isOf(cast, show, isSolid));
    if (known) return known;
    if (stages.length >= 4) stages.shift()?.delete();
    const { model, creases, surfaces } = this;
    const shared = { device, model, creases, corners: surfaces.corners, ...buffers };
    const stage = new Selection(shared, cast, show, isSolid);
    stages.push(stage);
    return stage;
  }

  /** @param {number} x @param {number} y as `pickPlace` of picking.js */
  pick(x, y) {
    return pickPlace(this, x, y);
  }

  /**
   * Project a place to the canvas; null behind the eye.
   * @param {Vec3} point
   * @param {View} [view] by default the whole canvas
   * @returns {{x: number, y: number} | null}
   */
  project(point, view = {}) {
    const [left, top, wide, high] = findPageRectangle(this.canvas, view);
    const pixel = new Sight(view.camera ?? this.camera, wide, high, false).project(point);
    return pixel && { x: left + pixel.x, y: top + pixel.y };
  }

  /** @param {number} light @param {number} [times] as `readCounts` of picking.js */
  readCounts(light, times) {
    return readCounts(this, light, times);
  }

  /** Free everything on the card. */
  dispose() {
    this.canvas.removeEventListener("webglcontextlost", this.lose);
    this.canvas.removeEventListener("webglcontextrestored", this.restore);
    const { device, buffers } = this;
    for (const stage of this.stages) stage.delete();
    this.targets.delete();
    device.gl.deleteBuffer(buffers.surface);
    device.gl.deleteBuffer(buffers.doubled);
    this.passes.delete();
    this.hourPass.delete();
    for (const { program } of device.programs.values()) device.gl.deleteProgram(program);
    this.isLost = true;
  }
}
