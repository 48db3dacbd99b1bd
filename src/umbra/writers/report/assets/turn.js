// A model that turns, its samples or points coloured, and read where one points.

const makeModel = async () => {
  const model = await readModel(), receivers = await readReceivers();
  const raster = makeRaster(model), eye = makeCamera(), { camera } = eye;
  const { isSampled, colors, place, count } = receivers;
  const map = $("map"), pen = map.getContext("2d"), signs = makeSigns(pen, map);
  const sheet = document.createElement("canvas"), sheetPen = sheet.getContext("2d");
  map.classList.add("turns");
  let image = null, pixels = null, samples = null, seen = null, coarse = 1, current = null;

  // ---- what is not sampled, and the lines between faces of different planes

  const greys = new Uint32Array(model.surface.length), keys = new Int32Array(model.surface.length);
  for (let f = 0; f < greys.length; f++) {
    const [x, y, z] = model.normals.subarray(3 * f, 3 * f + 3);
    const light = 0.72 + 0.2 * Math.abs(z * 0.8 - x * 0.35 + y * 0.2);
    const grey = Math.round(255 * Math.min(0.93, light));
    const s = model.surface[f];
    greys[f] = s === GROUND ? color(243, 241, 234) : color(grey, grey, grey);
    keys[f] = s >= 0 ? s : -3 - Math.round((x + 1) * 50) * 10201 - Math.round((y + 1) * 50) * 101 - Math.round((z + 1) * 50);
    if (s === GROUND) keys[f] = GROUND;
  }
  const PAPER = color(255, 255, 255), BACK = color(168, 166, 162);

  const render = () => {
    const wide = Math.max(1, Math.round(map.width / coarse)), high = Math.max(1, Math.round(map.height / coarse));
    raster.resize(wide, high);
    if (!image || image.width !== wide || image.height !== high) {
      sheet.width = wide; sheet.height = high;
      image = sheetPen.createImageData(wide, high);
      pixels = new Uint32Array(image.data.buffer);
      samples = new Int32Array(wide * high);
    }
    const aim = eye.aim(wide, high, dotOf() / coarse);
    seen = { ...raster.render(aim, camera.near), aim };
    const pick = isSampled ? receivers.grids.make(aim, camera.middle) : null;
    const facing = new Uint8Array(model.surface.length);
    for (let f = 0; f < facing.length; f++) {
      const [x, y, z] = model.normals.subarray(3 * f, 3 * f + 3);
      facing[f] = x * aim.toward[0] + y * aim.toward[1] + z * aim.toward[2] > 0 ? 1 : 0;
    }
    for (let at = 0; at < samples.length; at++) {
      const f = seen.face[at];
      samples[at] = -1;
      if (f < 0 || model.surface[f] < 0 || !facing[f]) continue;
      const a = ((at % wide) + 0.5 - wide / 2) / aim.scale, b = (high / 2 - 0.5 - Math.floor(at / wide)) / aim.scale;
      samples[at] = pick(model.surface[f], a, b, seen.depth[at]);
    }
  };
  const halve = (shown) => (((shown >>> 1) & 0x7f7f7f7f) | color(0, 0, 0)) >>> 0;  // in all but alpha
  const isEdge = (at, next, f, wide) => {
    // Where planes meet or one stands before another; the ground's own rim is no edge.
    if (next >= seen.face.length || (next === at + 1 && next % wide === 0)) return false;
    const g = seen.face[next];
    const [one, two] = [f < 0 ? GROUND : keys[f], g < 0 ? GROUND : keys[g]];
    if (one === two) return false;
    if (one === GROUND || two === GROUND) return true;
    const N = model.normals;
    const bend = N[3 * f] * N[3 * g] + N[3 * f + 1] * N[3 * g + 1] + N[3 * f + 2] * N[3 * g + 2];
    return bend < 0.985 || Math.abs(seen.depth[at] - seen.depth[next]) > 0.3 + 6 / seen.aim.scale;
  };
  const fillPixels = () => {
    const { face, wide } = seen;
    for (let at = 0; at < samples.length; at++) {
      const f = face[at];
      let shown = f < 0 ? PAPER : samples[at] >= 0 ? colors[samples[at]] : model.surface[f] >= 0 ? BACK : greys[f];
      if (isEdge(at, at + 1, f, wide) || isEdge(at, at + wide, f, wide)) shown = halve(shown);
      pixels[at] = shown;
    }
    sheetPen.putImageData(image, 0, 0);
  };
  const dotOf = () => map.width / (map.clientWidth || map.width);

  // ---- points, and the place that is read

  const isHidden = (k) => {
    const [x, y, d] = seen.aim.project(...place(k)), col = Math.floor(x), row = Math.floor(y);
    if (col < 0 || row < 0 || col >= seen.wide || row >= seen.high) return true;
    const at = row * seen.wide + col;
    return isSampled ? samples[at] !== k && seen.depth[at] > d + 0.3 : seen.depth[at] > d + 0.3 && d <= camera.near;
  };
  const spotOf = (k) => {
    const [x, y] = seen.aim.project(...place(k));
    return [x * coarse, y * coarse];
  };
  const drawPoints = (dot) => {
    const few = count <= 3000, size = few ? 5 : 2.5;
    const css = (c) => (little ? `rgb(${c & 255},${(c >> 8) & 255},${(c >> 16) & 255})` : `rgb(${c >>> 24},${(c >> 16) & 255},${(c >> 8) & 255})`);
    for (const behind of [true, false]) {
      for (let k = 0; k < count; k++) {
        if (isHidden(k) !== behind) continue;
        const [x, y] = spotOf(k);
        pen.globalAlpha = behind ? 0.3 : 1;
        pen.fillStyle = css(colors[k]);
        if (!few) { pen.fillRect(x - size * dot, y - size * dot, 2 * size * dot, 2 * size * dot); continue; }
        pen.beginPath();
        pen.arc(x, y, size * dot, 0, 7);
        pen.fill();
        pen.strokeStyle = "#1c1c22";
        pen.lineWidth = 1.2 * dot;
        pen.stroke();
      }
    }
    pen.globalAlpha = 1;
    if (count > 40) return;
    const taken = [];  // a name that would lie over another is left out
    for (let k = 0; k < count; k++) {
      const [x, y] = spotOf(k), wide = 7 * dot * data.names[k].length;
      if (taken.some(([tx, ty, tw]) => x < tx + tw && x + wide > tx && Math.abs(y - ty) < 14 * dot)) continue;
      taken.push([x, y, wide]);
      signs.halo(data.names[k], x + 9 * dot, y + 4 * dot, dot);
    }
  };
  const drawSun = (view, dot) => {
    if (view.mode !== "shadow" || !steps.up[view.now]) return;
    const a = (steps.azimuth[view.now] + data.north) * RADIANS, h = steps.altitude[view.now] * RADIANS;
    const way = [Math.sin(a) * Math.cos(h), Math.cos(a) * Math.cos(h), Math.sin(h)];
    const { right, up } = seen.aim;
    const dx = way[0] * right[0] + way[1] * right[1], dy = -(way[0] * up[0] + way[1] * up[1] + way[2] * up[2]);
    const w = map.width / 2 - 14 * dot, v = map.height / 2 - 14 * dot;
    const reach = Math.min(Math.abs(dx) > 0.02 ? w / Math.abs(dx) : Infinity, Math.abs(dy) > 0.02 ? v / Math.abs(dy) : Infinity);
    if (reach < Infinity) signs.sun(map.width / 2 + dx * reach, map.height / 2 + dy * reach, dot);
  };
  const draw = (view) => {
    current = view;
    if (!seen) { render(); fillPixels(); }
    const dot = dotOf();
    pen.imageSmoothingEnabled = coarse > 1;
    pen.drawImage(sheet, 0, 0, map.width, map.height);
    if (!isSampled) drawPoints(dot);
    signs.scale(camera.scale * dot, dot);
    signs.north(data.north - camera.azimuth - 180, dot, Math.sin(camera.tilt * RADIANS));
    drawSun(view, dot);
    const [x, y] = spotOf(view.chosen);
    signs.ring(x, y, dot, isHidden(view.chosen));
  };
  const paint = (view) => {
    receivers.paint(view);
    if (seen) fillPixels();
  };
  const again = (isRough = false) => {
    coarse = isRough ? 2 : 1;
    seen = null;
    draw(current);
  };

  // ---- framing

  const boxOf = (which) => {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const k of which) place(k).forEach((v, axis) => { low[axis] = Math.min(low[axis], v); high[axis] = Math.max(high[axis], v); });
    return [low, high];
  };
  const everything = boxOf(Array.from({ length: count }, (_, k) => k));
  const whole = () => eye.frame(everything, map.clientWidth, map.clientHeight, isSampled ? 2 : 12);
  const fit = (least = 1) => {
    const wide = Math.max(1, map.parentElement.clientWidth), was = map.clientWidth;
    const high = Math.round(Math.min(Math.max(300, wide * 0.7), Math.max(300, window.innerHeight * 0.78)));
    const dot = Math.max(Math.min(least, 2), Math.min(window.devicePixelRatio || 1, 2));
    map.style.width = wide + "px";
    map.style.height = high + "px";
    map.width = Math.round(wide * dot);
    map.height = Math.round(high * dot);
    if (!current) whole();
    else camera.scale *= wide / was;
    seen = null;
  };
  const show = (kind, index) => {
    if (kind === "point") {
      camera.near = Infinity;
      camera.middle = place(index);
      camera.scale = Math.max(camera.scale, Math.min(map.clientWidth, map.clientHeight) / 60);
      again();
      return index;
    }
    const mine = [];
    for (let k = 0; k < count; k++) {
      const s = receivers.owner[k];
      if (kind === "surface" ? s === index : data.surfaces.part[s] === index) mine.push(k);
    }
    if (kind === "surface") eye.face(receivers.normal(mine[0]));
    else eye.turn(camera.azimuth, 35);
    eye.frame(boxOf(mine), map.clientWidth, map.clientHeight, 3);
    camera.scale *= 0.8;
    // What stands before it is cut away.
    const { project } = eye.aim(1, 1);
    camera.near = mine.reduce((near, k) => Math.max(near, project(...place(k))[2]), -Infinity) + (kind === "part" ? 2 : 0.05);
    again();
    // Its darkest place that is seen.
    const own = new Set(mine), open = new Set(samples.filter((k) => own.has(k)));
    return [...(open.size ? open : own)].reduce((a, b) => (receivers.hours[b] > receivers.hours[a] ? b : a));
  };

  // ---- pointing and turning

  const receiverAt = (event) => {
    const box = map.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * seen.wide, y = ((event.clientY - box.top) / box.height) * seen.high;
    if (isSampled) {
      const col = Math.floor(x), row = Math.floor(y);
      return col < 0 || row < 0 || col >= seen.wide || row >= seen.high ? -1 : samples[row * seen.wide + col];
    }
    let best = 12 * dotOf() / coarse, found = -1;
    for (let k = 0; k < count; k++) {
      const [px, py] = seen.aim.project(...place(k));
      const off = Math.hypot(px - x, py - y) * (isHidden(k) ? 1.5 : 1);
      if (off < best) { best = off; found = k; }
    }
    return found;
  };
  const listen = ({ hover, pick }) => {
    const fingers = new Map();
    let dragged = 0, apart = 0, settle = 0;
    const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
    const rough = () => {
      again(true);
      clearTimeout(settle);
      settle = setTimeout(again, 140);
    };
    const zoom = (times) => { camera.scale *= times; rough(); };
    map.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (fingers.size === 1) dragged = 0;
      else if (fingers.size === 2) apart = spread();
      map.setPointerCapture(event.pointerId);
    });
    map.addEventListener("pointermove", (event) => {
      const was = fingers.get(event.pointerId);
      if (!was) { if (event.pointerType === "mouse") hover(receiverAt(event)); return; }
      const dx = event.clientX - was.x, dy = event.clientY - was.y;
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      dragged += Math.hypot(dx, dy);
      if (dragged < 4) return;
      if (fingers.size === 2) {
        camera.scale *= spread() / (apart || 1);
        apart = spread();
        eye.pan(dx / 2, dy / 2);
      } else if (event.shiftKey || event.buttons & 6) eye.pan(dx, dy);
      else eye.turn(camera.azimuth + dx * 0.4, camera.tilt + dy * 0.3);
      rough();
    });
    const lift = (event) => {
      const wasDown = fingers.delete(event.pointerId);
      if (!wasDown || event.type === "pointercancel" || dragged >= 4) return;
      if (coarse > 1) again();
      const receiver = receiverAt(event);
      if (receiver >= 0) pick(receiver);
    };
    map.addEventListener("pointerup", lift);
    map.addEventListener("pointercancel", lift);
    map.addEventListener("pointerleave", () => hover(-1));
    map.addEventListener("contextmenu", (event) => event.preventDefault());
    map.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      zoom(Math.exp(-event.deltaY * 0.002));
    }, { passive: false });
    for (const button of document.querySelectorAll("[data-view]")) {
      button.addEventListener("click", () => {
        const view = button.dataset.view, now = current.now;
        if (view === "larger" || view === "smaller") return zoom(view === "larger" ? 1.4 : 1 / 1.4);
        if (view === "whole") { camera.near = Infinity; whole(); }
        else if (view === "above") eye.turn(data.north + 180, 90);
        else if (view === "sun") eye.turn(steps.azimuth[now] + data.north, Math.max(0, steps.altitude[now]));
        else eye.turn(Number(view) + data.north, camera.tilt > 60 ? 25 : camera.tilt);
        again();
      });
    }
  };
  const move = (key, isFar, chosen) => {
    const times = isFar ? 3 : 1;
    const turns = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] }[key];
    if (turns) eye.turn(camera.azimuth + turns[0] * times, camera.tilt + turns[1] * times);
    else if (key === "+" || key === "=") camera.scale *= 1.25;
    else if (key === "-") camera.scale /= 1.25;
    else return null;
    again();
    return chosen;
  };
  const choose = () => {
    // What is seen, and has about half of the sun.
    if (!isSampled) { eye.turn(data.north + 180, 90); whole(); }
    render();
    let best = Infinity, chosen = 0;
    const consider = (k) => {
      const off = Math.abs(receivers.hours[k] / (data.up_hours || 1) - 0.5);
      if (k >= 0 && off < best) { best = off; chosen = k; }
    };
    if (isSampled) samples.forEach(consider);
    else for (let k = 0; k < count; k++) consider(k);
    return chosen;
  };
  return { ...receivers, paint, draw, fit, move, listen, choose, show, spotOf, isHidden };
};
