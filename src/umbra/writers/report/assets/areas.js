// Named areas over a plan: outlines, names, and the way between the map and their table.

const makeAreas = (pen, map, place) => {
  const verdicts = data.verdicts || {}, colors = data.verdict_colors || {};
  // Lines tell verdicts apart without their colours: lengths of dashes and gaps, in CSS pixels.
  const DASHES = { pass: [], fail: [7, 3], unknown: [2, 3] };
  const list = (data.areas || []).map(({ name, rings, x, y }) => ({
    name, verdict: verdicts[name], label: verdicts[name] ? `${name}: ${verdicts[name]}` : name, spot: place(x, y),
    rings: rings.map((ring) => ring.map(([a, b]) => place(a, b))),
  }));
  const MOST_NAMES = 40;
  let marked = -1;
  const box = (index) => {
    const corners = list[index].rings.flat(), [xs, ys] = [0, 1].map((k) => corners.map((corner) => corner[k]));
    return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
  };
  const holds = (rings, x, y) => {  // odd: inside a ring, and in no hole
    let inside = false;
    for (const ring of rings)
      for (let k = 1; k < ring.length; k++) {
        const [[a, b], [c, d]] = [ring[k - 1], ring[k]];
        if (b > y !== d > y && x < a + ((y - b) * (c - a)) / (d - b)) inside = !inside;
      }
    return inside;
  };
  const find = (x, y) => list.map((_, k) => k).filter((k) => holds(list[k].rings, x, y));
  const draw = (left, top, across, down, dot, halo) => {
    const trace = ({ rings }) => {
      pen.beginPath();
      for (const ring of rings) {
        ring.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](left + x * across, top + y * down));
        pen.closePath();
      }
    };
    pen.lineJoin = "round";
    list.forEach((area, k) => {
      trace(area);
      const wide = k === marked ? 4 : area.verdict ? 2.6 : 1.4;
      for (const [style, more, dashes] of [["rgba(255, 255, 255, 0.9)", 2.4, []], [colors[area.verdict] || "#1c1c22", 0, DASHES[area.verdict] || []]]) {
        pen.strokeStyle = style;
        pen.lineWidth = (wide + more) * dot;
        pen.setLineDash(dashes.map((length) => length * dot));
        pen.stroke();
      }
      pen.setLineDash([]);
    });
    pen.textAlign = "center";
    // The chosen area's name first, then those that fail; one that would lie on another is left out.
    const weight = (area) => 2 * (area === list[marked]) + (area.verdict === "fail");
    const named = [...list].sort((one, other) => weight(other) - weight(one)).slice(0, MOST_NAMES), taken = [];
    for (const { label, spot } of named) {
      const x = left + spot[0] * across, y = top + spot[1] * down;
      pen.font = `${12 * dot}px system-ui, sans-serif`;
      const half = pen.measureText(label).width / 2;
      if (taken.some(([a, b, reach]) => Math.abs(x - a) < half + reach && Math.abs(y - b) < 13 * dot)) continue;
      taken.push([x, y, half]);
      halo(label, x, y, dot);
    }
    pen.textAlign = "start";
  };

  const drawKey = () => {
    const told = ["fail", "unknown", "pass"].filter((verdict) => list.some((area) => area.verdict === verdict));
    if (told.length && list.some((area) => !area.verdict)) told.push("");
    const make = (name, attributes) => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", name);
      for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
      return made;
    };
    for (const verdict of told) {
      const picture = make("svg", { width: 22, height: 14, viewBox: "0 0 22 14", "aria-hidden": "true" });
      const box = { x: 2, y: 2, width: 18, height: 10, fill: "none" };
      picture.append(make("rect", { ...box, fill: "#ffffff", stroke: "#ffffff", "stroke-width": 4 }));
      picture.append(make("rect", {
        ...box, stroke: verdict ? colors[verdict] : "#1c1c22", "stroke-width": verdict ? 2.6 : 1.4,
        "stroke-dasharray": (DASHES[verdict] || []).join(" "),
      }));
      const one = document.createElement("span");
      one.className = "no-sun";
      one.append(picture, `area: ${verdict || "not judged"}`);
      $("area-key").append(one);
    }
    $("area-key").hidden = !told.length;
  };
  drawKey();

  // The row of the area at the chosen place is marked, and a button below the map leads to it.
  const back = document.createElement("button");
  Object.assign(back, { type: "button", className: "more", hidden: true });
  if (list.length) map.parentElement.after(back);
  const rowsOf = (k) => [...document.querySelectorAll(`tr[data-kind="area"][data-index="${k}"]`)];
  back.addEventListener("click", () => {
    const [row] = rowsOf(marked);
    row?.scrollIntoView({ block: "center" });
    row?.querySelector("button")?.focus({ preventScroll: true });
  });
  const tell = (x, y) => {
    const [now = -1] = find(x, y);
    if (now === marked) return;
    for (const row of rowsOf(marked)) row.classList.remove("chosen");
    marked = now;
    for (const row of rowsOf(marked)) row.classList.add("chosen");
    back.hidden = marked < 0 || !rowsOf(marked).length;
    if (marked >= 0) back.textContent = `${list[marked].name}: to its row in the table`;
  };
  return { list, box, find, draw, tell };
};
