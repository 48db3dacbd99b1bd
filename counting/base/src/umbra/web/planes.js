// Planes of faces, as `make_planes` of umbra.volume.

/**
 * The plane (a, b, c, d) of a face; its normal is twice as long as the face is large.
 * @param {Float64Array} places
 * @param {Uint32Array} faces
 * @param {number} f
 */
export const findPlane = (places, faces, f) => {
  const [i, j, k] = [3 * faces[3 * f], 3 * faces[3 * f + 1], 3 * faces[3 * f + 2]];
  const [x, y, z] = [places[i], places[i + 1], places[i + 2]];
  const [ax, ay, az] = [places[j] - x, places[j + 1] - y, places[j + 2] - z];
  const [bx, by, bz] = [places[k] - x, places[k + 1] - y, places[k + 2] - z];
  const nx = ay * bz - az * by;
  const ny = az * bx - ax * bz;
  const nz = ax * by - ay * bx;
  return [nx, ny, nz, -(nx * x + ny * y + nz * z)];
};
