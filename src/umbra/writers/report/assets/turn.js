// A model that turns, its samples or points coloured, and read where one points.

const EYE = 4;  // where rays begin, in sizes of the model from its middle
const OFF = 0.05;  // from a receiver to where a ray toward the eye begins [m]
const LAMP = [-0.35, 0.2, 0.8];  // the light's direction: nothing casts a shadow here

const makeModel = async () => {
  const model = await kit.unpackModel(decode($("live-block").textContent));
  const receivers = await readReceivers(model), { isSampled, colors, place, count, patches } = receivers;
  for (const part of model.parts) part.color = [0.6, 0.6, 0.58];
  const map = $("map"), pen = map.getContext("2d"), signs = makeSigns(pen, map);
  const sheet = document.createElement("canvas"), shot = document.createElement("canvas"), shotPen = shot.getContext("2d");
  const renderer = new kit.Renderer(sheet, model, { style: { background: false } });
  renderer.setParts(new Uint8Array(model.parts.length), null);
  renderer.lights = [{ direction: LAMP }];
  const eye = makeCamera(), { camera } = eye, [low, high] = model.bounds;
  const far = EYE * Math.hypot(...high.map((v, k) => v - low[k]));
  const positions = Float32Array.from({ length: 3 * count }, (_, i) => (isSampled ? 0 : place(Math.floor(i / 3))[i % 3]));
  map.classList.add("turns");
  let aim = null, coarse = 1, current = null, isStale = true;

  const aimAt = () => {
    sheet.width = Math.max(1, Math.round(map.width / coarse));
    sheet.height = Math.max(1, Math.round(map.height / coarse));
    aim = eye.aim(sheet.width, sheet.height, dotOf() / coarse);
    const { toward, up, scale } = aim, from = camera.middle.map((v, k) => v + far * toward[k]);
    const near = Math.max(far - camera.near, 1e-3);
    renderer.camera = { eye: from, target: [...camera.middle], up, height: sheet.height / scale, near };
  };
  const render = () => {
    aimAt();
    const dots = { positions, colors: new Uint8Array(colors.buffer), size: (count <= 3000 ? 11 : 5) * dotOf() / coarse };
    renderer.setOverlay(isSampled ? { patches } : { dots });
    renderer.draw();
    shot.width = sheet.width; shot.height = sheet.height;
    shotPen.fillStyle = "#ffffff";
    shotPen.fillRect(0, 0, shot.width, shot.height);
    shotPen.drawImage(sheet, 0, 0);  // at once: a browser clears what WebGL drew
    isStale = false;
  };
  const dotOf = () => map.width / (map.clientWidth || map.width);

  // ---- points, and the place that is read

  const sampleAt = (x, y) => {
    const hit = renderer.pick(x, y), surface = hit ? model.surface[hit.face] ?? -1 : -1;
    if (surface < 0) return -1;
    const normal = patches.normal(surface), { toward } = aim;
    const isFront = normal[0] * toward[0] + normal[1] * toward[1] + normal[2] * toward[2] > 0;
    return isFront ? patches.find(surface, hit.position) : -1;
  };
  const isHidden = (k) => {
    const spot = place(k), { toward } = aim, reach = camera.near - aim.project(...spot)[2] - OFF;
    const from = spot.map((v, axis) => v + OFF * toward[axis]);
    return reach > 0 && model.trace(from, toward, { reach }).length > 0;
  };
  const spotOf = (k) => {
    const [x, y] = aim.project(...place(k));
    return [x * coarse, y * coarse];
  };
  const drawNames = (dot) => {
    const taken = [];  // a name that would lie over another is left out, and of what stands behind
    for (let k = 0; k < count; k++) {
      if (isHidden(k)) continue;
      const [spot, y] = spotOf(k), wide = 7 * dot * data.names[k].length, off = 9 * dot;
      const x = spot + off + wide <= map.width || spot - off < wide ? spot + off : spot - off - wide;
      if (taken.some(([tx, ty, tw]) => x < tx + tw && x + wide > tx && Math.abs(y - ty) < 14 * dot)) continue;
      taken.push([x, y, wide]);
      signs.halo(data.names[k], x, y + 4 * dot, dot);
    }
  };
  const drawSun = (view, dot) => {
    if (view.mode !== "shadow" || !steps.up[view.now]) return;
    const a = (steps.azimuth[view.now] + data.north) * RADIANS, h = steps.altitude[view.now] * RADIANS;
    const way = [Math.sin(a) * Math.cos(h), Math.cos(a) * Math.cos(h), Math.sin(h)];
    const { right, up } = aim;
    const dx = way[0] * right[0] + way[1] * right[1], dy = -(way[0] * up[0] + way[1] * up[1] + way[2] * up[2]);
    const w = map.width / 2 - 14 * dot, v = map.height / 2 - 14 * dot;
    const reach = Math.min(Math.abs(dx) > 0.02 ? w / Math.abs(dx) : Infinity, Math.abs(dy) > 0.02 ? v / Math.abs(dy) : Infinity);
    if (reach < Infinity) signs.sun(map.width / 2 + dx * reach, map.height / 2 + dy * reach, dot);
  };
  const draw = (view) => {
    current = view;
    if (isStale) render();
    const dot = dotOf();
    pen.imageSmoothingEnabled = coarse > 1;
    pen.drawImage(shot, 0, 0, map.width, map.height);
    if (!isSampled && count <= 40) drawNames(dot);
    signs.scale(camera.scale * dot, dot);
    signs.north(data.north - camera.azimuth - 180, dot, Math.sin(camera.tilt * RADIANS));
    drawSun(view, dot);
    const [x, y] = spotOf(view.chosen);
    signs.ring(x, y, dot, isHidden(view.chosen));
  };
  const paint = (view) => {
    receivers.paint(view);
    patches?.paint(colors);
    isStale = true;
  };
  const again = (isRough = false) => {
    coarse = isRough ? 2 : 1;
    isStale = true;
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
    const from = map.getBoundingClientRect().top + window.scrollY;
    const high = Math.round(Math.min(Math.max(300, wide * 0.7), Math.max(300, window.innerHeight - from - BELOW)));
    const dot = Math.max(Math.min(least, 2), Math.min(window.devicePixelRatio || 1, 2));
    map.style.width = wide + "px";
    map.style.height = high + "px";
    map.width = Math.round(wide * dot);
    map.height = Math.round(high * dot);
    if (!current) whole();
    else camera.scale *= wide / was;
    isStale = true;
  };
  const show = (kind, index) => {
    if (kind === "point") {
      camera.near = Infinity;
      camera.middle = place(index);
      camera.scale = Math.max(camera.scale, Math.min(map.clientWidth, map.clientHeight) / 60);
      again();
      return index;
    }
    const own = [];
    for (let k = 0; k < count; k++) {
      const s = receivers.owner[k];
      if (kind === "surface" ? s === index : data.surfaces.part[s] === index) own.push(k);
    }
    if (kind === "surface") eye.face(receivers.normal(own[0]));
    else eye.turn(camera.azimuth, 35);
    eye.frame(boxOf(own), map.clientWidth, map.clientHeight, 3);
    camera.scale *= 0.8;
    // What stands before it is cut away.
    const { project } = eye.aim(1, 1);
    camera.near = own.reduce((near, k) => Math.max(near, project(...place(k))[2]), -Infinity) + (kind === "part" ? 2 : 0.05);
    again();
    // Its darkest place that is seen.
    own.sort((a, b) => receivers.hours[b] - receivers.hours[a]);
    return own.find((k) => !isHidden(k)) ?? own[0];
  };

  // ---- pointing and turning

  const receiverAt = (event) => {
    const box = map.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * sheet.width, y = ((event.clientY - box.top) / box.height) * sheet.height;
    if (isSampled) return sampleAt(x, y);
    let best = 12 * dotOf() / coarse, nearest = -1;
    for (let k = 0; k < count; k++) {
      const [px, py] = aim.project(...place(k)), off = Math.hypot(px - x, py - y);
      if (off >= best || off * (isHidden(k) ? 1.5 : 1) >= best) continue;
      best = off * (isHidden(k) ? 1.5 : 1);
      nearest = k;
    }
    return nearest;
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
  const facing = () => {
    // Where panes and walls are seen best, of eight winds from the south on; of all else from above.
    const own = Array.from({ length: count }, (_, k) => receivers.normal(k));
    if (2 * own.filter((normal) => normal && Math.abs(normal[2]) < 0.5).length <= count) return [data.north + 180, 90];
    const seen = (azimuth) => own.reduce((sum, normal) =>
      sum + (normal ? Math.max(0, normal[0] * Math.sin(azimuth * RADIANS) + normal[1] * Math.cos(azimuth * RADIANS)) : 0), 0);
    const winds = [210, 150, 240, 120, 300, 60, 330, 30].map((azimuth) => azimuth + data.north);
    return [winds.reduce((best, wind) => (seen(wind) > seen(best) + 0.5 ? wind : best)), 25];
  };
  const choose = () => {
    // What is seen, and has about half of the sun.
    if (!isSampled) { eye.turn(...facing()); whole(); }
    aimAt();
    const off = (k) => Math.abs(receivers.hours[k] / (data.up_hours || 1) - 0.5);
    const sorted = Array.from({ length: count }, (_, k) => k).sort((a, b) => off(a) - off(b));
    return (isSampled ? sorted.find((k) => !isHidden(k)) : sorted[0]) ?? sorted[0];
  };
  return { ...receivers, paint, draw, fit, move, listen, choose, show, spotOf, isHidden };
};
