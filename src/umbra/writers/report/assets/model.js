// Triangles into pixels, seen from infinitely far: which face and which sample each pixel shows.
// No WebGL: a depth buffer in plain arrays runs in every browser, and tells what is pointed at.

const BEHIND = 0.03;  // where a front and a back coincide, as two houses' walls do, the front is seen [m]
const GROUND = -2;  // as a face's surface; -1 is what is not sampled

const readModel = async () => {
  const flat = await unpack(data.vertices), count = flat.length / 3;
  const points = new Float32Array(flat.length);  // x, y, z of one corner after another [m]
  for (let axis = 0; axis < 3; axis++) {
    // Differences run through all three axes, one after another.
    for (let i = 0; i < count; i++) points[3 * i + axis] = flat[axis * count + i] / 1000;
  }
  const faces = await unpack(data.faces), surface = await unpack(data.face_surface);
  const normals = new Float32Array(faces.length);
  for (let f = 0; f < surface.length; f++) {
    const [a, b, c] = [3 * faces[3 * f], 3 * faces[3 * f + 1], 3 * faces[3 * f + 2]];
    const [ux, uy, uz] = [points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]];
    const [vx, vy, vz] = [points[c] - points[a], points[c + 1] - points[a + 1], points[c + 2] - points[a + 2]];
    const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const size = Math.hypot(x, y, z) || 1;
    normals.set([x / size, y / size, z / size], 3 * f);
  }
  return { points, faces, surface, normals };
};

const makeRaster = (model) => {
  const { points, faces, surface } = model;
  const corners = points.length / 3;
  const sx = new Float32Array(corners), sy = new Float32Array(corners), sd = new Float32Array(corners);
  let wide = 0, high = 0, depth = new Float32Array(0), face = new Int32Array(0);

  const resize = (w, h) => {
    if (w === wide && h === high) return;
    wide = w; high = h;
    depth = new Float32Array(w * h);
    face = new Int32Array(w * h);
  };
  const fill = (f, near) => {
    let [a, b, c] = [faces[3 * f], faces[3 * f + 1], faces[3 * f + 2]];
    const area = (sx[b] - sx[a]) * (sy[c] - sy[a]) - (sx[c] - sx[a]) * (sy[b] - sy[a]);
    if (area === 0) return;
    const back = area > 0 ? BEHIND : 0;  // on the screen y runs down, so fronts turn the other way
    const low = Math.min(sy[a], sy[b], sy[c]), top = Math.max(sy[a], sy[b], sy[c]);
    const first = Math.max(0, Math.ceil(low - 0.5)), last = Math.min(high - 1, Math.ceil(top - 0.5) - 1);
    if (first > last) return;
    // Depth is linear over the screen.
    const gx = ((sd[b] - sd[a]) * (sy[c] - sy[a]) - (sd[c] - sd[a]) * (sy[b] - sy[a])) / area;
    const gy = ((sx[b] - sx[a]) * (sd[c] - sd[a]) - (sx[c] - sx[a]) * (sd[b] - sd[a])) / area;
    if (sy[a] > sy[b]) [a, b] = [b, a];
    if (sy[b] > sy[c]) [b, c] = [c, b];
    if (sy[a] > sy[b]) [a, b] = [b, a];
    for (let row = first; row <= last; row++) {
      const y = row + 0.5;
      const long = sx[a] + ((sx[c] - sx[a]) * (y - sy[a])) / (sy[c] - sy[a]);
      const short = y < sy[b]
        ? sx[a] + ((sx[b] - sx[a]) * (y - sy[a])) / (sy[b] - sy[a])
        : sx[b] + ((sx[c] - sx[b]) * (y - sy[b])) / (sy[c] - sy[b] || 1);
      const left = Math.max(0, Math.ceil(Math.min(long, short) - 0.5));
      const right = Math.min(wide, Math.ceil(Math.max(long, short) - 0.5));
      let d = sd[a] + gx * (left + 0.5 - sx[a]) + gy * (y - sy[a]) - back;
      for (let at = row * wide + left, end = row * wide + right; at < end; at++, d += gx) {
        if (d > depth[at] && d <= near) { depth[at] = d; face[at] = f; }
      }
    }
  };
  const render = (eye, near = Infinity) => {
    // `eye` says where a point of the model falls, in pixels, and how near the viewer it is [m].
    for (let i = 0; i < corners; i++) {
      const spot = eye.project(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
      sx[i] = spot[0]; sy[i] = spot[1]; sd[i] = spot[2];
    }
    depth.fill(-Infinity);
    face.fill(-1);
    for (let f = 0; f < surface.length; f++) fill(f, near);
    return { depth, face, wide, high };
  };
  return { resize, render };
};
