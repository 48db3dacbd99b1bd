"use strict";
(async () => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (id) => document.getElementById(id);
  const { rows, cols, steps, ramp } = data;
  const n = steps.start.length;
  const cells = rows * cols;
  const perMask = Math.ceil(cells / 8);

  // ---- what the file carries, unpacked

  const inflate = async (text) => {
    const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).arrayBuffer();
  };
  const load = (address) =>
    new Promise((done, failed) => {
      const image = new Image();
      image.onload = () => done(image);
      image.onerror = failed;
      image.src = address;
    });
  let bits, heights, roofs;
  try {
    bits = new Uint8Array(await inflate(data.bits));
    heights = new Float32Array(await inflate(data.heights));
    roofs = await load(data.roofs);
  } catch (error) {
    $("trouble").textContent =
      "This browser cannot unpack the plan (" + error.message + "); one of 2023 or later can. " +
      "The pictures and tables below are complete.";
    $("trouble").hidden = false;
    return;
  }
  const isNothing = (cell) => Number.isNaN(heights[cell]);
  const inShadow = (step, cell) => (bits[step * perMask + (cell >> 3)] >> (7 - (cell & 7))) & 1;

  // ---- words

  const two = (v) => String(v).padStart(2, "0");
  const clockAt = (seconds, offset) => {
    const t = new Date((seconds + offset) * 1000);
    const s = t.getUTCSeconds();
    return two(t.getUTCHours()) + ":" + two(t.getUTCMinutes()) + (s ? ":" + two(s) : "");
  };
  const say = (hours) => {
    const minutes = Math.round(hours * 60);
    const h = Math.floor(minutes / 60), m = minutes % 60;
    if (hours > 0 && minutes === 0) return Math.round(hours * 3600) + " s";
    return h === 0 && m ? m + " min" : h + " h" + (m ? " " + m + " min" : "");
  };
  const length = (i) => (steps.end[i] - steps.start[i]) / 3600;
  const startOf = (i) => clockAt(steps.start[i], steps.offset[i]);
  const endOf = (i) => {
    const text = clockAt(steps.end[i], steps.offset[i]);
    return text === "00:00" ? "24:00" : text;
  };

  // Steps of one local day make a row of the timeline.
  const days = [];
  for (let i = 0; i < n; i++) {
    if (!i || steps.day[i] !== steps.day[i - 1]) days.push({ day: data.days[steps.day[i]], first: i });
    days[days.length - 1].last = i;
  }
  const upHours = steps.up.reduce((sum, up, i) => sum + (up ? length(i) : 0), 0);

  // ---- a cell's day

  const read = (cell) => {
    const spells = [];
    let shadow = 0;
    for (let i = 0; i < n; i++) {
      if (!steps.up[i]) continue;
      if (inShadow(i, cell)) { shadow += length(i); continue; }
      const last = spells[spells.length - 1];
      if (last && last.to === i - 1 && steps.day[i] === steps.day[i - 1]) last.to = i;
      else spells.push({ from: i, to: i });
    }
    for (const spell of spells) {
      spell.hours = (steps.end[spell.to] - steps.start[spell.from]) / 3600;
    }
    return { shadow, sun: upHours - shadow, spells };
  };
  const withDay = (i, text) => (days.length > 1 ? data.days[steps.day[i]] + " " : "") + text;

  const drawLine = (cell) => {
    const wide = 320, left = days.length > 1 ? 74 : 0, high = 22;
    const seconds = (d) => [steps.start[d.first], steps.end[d.last]];
    const local = (t, d) => t + steps.offset[d.first] - Date.parse(d.day) / 1000;
    const low = Math.min(...days.map((d) => local(seconds(d)[0], d)));
    const top = Math.max(...days.map((d) => local(seconds(d)[1], d)));
    const place = (t, d) => left + ((local(t, d) - low) / (top - low)) * (wide - left);
    let svg = "";
    days.forEach((d, row) => {
      const y = row * (high + 5);
      if (left) svg += `<text x="0" y="${y + 15}" font-size="11" fill="#5a5a64">${d.day}</text>`;
      for (let i = d.first; i <= d.last; ) {
        const kind = !steps.up[i] ? "#c9c9d1" : inShadow(i, cell) ? "#39456b" : "#f2b632";
        let j = i;
        const same = (k) => (!steps.up[k] ? "#c9c9d1" : inShadow(k, cell) ? "#39456b" : "#f2b632") === kind;
        while (j < d.last && same(j + 1)) j++;
        const x = place(steps.start[i], d), w = place(steps.end[j], d) - x;
        svg += `<rect x="${x.toFixed(2)}" y="${y}" width="${w.toFixed(2)}" height="${high}" fill="${kind}"/>`;
        i = j + 1;
      }
      if (now >= d.first && now <= d.last) {
        const x = place(steps.mid[now], d).toFixed(2);
        svg += `<path d="M${x} ${y - 2}V${y + high + 2}" stroke="#fff" stroke-width="4"/>`;
        svg += `<path d="M${x} ${y - 2}V${y + high + 2}" stroke="#1c1c22" stroke-width="1.6"/>`;
      }
    });
    const bottom = days.length * (high + 5) + 2;
    const apart = [0.25, 0.5, 1, 2, 3, 4, 6].find((h) => ((top - low) / 3600 / h) * 56 <= wide - left) || 6;
    for (let t = Math.ceil(low / 3600 / apart) * apart; t * 3600 <= top + 1; t += apart) {
      const x = left + ((t * 3600 - low) / (top - low)) * (wide - left);
      const anchor = x < left + 12 ? "start" : x > wide - 12 ? "end" : "middle";
      const text = two(Math.floor(t)) + ":" + two(Math.round((t % 1) * 60));
      svg += `<path d="M${x.toFixed(2)} ${bottom - 4}v4" stroke="#8c8c96"/>`;
      svg += `<text x="${x.toFixed(2)}" y="${bottom + 13}" font-size="11" fill="#5a5a64" text-anchor="${anchor}">${text}</text>`;
    }
    $("line").innerHTML =
      `<svg viewBox="0 -3 ${wide} ${bottom + 20}" role="img" aria-label="Sun and shadow through the day">${svg}</svg>`;
  };

  const number = (v) => v.toFixed(data.decimals).replace("-", "\u2212");
  const show = (cell) => {
    const row = Math.floor(cell / cols), col = cell % cols;
    const found = read(cell);
    if (isNothing(cell)) found.shadow = found.sun = found.spells.length = 0;
    const first = found.spells[0], last = found.spells[found.spells.length - 1];
    const longest = found.spells.reduce((a, b) => (a && a.hours >= b.hours ? a : b), null);
    const standing = heights[cell] > 0.005;
    const [up, across] = data.axes;
    $("where").textContent =
      `${across} ${number(data.x0 + col * data.dx)}, ${up} ${number(data.y0 + row * data.dy)}` +
      (data.has_scale ? " m" : "") +
      (isNothing(cell) ? ": nothing is seen here" : "") +
      (standing
        ? data.receivers === "top"
          ? `, ${heights[cell].toFixed(1)} m above the ground`
          : ", on the ground under a building"
        : "");
    $("in-sun").textContent = say(found.sun);
    $("in-shadow").textContent = say(found.shadow);
    $("first").textContent = first ? withDay(first.from, startOf(first.from)) : "none";
    $("last").textContent = last ? withDay(last.to, endOf(last.to)) : "none";
    $("spells").textContent = String(found.spells.length);
    $("longest").textContent = longest ? say(longest.hours) : "none";
    const some = found.spells.slice(0, 12);
    $("spell-list").textContent = some.length
      ? "Sun from " + some.map((s) => withDay(s.from, startOf(s.from) + "\u2013" + endOf(s.to))).join(", ") +
        (found.spells.length > 12 ? " and later" : "")
      : isNothing(cell) ? "" : upHours ? "No sun in this period." : "The sun stays below the horizon.";
    const dt = $("in-sun").previousElementSibling;
    dt.textContent = "in the sun, of " + say(upHours);
    drawLine(cell);
  };

  // ---- the plan, or the view

  const map = $("map"), pen = map.getContext("2d");
  const layer = document.createElement("canvas");
  layer.width = cols; layer.height = rows;
  const layerPen = layer.getContext("2d");
  const image = layerPen.createImageData(cols, rows);
  const pixels = new Uint32Array(image.data.buffer);
  const little = new Uint8Array(new Uint32Array([1]).buffer)[0] === 1;
  const color = (r, g, b, a) =>
    (little ? (a << 24) | (b << 16) | (g << 8) | r : (r << 24) | (g << 16) | (b << 8) | a) >>> 0;
  const SHADE = color(57, 69, 107, 175), CLEAR = 0;

  let now = 0, pinned = 0, hovered = -1, mode = "shadow", timer = 0;
  let hoursOfCells = null;
  const allHours = () => {
    if (hoursOfCells) return hoursOfCells;
    hoursOfCells = new Float32Array(cells);
    for (let i = 0; i < n; i++) {
      if (!steps.up[i]) continue;
      const base = i * perMask, h = length(i);
      for (let byte = 0; byte < perMask; byte++) {
        const value = bits[base + byte];
        if (!value) continue;
        for (let k = 0; k < 8; k++) {
          const cell = byte * 8 + k;
          if (value & (128 >> k) && cell < cells) hoursOfCells[cell] += h;
        }
      }
    }
    return hoursOfCells;
  };

  const paintLayer = () => {
    const hours = mode === "hours" ? allHours() : null;
    const colors = hours && ramp.map(([r, g, b]) => color(r, g, b, 255));
    for (let row = 0; row < rows; row++) {
      const out = (rows - 1 - row) * cols;  // rows of the data run north, those of a picture south
      for (let col = 0; col < cols; col++) {
        const cell = row * cols + col;
        pixels[out + col] = hours
          ? colors[Math.min(ramp.length - 1, Math.round((hours[cell] / (upHours || 1)) * (ramp.length - 1)))]
          : steps.up[now] && inShadow(now, cell) ? SHADE : CLEAR;
        if (isNothing(cell)) pixels[out + col] = CLEAR;
      }
    }
    layerPen.putImageData(image, 0, 0);
  };

  const paint = () => {
    const scale = map.width / cols;
    const dot = map.width / (map.clientWidth || map.width);  // device pixels of one CSS pixel
    pen.imageSmoothingEnabled = scale < 2;
    pen.fillStyle = !data.is_plan ? "#ffffff" : !steps.up[now] && mode === "shadow" ? "#d9d9e0" : "#fbf8f0";
    pen.fillRect(0, 0, map.width, map.height);
    const draw = (what) => pen.drawImage(what, 0, 0, map.width, map.height);
    if (mode === "hours") {
      draw(layer);
      if (data.receivers === "ground") draw(roofs);
      else {  // a little of the surfaces' shading, so that their forms show
        pen.globalCompositeOperation = "multiply";
        pen.globalAlpha = 0.5;
        draw(roofs);
        pen.globalCompositeOperation = "source-over";
        pen.globalAlpha = 1;
      }
    } else if (data.receivers === "ground") { draw(layer); draw(roofs); }
    else { draw(roofs); draw(layer); }
    if (data.has_scale) drawScale(dot);
    if (data.is_plan) { drawNorth(dot); drawSun(dot); }
    const cell = hovered < 0 ? pinned : hovered;
    const x = ((cell % cols) + 0.5) * scale;
    const y = (rows - 0.5 - Math.floor(cell / cols)) * (map.height / rows);
    for (const [style, width] of [["#ffffff", 5], ["#c2261d", 2.4]]) {
      pen.strokeStyle = style;
      pen.lineWidth = width * dot;
      pen.beginPath();
      pen.arc(x, y, 7 * dot, 0, 7);
      pen.stroke();
    }
  };
  const halo = (text, x, y, dot) => {
    pen.font = `${12 * dot}px system-ui, sans-serif`;
    pen.lineJoin = "round";
    pen.lineWidth = 3.5 * dot;
    pen.strokeStyle = "rgba(255,255,255,0.9)";
    pen.strokeText(text, x, y);
    pen.fillStyle = "#1c1c22";
    pen.fillText(text, x, y);
  };
  const drawScale = (dot) => {
    const perMetre = map.width / (cols * data.dx);
    let metres = 10 ** Math.floor(Math.log10((map.width * 0.28) / perMetre));
    for (const times of [5, 2]) if (metres * times * perMetre <= map.width * 0.28) { metres *= times; break; }
    const x = 12 * dot, y = map.height - 14 * dot, w = metres * perMetre;
    pen.fillStyle = "#ffffff";
    pen.fillRect(x - 2 * dot, y - 2 * dot, w + 4 * dot, 8 * dot);
    pen.fillStyle = "#1c1c22";
    pen.fillRect(x, y, w, 4 * dot);
    pen.fillStyle = "#ffffff";
    pen.fillRect(x + w / 2, y + dot, w / 2 - dot, 2 * dot);
    halo(metres >= 2000 ? metres / 1000 + " km" : metres + " m", x, y - 6 * dot, dot);
  };
  const drawNorth = (dot) => {
    const turn = (data.north * Math.PI) / 180;
    pen.save();
    pen.translate(map.width - 26 * dot, 32 * dot);
    pen.rotate(turn);
    for (const side of [-1, 1]) {
      pen.beginPath();
      pen.moveTo(0, -14 * dot);
      pen.lineTo(side * 7 * dot, 13 * dot);
      pen.lineTo(0, 7 * dot);
      pen.closePath();
      pen.fillStyle = side < 0 ? "#1c1c22" : "#ffffff";
      pen.strokeStyle = "#1c1c22";
      pen.lineWidth = dot;
      pen.fill();
      pen.stroke();
    }
    pen.translate(0, -17 * dot);
    pen.rotate(-turn);
    pen.textAlign = "center";
    halo("N", 0, 0, dot);
    pen.textAlign = "start";
    pen.restore();
  };
  const drawSun = (dot) => {
    // A small sun on the plan's rim, where the light comes from.
    if (mode !== "shadow" || !steps.up[now]) return;
    const a = ((steps.azimuth[now] + data.north) * Math.PI) / 180;
    const dx = Math.sin(a), dy = -Math.cos(a);
    const w = map.width / 2 - 14 * dot, h = map.height / 2 - 14 * dot;
    const reach = Math.min(dx ? w / Math.abs(dx) : Infinity, dy ? h / Math.abs(dy) : Infinity);
    pen.beginPath();
    pen.arc(map.width / 2 + dx * reach, map.height / 2 + dy * reach, 8 * dot, 0, 7);
    pen.fillStyle = "#f2b632";
    pen.strokeStyle = "#7a5200";
    pen.lineWidth = 1.4 * dot;
    pen.fill();
    pen.stroke();
  };

  const fit = () => {
    const wide = Math.max(1, map.parentElement.clientWidth);
    // A tall plan is held to the window's height, so that the slider stays in view.
    const most = Math.max(320, window.innerHeight * 0.82);
    const shown = Math.min(wide, (most * cols * data.dx) / (rows * data.dy));
    const dot = Math.min(window.devicePixelRatio || 1, 3);
    map.style.width = shown + "px";
    map.style.margin = "0 auto";
    map.width = Math.round(shown * dot);
    map.height = Math.max(1, Math.round((map.width * rows * data.dy) / (cols * data.dx)));
    paint();
  };

  // ---- moving through time

  const slider = $("time");
  slider.max = n - 1;
  const go = (step) => {
    now = Math.max(0, Math.min(n - 1, step));
    slider.value = now;
    const span = withDay(now, startOf(now) + "\u2013" + endOf(now)) + " " + steps.name[now];
    $("clock").textContent = span;
    $("sun").textContent = steps.up[now]
      ? `sun ${steps.altitude[now].toFixed(1)}° high, azimuth ${steps.azimuth[now].toFixed(1)}°, as at ` +
        clockAt(steps.mid[now], steps.offset[now])
      : "the sun is below the horizon";
    slider.setAttribute("aria-valuetext", span);
    if (mode === "shadow") paintLayer();
    paint();
    drawLine(hovered < 0 ? pinned : hovered);
  };
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    $("play-icon").setAttribute("d", "M4 2v12l10-6z");
    $("play").setAttribute("aria-label", "Play the day");
  };
  const play = () => {
    if (timer) return stop();
    if (now === n - 1) go(0);
    const stride = Math.max(1, Math.round(n / 240));
    timer = setInterval(() => (now >= n - 1 ? stop() : go(now + stride)), 120);
    $("play-icon").setAttribute("d", "M3 2h4v12H3zM9 2h4v12H9z");
    $("play").setAttribute("aria-label", "Pause");
  };
  $("play").addEventListener("click", play);
  slider.addEventListener("input", () => { stop(); go(Number(slider.value)); });
  for (const choice of document.getElementsByName("mode")) {
    choice.addEventListener("change", () => {
      mode = choice.value;
      $("key").hidden = mode !== "hours";
      paintLayer();
      paint();
    });
  }

  // ---- reading a point

  const cellAt = (event) => {
    const box = map.getBoundingClientRect();
    const col = Math.floor(((event.clientX - box.left) / box.width) * cols);
    const row = rows - 1 - Math.floor(((event.clientY - box.top) / box.height) * rows);
    return col < 0 || row < 0 || col >= cols || row >= rows ? -1 : row * cols + col;
  };
  const hover = (cell) => {
    if (cell === hovered) return;
    hovered = cell;
    show(cell < 0 ? pinned : cell);
    paint();
  };
  map.addEventListener("pointermove", (event) => { if (event.pointerType === "mouse") hover(cellAt(event)); });
  map.addEventListener("pointerleave", () => hover(-1));
  map.addEventListener("click", (event) => {
    const cell = cellAt(event);
    if (cell < 0) return;
    pinned = cell;
    show(cell);
    paint();
  });
  const move = (dx, dy, times) => {
    const col = Math.max(0, Math.min(cols - 1, (pinned % cols) + dx * times));
    const row = Math.max(0, Math.min(rows - 1, Math.floor(pinned / cols) + dy * times));
    pinned = row * cols + col;
    hovered = -1;
    show(pinned);
    paint();
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const at = document.activeElement, arrow = arrows[event.key];
    if (at === map && arrow) move(...arrow, event.shiftKey ? 10 : 1);
    else if (at === slider || (at && /^(INPUT|BUTTON)$/.test(at.tagName) && event.key === " ")) return;
    else if (at && at.type === "radio") return;
    else if (event.key === " ") play();
    else if (event.key === "ArrowLeft" || event.key === "ArrowRight") { stop(); go(now + arrow[0]); }
    else if (event.key === "Home") { stop(); go(0); }
    else if (event.key === "End") { stop(); go(n - 1); }
    else return;
    event.preventDefault();
  });

  // ---- begin: about noon, at an open place with about half the day's sun

  const strip = $("ramp").getContext("2d");
  $("ramp").width = ramp.length;
  ramp.forEach(([r, g, b], i) => { strip.fillStyle = `rgb(${r},${g},${b})`; strip.fillRect(i, 0, 1, 1); });
  $("key-high").textContent = say(upHours);
  let best = Infinity;
  const hours = allHours();
  for (let cell = 0; cell < cells; cell++) {
    if (heights[cell] > 0.005 || isNothing(cell)) continue;
    const dc = (cell % cols) / cols - 0.5, dr = Math.floor(cell / cols) / rows - 0.5;
    const off = Math.abs(hours[cell] / (upHours || 1) - 0.5) + 0.5 * Math.hypot(dc, dr);
    if (off < best) { best = off; pinned = cell; }
  }
  let noon = 0;
  steps.altitude.forEach((a, i) => { if (a > steps.altitude[noon]) noon = i; });
  $("stage").hidden = false;
  show(pinned);
  go(noon);
  fit();
  window.addEventListener("resize", fit);
  window.addEventListener("beforeprint", fit);
  document.documentElement.dataset.ready = "yes";
})();
