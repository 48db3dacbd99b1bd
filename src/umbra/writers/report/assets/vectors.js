// The map's hours in finer steps, and what is drawn over it as lines: sharp at any size.

const readPaths = async (packed) => {
  // A path for each set of lines, in cells of the picture from its upper left corner.
  const counts = await unpack(packed.counts), points = await unpack(packed.points);
  const total = points.length / 2, lines = [];
  for (let line = 0, at = 0; line < counts.length; at += counts[line++]) {
    const xy = new Float32Array(2 * counts[line]);
    for (let k = 0; k < counts[line]; k++) {
      xy[2 * k] = (points[at + k] * packed.unit * data.cols) / packed.cols;
      xy[2 * k + 1] = data.rows - (points[total + at + k] * packed.unit * data.rows) / packed.rows;
    }
    lines.push(xy);
  }
  const path = new Path2D();
  for (const xy of lines) {
    path.moveTo(xy[0], xy[1]);
    for (let k = 2; k < xy.length; k += 2) path.lineTo(xy[k], xy[k + 1]);
  }
  return { path, longest: lines.reduce((a, b) => (a && a.length >= b.length ? a : b), null) };
};

const readFine = async () => {
  if (!data.fine) return null;
  const { rows, cols, unit, per_hour: perHour, dates } = data.fine;
  const scale = async (text) => Float32Array.from(await unpack(text), (value) => value / perHour);
  const lines = (levels) =>
    Promise.all((levels || []).map(async (line) => ({ level: line.level, ...(await readPaths({ rows, cols, unit, ...line })) })));
  return {
    rows, cols,
    dates: await Promise.all(dates.map(async (date) => ({
      up: date.up, hours: await scale(date.hours), lost: date.lost ? await scale(date.lost) : null,
      lines: await lines(date.lines), lostLines: await lines(date.lost_lines),
    }))),
  };
};

const makeVectors = (pen, canvas) => {
  const stroke = (path, { left, top, across, down }, style, wide, dot) => {
    pen.save();
    pen.setTransform(across, 0, 0, down, left, top);
    pen.lineWidth = (wide * dot) / across;
    pen.lineJoin = "round";
    pen.strokeStyle = style;
    pen.stroke(path);
    pen.restore();
  };
  const hatch = (path, { left, top, across, down }, dot) => {
    pen.save();
    pen.setTransform(across, 0, 0, down, left, top);
    pen.clip(path, "evenodd");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.strokeStyle = "rgba(28, 28, 34, 0.75)";
    pen.lineWidth = dot;
    pen.beginPath();
    for (let at = -canvas.height; at < canvas.width; at += 6 * dot) { pen.moveTo(at, canvas.height); pen.lineTo(at + canvas.height, 0); }
    pen.stroke();
    pen.restore();
  };
  const levels = (lines, most, place, dot, halo, named) => {
    // Lines of equal hours, each with its hours once, in the middle of the longest, free of names.
    const taken = [...named];
    for (const { level, path } of lines)
      stroke(path, place, Math.abs(level) / most > 0.6 && data.show !== "sun" ? "rgba(255, 255, 255, 0.9)" : "rgba(28, 28, 34, 0.65)", 0.9, dot);
    for (const { level, longest } of lines) {
      for (let part = 2; part < 9; part++) {
        const k = 2 * Math.floor((longest.length / 2) * ((part % 8) / 8 + 0.06));
        const x = place.left + longest[k] * place.across, y = place.top + longest[k + 1] * place.down, room = 26 * dot;
        if (x < room || y < room || x > canvas.width - room || y > canvas.height - room) continue;
        if (taken.some(([a, b]) => Math.hypot(a - x, b - y) < 2 * room)) continue;
        taken.push([x, y]);
        pen.textAlign = "center";
        halo(`${Math.abs(level)} h`, x, y + 4 * dot, dot);
        pen.textAlign = "start";
        break;
      }
    }
  };
  return { stroke, hatch, levels };
};
