// A plan, an elevation or a camera's picture: a raster that is pointed at.

const makePlan = async () => {
  const { rows, cols } = data;
  const cells = rows * cols;
  const masks = await makeMasks(cells);
  const heights = new Float32Array(await inflate(data.heights));
  const roofs = await load(data.roofs);
  const relief = data.relief ? await load(data.relief) : null;
  const hours = data.hours ? new Float32Array(await inflate(data.hours)) : null;
  const behindHours = data.behind_hours ? new Float32Array(await inflate(data.behind_hours)) : null;
  const fine = await readFine();
  const { losses, lostOf, mostLost } = await readLosses(fine);
  const [outlines, proposed, newly] = await Promise.all(
    ["outlines", "proposed", "newly"].map((name) => (data[name] ? readPaths(data[name]) : null)));
  const context = await Promise.all((data.context || []).map(async (lines) => ({ ...await readPaths(lines), color: lines.color })));
  const exists = (cell) => !Number.isNaN(heights[cell]);

  const map = $("map"), pen = map.getContext("2d");
  const signs = makeSigns(pen, map), vectors = makeVectors(pen, map);
  const frame = makeWindow(map, cols, rows);
  const places = (data.places || []).map((place) => ({
    ...place, col: (place.x - data.x0) / data.dx + 0.5, row: rows - 0.5 - (place.y - data.y0) / data.dy,
  }));
  const areas = makeAreas(pen, map, (x, y) => [(x - data.x0) / data.dx + 0.5, rows - 0.5 - (y - data.y0) / data.dy]);
  const layer = document.createElement("canvas");
  const CLEAR = 0, SHADES = { lit: CLEAR, night: CLEAR, dark: color(57, 69, 107, 175), behind: color(66, 122, 72, 120) };
  const VOID = data.is_plan ? color(226, 226, 231) : CLEAR;  // where nothing receives
  $("void-key").hidden = !data.is_plan || !heights.some(Number.isNaN);

  let current = null;
  const shown = { key: "", hours: null, most: 0 };
  const chooseHours = (view) => {
    const [first, last] = view.mode === "day" ? [days[view.day].first, days[view.day].last] : [0, n - 1];
    const key = `${first} ${last}`;
    if (shown.key !== key) {
      const isAll = view.mode !== "day" && hours;
      Object.assign(shown, {
        key, hours: isAll ? hours : masks.sumHours(first, last), most: isAll ? data.up_hours : hoursUp(first, last),
      });
    }
    return shown;
  };
  // A date's hours in finer steps; sums of several dates and shadows of a moment have none.
  const fineOf = (view) =>
    fine && view.mode !== "shadow" && (view.mode !== "hours" || days.length === 1) ? fine.dates[steps.day[days[view.day].first]] : null;
  const fill = (wide, high, colorAt, on = layer) => {
    on.width = wide; on.height = high;
    const ink = on.getContext("2d"), image = ink.createImageData(wide, high), pixels = new Uint32Array(image.data.buffer);
    for (let row = 0; row < high; row++) {
      const out = (high - 1 - row) * wide;  // rows of the data run north, those of a picture south
      for (let col = 0; col < wide; col++) pixels[out + col] = colorAt(row * wide + col);
    }
    ink.putImageData(image, 0, 0);
  };
  const paintLayer = (view) => {
    const date = fineOf(view);
    if (date)
      return fill(fine.cols, fine.rows, (cell) => date.hours[cell] < 0 ? VOID
        : view.mode === "lost" ? lossOf(date.lost[cell], mostLost) : colorOf(date.hours[cell], date.up));
    const lost = view.mode === "lost" ? lostOf(view) : null;
    const chosen = lost || view.mode === "shadow" ? null : chooseHours(view);
    fill(cols, rows, (cell) => !exists(cell) ? VOID
      : lost ? lossOf(lost[cell], mostLost)
      : chosen ? colorOf(chosen.hours[cell], chosen.most)
      : SHADES[masks.kindOf(view.now, cell)]);
  };
  const drawSun = (view, dot) => {
    // A small sun on the plan's rim, where the light comes from.
    if (view.mode !== "shadow" || !steps.up[view.now]) return;
    const a = ((steps.azimuth[view.now] + data.north) * Math.PI) / 180;
    const dx = Math.sin(a), dy = -Math.cos(a);
    const w = map.width / 2 - 14 * dot, h = map.height / 2 - 14 * dot;
    const reach = Math.min(dx ? w / Math.abs(dx) : Infinity, dy ? h / Math.abs(dy) : Infinity);
    signs.sun(map.width / 2 + dx * reach, map.height / 2 + dy * reach, dot);
  };
  const middleOf = (cell) => [(cell % cols) + 0.5, rows - 0.5 - Math.floor(cell / cols)];
  const draw = (view) => {
    current = view;
    const { across, down, left, top } = frame.lay();
    const dot = map.width / (map.clientWidth || map.width);  // device pixels of one CSS pixel
    const isNight = !steps.up[view.now] && view.mode === "shadow";
    pen.imageSmoothingEnabled = across < 2;
    pen.fillStyle = !data.is_plan ? "#ffffff" : isNight ? "#d9d9e0" : "#fbf8f0";
    pen.fillRect(0, 0, map.width, map.height);
    const lay = (what) => pen.drawImage(what, left, top, cols * across, rows * down);
    if (data.under_roofs) { lay(layer); lay(roofs); }
    else if (view.mode === "shadow") { lay(roofs); lay(layer); }
    else { lay(layer); if (relief) lay(relief); }  // so little shade that colours stay those of the legend
    const place = { left, top, across, down }, date = fineOf(view), isLoss = view.mode === "lost";
    for (const lines of context) vectors.stroke(lines.path, place, lines.color, 0.7, dot);
    if (isLoss && newly) vectors.hatch(newly.path, place, dot);
    const named = areas.list.map(({ spot: [x, y] }) => [left + x * across, top + y * down]);
    if (date) vectors.levels(isLoss ? date.lostLines : date.lines, isLoss ? mostLost : date.up, place, dot, signs.halo, named);
    if (outlines) vectors.stroke(outlines.path, place, "rgba(85, 85, 94, 0.8)", 0.7, dot);
    if (isLoss && proposed) vectors.stroke(proposed.path, place, "#c2261d", 1.8, dot);
    const hides = (from, to) => areas.list.some((_, k) => {  // an area at the foot of the map
      const [x0, , x1, y1] = areas.box(k);
      return left + x1 * across > from && left + x0 * across < to && top + y1 * down > map.height - 40 * dot;
    });
    const third = map.width * 0.32;
    if (data.has_scale) signs.scale(across / data.dx, dot, hides(0, third) && !hides(map.width - third, map.width));
    if (data.is_plan) { signs.north(data.north, dot); drawSun(view, dot); }
    areas.tell(...middleOf(view.chosen));
    areas.draw(left, top, across, down, dot, signs.halo);
    signs.pins(places.map((place) => ({ ...place, x: left + place.col * across, y: top + place.row * down })), dot);
    const [col, row] = middleOf(view.chosen);
    signs.ring(left + col * across, top + row * down, dot);
  };
  const drawMoment = (step, width) => {
    // A small picture of the shadows at a step, in the window of the map.
    const small = document.createElement("canvas"), shadows = document.createElement("canvas");
    const { across, down, left, top } = frame.lay(), size = width / map.width, ink = small.getContext("2d");
    small.width = width; small.height = Math.max(1, Math.round(map.height * size));
    fill(cols, rows, (cell) => (exists(cell) ? SHADES[masks.kindOf(step, cell)] : VOID), shadows);
    ink.imageSmoothingQuality = "high";
    ink.fillStyle = data.is_plan ? "#fbf8f0" : "#ffffff";
    ink.fillRect(0, 0, small.width, small.height);
    for (const what of data.under_roofs ? [shadows, roofs] : [roofs, shadows])
      ink.drawImage(what, left * size, top * size, cols * across * size, rows * down * size);
    return small.toDataURL();
  };
  const fit = (least = 1) => {
    const stage = $("stage");
    for (const side of ["--plan", "--beside"]) stage.style.removeProperty(side);
    const wide = Math.max(1, stage.querySelector(".left").clientWidth - 2);
    // A tall plan is held to the window's height, so that the slider stays in view.
    const held = () => {
      const from = map.getBoundingClientRect().top + window.scrollY;
      return (Math.max(320, window.innerHeight - from - BELOW) * cols * data.dx) / (rows * data.dy);
    };
    let shownWide = Math.min(wide, held());
    if (shownWide < wide) {  // what stands beside it begins where it ends
      stage.style.setProperty("--plan", Math.min(wide, Math.max(LEAST, shownWide)) + 2 + "px");
      stage.style.setProperty("--beside", "1fr");
      shownWide = Math.min(shownWide, held());  // its keys may have more lines now
    }
    const dot = Math.max(least, Math.min(window.devicePixelRatio || 1, 3));
    map.parentElement.style.width = shownWide + 2 + "px";  // with its border
    map.width = Math.round(shownWide * dot);
    map.height = Math.max(1, Math.round((map.width * rows * data.dy) / (cols * data.dx)));
  };

  // ---- reading a point

  const cellOf = (x, y) => {
    const col = Math.floor(x), row = rows - 1 - Math.floor(y);
    return col < 0 || row < 0 || col >= cols || row >= rows ? -1 : row * cols + col;
  };
  const cellAt = (event) => {
    // A pin draws the pointer to its own place.
    const [x, y] = frame.at(event), { across, down } = frame.lay(), reach = (8 * map.width) / map.clientWidth;
    const pin = places.find((place) => Math.hypot((place.col - x) * across, (place.row - y) * down) < reach);
    return pin ? cellOf(pin.col, pin.row) : cellOf(x, y);
  };
  const where = (cell) => {
    const row = Math.floor(cell / cols), col = cell % cols;
    const [up, across] = data.axes;
    const named = places.filter((place) => cellOf(place.col, place.row) === cell)
      .map((place) => place.name + (place.standing ? ", " + place.standing : "") + ": ");
    const inside = areas.find(...middleOf(cell)).map((k) => areas.list[k].name + ": ");
    return inside.join("") + named.join("") + `${across} ${number(data.x0 + col * data.dx)}, ${up} ${number(data.y0 + row * data.dy)}` +
      (data.has_scale ? " m" : "") +
      (exists(cell) ? "" : data.is_plan ? ": nothing receives here" : ": nothing is seen here") +
      (heights[cell] > 0.005
        ? data.under_roofs
          ? ", on the ground under a building"
          : `, ${heights[cell].toFixed(1)} m above the ground`
        : "");
  };
  const move = (key, isFar, cell) => {
    if (frame.press(key)) return cell;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
    if (!arrow) return null;
    const times = isFar ? 10 : 1;
    const col = Math.max(0, Math.min(cols - 1, (cell % cols) + arrow[0] * times));
    const row = Math.max(0, Math.min(rows - 1, Math.floor(cell / cols) + arrow[1] * times));
    frame.follow(col + 0.5, rows - 0.5 - row);
    return row * cols + col;
  };
  const show = (kind, index) => {
    if (kind === "area") {
      frame.show(areas.box(index));
      return cellOf(...areas.list[index].spot);
    }
    const { col, row } = places[index];
    frame.center(col, row);
    return cellOf(col, row);
  };
  const listen = ({ hover, pick }) => {
    const fingers = frame.listen(() => draw(current), (event) => {
      const cell = cellAt(event);
      if (cell >= 0) pick(cell);
    });
    map.addEventListener("pointermove", (event) => {
      if (event.pointerType === "mouse" && !fingers.size) hover(cellAt(event));
    });
    map.addEventListener("pointerleave", () => hover(-1));
  };
  const findLoss = () => {
    // The box of what loses an hour, or a quarter of the most, without specks, and of areas that fail.
    const least = Math.min(1, mostLost / 4), box = [cols, rows, 0, 0];
    const widen = ([left, top, right, bottom]) => {
      box[0] = Math.min(box[0], left); box[2] = Math.max(box[2], right);
      box[1] = Math.min(box[1], top); box[3] = Math.max(box[3], bottom);
    };
    for (const lost of losses) {
      const is = (cell) => Math.abs(lost[cell]) >= least;
      for (let cell = 0; cell < cells; cell++) {
        if (!is(cell) || ![1, -1, cols, -cols].every((step) => is(cell + step))) continue;
        const col = cell % cols, row = rows - 1 - Math.floor(cell / cols);
        widen([col - 1, row - 1, col + 2, row + 2]);
      }
    }
    if (box[2] > box[0]) areas.list.forEach((area, k) => area.verdict === "fail" && widen(areas.box(k)));
    return box;
  };
  const choose = () => {
    // A place near the middle, with about half the day's sun: open ground, or else no high roof.
    const sums = masks.sumHours(0, n - 1);
    let best = Infinity, chosen = 0;
    for (let cell = 0; cell < cells; cell++) {
      if (!exists(cell) || (data.under_roofs && heights[cell] > 0.005)) continue;
      const dc = (cell % cols) / cols - 0.5, dr = Math.floor(cell / cols) / rows - 0.5;
      const off = Math.abs(sums[cell] / (upHours || 1) - 0.5) + 0.5 * Math.hypot(dc, dr)
        + (data.under_roofs || !data.is_plan ? 0 : 0.02 * heights[cell]);
      if (off < best) { best = off; chosen = cell; }
    }
    return chosen;
  };
  return { ...masks, hours, behindHours, exists, where, move, show, listen, choose, paint: paintLayer, draw, fit, drawMoment,
    frameLoss: () => losses.length && frame.show(findLoss()),
    mostHours: (view) => (view.mode === "shadow" ? upHours : view.mode === "lost" ? mostLost : chooseHours(view).most) };
};
