// The types that modules share, known in all of them. Nothing here runs.
//
// Positions and directions are in the model's local frame: metres, x east, y north, z up as in
// the file; add `model.origin` for the model's own coordinates. Screen positions are CSS pixels
// from the canvas's upper left corner. Colours are sRGB, 0 to 1.

type Vec3 = [number, number, number];

/**
 * A sun (direction toward it, of any length) or a lamp (position; nothing beyond its range [m]). Its
 * light is `intensity` times the cosine to a face's normal to the power `bend`, by default 1.
 */
type Light = { color?: Vec3; intensity?: number; bend?: number } & (
  | { direction: Vec3 }
  | { position: Vec3; range?: number }
);

/** Perspective with `fov` (vertical, degrees) or orthographic with `height` (of the picture, m). */
interface Camera {
  eye: Vec3;
  target: Vec3;
  up?: Vec3; // by default [0, 0, 1]
  fov?: number; // by default 50
  height?: number;
  near?: number; // by default 0.1 m; nothing nearer is seen
}

/** Per part, whether it casts or is drawn; null: all. */
type Mask = ArrayLike<number | boolean> | null;

/**
 * One picture in the canvas. Rectangles are left, top, width, height in CSS pixels. With only a
 * `scissor` the view is a cut of the whole canvas (before and after under one swipe); with a
 * `viewport` it is a picture with its own aspect (side by side).
 */
interface View {
  viewport?: [number, number, number, number]; // by default the whole canvas
  scissor?: [number, number, number, number]; // by default the viewport
  cast?: Mask;
  show?: Mask;
  camera?: Camera; // by default the renderer's
}

/**
 * Results. `plan` is a picture laid from above on the ground plane and, where `onModel`, on all
 * faces that look up; row 0 is its north edge, alpha 0 shows the surface. `patches` are squares on
 * the outward sides of walls and roofs. `dots` are discs at points, in pixels across.
 */
interface Overlay {
  plan?: {
    image: TexImageSource;
    extent: [number, number, number, number]; // xmin, ymin, xmax, ymax [m]
    onModel?: boolean;
    smooth?: boolean;
  };
  patches?: import("./patches.js").Patches;
  dots?: { positions: Float32Array; colors: Uint8Array; size: number }; // (n, 3), (n, 4) sRGB, alpha
  opacity?: number; // by default 1
  shaded?: boolean; // whether light and shadow still show on a plan; by default true
}

/** A line in space, as wide everywhere, that the model hides; with `isSky` all of the model does. */
interface Line {
  places: Vec3[];
  color: [number, number, number, number]; // sRGB and alpha, 0 to 1
  width: number; // [CSS pixels]
  isSky?: boolean;
}

interface Style {
  sky?: Vec3; // at the zenith
  horizon?: Vec3;
  ground?: Vec3;
  skylight?: number; // of even light, by default 1: as in umbra's pictures
  edge?: Vec3; // colour of creases
  edges?: boolean; // by default true
  background?: boolean; // sky and horizon; false: transparent canvas
}

interface Part {
  name: string;
  kind: string;
  layer: string;
  label: string; // as in the file's reports; unique to an object
  color: Vec3; // linear RGB
  opacity: number; // 1: nothing is seen through it
  faces: number; // number of faces
}

/** What a ray meets first; part -1 is the ground. */
type Hit = { part: number; face: number; position: Vec3; normal: Vec3 };

interface RendererOptions {
  samples?: number; // of MSAA, by default 4 (as many as the device has)
  pixelRatio?: number; // by default devicePixelRatio, followed when it changes
  style?: Style;
}

/** Of the last `draw`. */
interface Statistics {
  milliseconds: number; // of JavaScript
  sides: number;
  casters: number; // drawn
  behind: number; // casters counted behind the surface (z-fail)
}

type App = import("./app.js").App;
type Config = import("./opening.js").Config;
type Day = import("./daylight.js").Day;
type Device = import("./device.js").Device;
type Dome = import("./paths.js").Dome;
type Hours = import("./hours.js").Hours;
type Model = import("./model.js").Model;
type Place = import("./place.js").Place;
type Renderer = import("./renderer.js").Renderer;
type Sight = import("./view.js").Sight;
type Signs = import("./signs.js").Signs;
type Standing = import("./state.js").Standing;
type State = import("./state.js").State;
type Target = import("./targets.js").Target;
type Throw = import("./placement.js").Throw;
type Viewpoint = import("./viewpoint.js").Viewpoint;
type Volumes = import("./volumes.js").Volumes;

/** What browsers have and TypeScript 4.8, which Debian ships, does not know yet. */
declare class DecompressionStream {
  constructor(format: "deflate" | "deflate-raw" | "gzip");
  readonly readable: ReadableStream<Uint8Array>;
  readonly writable: WritableStream<Uint8Array>;
}
