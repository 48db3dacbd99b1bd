// A model as Python packed it (pack.py), unpacked for drawing and for rays.

/** @typedef {import('./types.js').Part} Part */
/** @typedef {import('./types.js').Vec3} Vec3 */

/** A place on earth: degrees, IANA zone, and true north's azimuth in the model's plan. */
/** @typedef {{latitude: number, longitude: number, zone: string, north: number, elevation: number | null}} Site */

/**
 * @typedef {object} Model
 * @property {Vec3} origin add it to local positions for the model's own coordinates [m]
 * @property {string} unit 'm'
 * @property {Site | null} site
 * @property {Part[]} parts
 * @property {[Vec3, Vec3]} bounds lowest and highest corner, local
 * @property {number | null} ground level ground in the file, local
 * @property {(from: Vec3, towards: Vec3, options?: {cast?: ArrayLike<number | boolean> | null,
 *   every?: boolean}) => {part: number, face: number, distance: number}[]} trace faces that a ray
 *   meets, nearest first; distances in lengths of `towards`
 */

/**
 * Unpack a block made by `umbra.web.pack_model`.
 * @param {ArrayBuffer | Uint8Array} block
 * @returns {Promise<Model>}
 */
export async function unpackModel(block) {
  throw new Error(`a block of ${block.byteLength} bytes cannot be unpacked yet`);
}
