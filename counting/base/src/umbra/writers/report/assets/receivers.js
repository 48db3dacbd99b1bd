// What is read on a model: samples of surfaces, or points, with their places, words and colours.

const WINDS = ["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"];

const readReceivers = async (model) => {
  const { count, origin } = data, flat = await unpack(data.positions);
  const place = (k) => [0, 1, 2].map((axis) => flat[axis * count + k] / 1000 + origin[axis] - model.origin[axis]);
  const hours = new Float32Array(await inflate(data.hours));
  const behindHours = data.behind_hours ? new Float32Array(await inflate(data.behind_hours)) : null;
  const masks = await makeMasks(count), { lostOf, mostLost } = await readLosses();
  const isSampled = Boolean(data.surfaces);
  const owner = isSampled ? await unpack(data.sample_surface) : null;
  const given = isSampled ? null : new Float32Array(await inflate(data.normals));
  const patches = isSampled ? await kit.Patches.read(model, data, origin) : null;

  const normal = (k) => {
    if (isSampled) return patches.normal(owner[k]);
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
    const spot = place(k).map((v, axis) => number(v + model.origin[axis], 2));
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
    const key = view.mode === "shadow" ? `now ${view.now}` : view.mode === "hours" ? "all" : `${view.mode} ${view.day}`;
    if (key === last) return;
    last = key;
    if (view.mode === "shadow") {
      for (let k = 0; k < count; k++) {
        const s = shades[k], [r, g, b] = LIGHTS[masks.kindOf(view.now, k)];
        colors[k] = color(r * s, g * s, b * s);
      }
      return;
    }
    if (view.mode === "lost") {
      const lost = lostOf(view);
      most = mostLost;
      for (let k = 0; k < count; k++) colors[k] = lossOf(lost[k], most);
      return;
    }
    const shown = view.mode === "day" ? masks.sumHours(day.first, day.last) : hours;
    most = view.mode === "day" ? hoursUp(day.first, day.last) : data.up_hours;
    for (let k = 0; k < count; k++) colors[k] = colorOf(shown[k], most);
  };
  return { ...masks, count, place, normal, where, hours, behindHours, colors, paint, owner, patches, isSampled,
    exists: () => true, mostHours: (view) => (view.mode === "shadow" ? data.up_hours : most) };
};
