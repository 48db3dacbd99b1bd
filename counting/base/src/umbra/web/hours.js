// The hours of a study as an overlay: on a plan, on walls and roofs, or at points.

import { inflate } from "./packed.js";
import { Patches, packColor } from "./patches.js";

/** @typedef {import('./patches.js').Packed} Packed */

/** @typedef {{ramp: number[][], noSun: [number, number, number]}} Palette from no hours to all */

/**
 * @typedef {object} Hours results of a study
 * @property {string} title
 * @property {boolean} isSun whether the key names hours of sun, in place of shadow
 * @property {number} most [h]
 * @property {string} note
 * @property {Plan | null} plan
 * @property {Samples | null} samples
 *
 * @typedef {object} Plan
 * @property {string} image its address
 * @property {[number, number, number, number]} extent in the model's own coordinates [m]
 * @property {boolean} onModel whether it lies on roofs, too
 *
 * @typedef {object} Points
 * @property {string} points packed float32 (n, 3) about `origin`
 *
 * @typedef {{origin: number[], levels: string} & (Packed | Points)} Samples
 *   levels: packed bytes, 0 to 253 of the most hours, 254 without any sun; 255 has no hours
 */

const CLEAR = 255;
const NO_SUN = 254;
const DISC = 13; // [CSS pixels]

/**
 * Make the overlay of hours.
 * @param {Hours} hours
 * @param {Palette} palette of hours in shadow
 * @param {Model} model
 * @returns {Promise<Overlay>}
 */
export const layHours = async ({ plan, samples }, { ramp, noSun }, model) => {
  if (plan) {
    const image = new Image();
    image.src = plan.image;
    await image.decode();
    const {
        extent: [west, south, east, north],
        onModel,
      } = plan,
      [x, y] = model.origin;
    return {
      plan: { image, extent: [west - x, south - y, east - x, north - y], onModel },
      shaded: false,
    };
  }
  if (!samples) return {};
  const levels = new Uint8Array(await inflate(samples.levels));
  const palette = Uint32Array.from({ length: CLEAR + 1 }, (_, level) =>
    level === CLEAR ? 0 : packColor(...(level === NO_SUN ? noSun : blend(ramp, level / (NO_SUN - 1)))),
  );
  const colors = Uint32Array.from(levels, (level) => palette[level]);
  if ("points" in samples) {
    const positions = new Float32Array(await inflate(samples.points));
    for (let i = 0; i < positions.length; i++)
      positions[i] += samples.origin[i % 3] - model.origin[i % 3];
    const size = DISC * Math.min(window.devicePixelRatio || 1, 3);
    return { dots: { positions, colors: new Uint8Array(colors.buffer), size } };
  }
  const patches = await Patches.read(model, samples, samples.origin);
  patches.paint(colors);
  return { patches };
};

/**
 * The colour at a share of a ramp.
 * @param {number[][]} ramp
 * @param {number} share
 * @returns {[number, number, number]}
 */
const blend = (ramp, share) => {
  const at = share * (ramp.length - 1),
    low = Math.min(Math.floor(at), ramp.length - 2);
  const mix = (/** @type {number} */ k) =>
    Math.round(ramp[low][k] + (ramp[low + 1][k] - ramp[low][k]) * (at - low));
  return [mix(0), mix(1), mix(2)];
};
