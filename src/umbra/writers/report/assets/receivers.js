// What is read on a model: samples of surfaces, or points, with their places, words and colours.

const WINDS = ["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"];

const readReceivers = async () => {
  const count = data.count;
  const flat = await unpack(data.positions);
  const place = (k) => [flat[k] / 1000, flat[count + k] / 1000, flat[2 * count + k] / 1000];
  const hours = new Float32Array(await inflate(data.hours));
  const behindHours = data.behind_hours ? new Float32Array(await inflate(data.behind_hours)) : null;
  const masks = await makeMasks(count);
  const isSampled = Boolean(data.surfaces);
  const owner = isSampled ? await unpack(data.sample_surface) : null;
  const given = isSampled ? null : new Float32Array(await inflate(data.normals));
  const grids = isSampled ? await readGrids() : null;

  const normal = (k) => {
    if (isSampled) return grids.normal(owner[k]);
    const own = [given[3 * k], given[3 * k + 1], given[3 * k + 2]];
    return own.some(Number.isNaN) ? null : own;
  };
  const tellFacing = (azimuth, tilt) => {
    if (azimuth === null || tilt < 1) return "level";
    const wind = WINDS[Math.round(azimuth / 45) % 8];
    const lean = Math.abs(tilt - 90) < 1 ? "upright" : `tilted ${tilt.toFixed(0)}°`;
    return `${lean}, facing ${wind} (${azimuth.toFixed(0)}°)`;
  };
  const where = (k) => {
    const spot = place(k).map((v, axis) => number(v + data.origin[axis], 2));
    const words = [`x ${spot[0]}, y ${spot[1]}, z ${spot[2]} m`];
    if (isSampled) {
      const s = owner[k], { part, kind, azimuth, tilt } = data.surfaces;
      const what = kind[s] ? kind[s] + ", " : "";
      words.unshift(`${data.parts[part[s]]}: ${what}${tellFacing(azimuth[s], tilt[s])}`);
    } else {
      words.unshift(data.names[k]);
      const own = normal(k);
      if (!own) words.push("faces the sun at all times");
      else {
        const azimuth = Math.atan2(own[0], own[1]) / RADIANS - data.north;
        const tilt = Math.acos(Math.max(-1, Math.min(1, own[2]))) / RADIANS;
        words.push(tellFacing(Math.hypot(own[0], own[1]) < 1e-6 ? null : (azimuth + 360) % 360, tilt));
      }
    }
    return words.join("; ");
  };

  // ---- colours

  const shade = (k) => {  // of what is lit: from above and a little from the left
    const own = normal(k);
    return own ? 0.78 + 0.22 * Math.max(0, own[2] * 0.8 - own[0] * 0.4 + 0.25) : 1;
  };
  const shades = Float32Array.from({ length: count }, (_, k) => Math.min(1, shade(k)));
  const LIGHTS = { lit: [255, 240, 200], behind: [160, 190, 140], dark: [92, 104, 148], night: [176, 178, 192] };
  const colors = new Uint32Array(count);
  let most = 0, last = "";
  const paint = (view) => {
    const day = days[view.day];
    const key = view.mode === "shadow" ? `now ${view.now}` : view.mode === "day" ? `day ${view.day}` : "all";
    if (key === last) return;
    last = key;
    if (view.mode === "shadow") {
      for (let k = 0; k < count; k++) {
        const s = shades[k], [r, g, b] = LIGHTS[masks.kindOf(view.now, k)];
        colors[k] = color(r * s, g * s, b * s);
      }
      return;
    }
    const shown = view.mode === "day" ? masks.sumHours(day.first, day.last) : hours;
    most = view.mode === "day" ? hoursUp(day.first, day.last) : data.up_hours;
    for (let k = 0; k < count; k++) colors[k] = colorOf(shown[k], most);
  };
  return { ...masks, count, place, normal, where, hours, behindHours, colors, paint, owner, grids, isSampled,
    exists: () => true, mostHours: (view) => (view.mode === "shadow" ? data.up_hours : most) };
};

// Each surface is a grid of squares in its own plane; a square names the sample that it shows.
const readGrids = async () => {
  const floats = new Float32Array(await inflate(data.grids));  // per surface: two axes, offset, side
  const shape = await unpack(data.grid_shape), table = await unpack(data.grid_samples);
  const surfaces = floats.length / 9, first = new Uint32Array(surfaces);
  for (let s = 1; s < surfaces; s++) first[s] = first[s - 1] + shape[2 * s - 2] * shape[2 * s - 1];
  const normal = (s) => {
    const [ax, ay, az, bx, by, bz] = floats.subarray(9 * s, 9 * s + 6);
    return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
  };
  const make = (eye, middle) => {
    // How each surface's two coordinates run over the screen's metres and the depth.
    const slopes = new Float32Array(8 * surfaces);
    const dot = (s, k, way) =>
      floats[9 * s + k] * way[0] + floats[9 * s + k + 1] * way[1] + floats[9 * s + k + 2] * way[2];
    for (let s = 0; s < surfaces; s++) {
      const side = floats[9 * s + 8];
      for (const [k, at] of [[0, 0], [3, 4]]) {
        slopes[8 * s + at] = dot(s, k, eye.right) / side;
        slopes[8 * s + at + 1] = dot(s, k, eye.up) / side;
        slopes[8 * s + at + 2] = dot(s, k, eye.toward) / side;
        slopes[8 * s + at + 3] = (dot(s, k, middle) + floats[9 * s + (k ? 7 : 6)]) / side;
      }
    }
    return (s, a, b, d) => {
      const i = 8 * s, cols = shape[2 * s], rows = shape[2 * s + 1];
      const u = slopes[i] * a + slopes[i + 1] * b + slopes[i + 2] * d + slopes[i + 3];
      const v = slopes[i + 4] * a + slopes[i + 5] * b + slopes[i + 6] * d + slopes[i + 7];
      const col = u < 0 ? 0 : u >= cols ? cols - 1 : Math.floor(u);
      const row = v < 0 ? 0 : v >= rows ? rows - 1 : Math.floor(v);
      return table[first[s] + row * cols + col];
    };
  };
  return { make, normal };
};
