// Planes of faces, as `make_planes` of umbra.volume.

/**
 * The plane (a, b, c, d) of a face; its normal is twice as long as the face is large.
 * @param {Float64Array} places
 * @param {Uint32Array} faces
 * @param {number} f
 */
export const findPlane = (places, faces, f) => {
  // One by one: arrays of three cost several times as long before the compiler knows them.
  const i = 3 * faces[3 * f],
    j = 3 * faces[3 * f + 1],
    k = 3 * faces[3 * f + 2];
  const x = places[i],
    y = places[i + 1],
    z = places[i + 2];
  const ax = places[j] - x,
    ay = places[j + 1] - y,
    az = places[j + 2] - z;
  const bx = places[k] - x,
    by = places[k + 1] - y,
    bz = places[k + 2] - z;
  const nx = ay * bz - az * by;
  const ny = az * bx - ax * bz;
  const nz = ax * by - ay * bx;
  return [nx, ny, nz, -(nx * x + ny * y + nz * z)];
};
