// What is drawn over a plan or a view: scale, north, halos, the mark of a place.

const BELOW = 84;  // of a picture, the room for the slider within a window's height [CSS pixels]
const LEAST = 480;  // width of what is under a picture: a slider, its clock and three times of day [CSS pixels]

const makeSigns = (pen, canvas) => {
  const halo = (text, x, y, dot) => {
    pen.font = `${12 * dot}px system-ui, sans-serif`;
    pen.lineJoin = "round";
    pen.lineWidth = 3.5 * dot;
    pen.strokeStyle = "rgba(255,255,255,0.9)";
    pen.strokeText(text, x, y);
    pen.fillStyle = "#1c1c22";
    pen.fillText(text, x, y);
  };
  const scale = (perMetre, dot, atRight = false) => {
    const most = canvas.width * 0.28;
    let metres = 10 ** Math.floor(Math.log10(most / perMetre));
    for (const times of [5, 2]) if (metres * times * perMetre <= most) { metres *= times; break; }
    const w = metres * perMetre, x = atRight ? canvas.width - w - 12 * dot : 12 * dot, y = canvas.height - 14 * dot;
    pen.fillStyle = "#ffffff";
    pen.fillRect(x - 2 * dot, y - 2 * dot, w + 4 * dot, 8 * dot);
    pen.fillStyle = "#1c1c22";
    pen.fillRect(x, y, w, 4 * dot);
    pen.fillStyle = "#ffffff";
    pen.fillRect(x + w / 2, y + dot, w / 2 - dot, 2 * dot);
    halo(metres >= 2000 ? metres / 1000 + " km" : Number(metres.toPrecision(1)) + " m", x, y - 6 * dot, dot);
  };
  const north = (degrees, dot, squeeze = 1) => {
    const turn = (degrees * Math.PI) / 180;
    const flat = Math.max(squeeze, 0.4);  // as it lies on the ground, seen from the side
    pen.save();
    pen.translate(canvas.width - 28 * dot, 34 * dot);
    pen.save();
    pen.scale(1, flat);
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
    pen.restore();
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    halo("N", Math.sin(turn) * 21 * dot, -Math.cos(turn) * 21 * dot * flat, dot);
    pen.restore();
  };
  const sun = (x, y, dot) => {
    pen.beginPath();
    pen.arc(x, y, 8 * dot, 0, 7);
    pen.fillStyle = "#f2b632";
    pen.strokeStyle = "#7a5200";
    pen.lineWidth = 1.4 * dot;
    pen.fill();
    pen.stroke();
  };
  const ring = (x, y, dot, isDashed = false) => {
    pen.setLineDash(isDashed ? [3 * dot, 3 * dot] : []);
    for (const [style, width] of [["#ffffff", 5], ["#c2261d", 2.4]]) {
      pen.strokeStyle = style;
      pen.lineWidth = width * dot;
      pen.beginPath();
      pen.arc(x, y, 7 * dot, 0, 7);
      pen.stroke();
    }
    pen.setLineDash([]);
  };
  const pins = (places, dot) => {
    // Places that rules judge: the point is the place, the head says the outcome, by form too.
    const taken = [];
    for (const { x, y, passes } of places) {
      const r = 8 * dot, high = y - 2.2 * r;
      pen.beginPath();
      pen.arc(x, high, r, Math.PI * 0.85, Math.PI * 0.15);
      pen.lineTo(x, y);
      pen.closePath();
      pen.fillStyle = passes ? "#1c6b37" : "#a32020";
      pen.strokeStyle = "#ffffff";
      pen.lineWidth = 1.6 * dot;
      pen.fill();
      pen.stroke();
      pen.beginPath();
      const marks = passes ? [[-3.5, 0.5], [-1, 3], [3.5, -3]] : [[-3, -3], [3, 3], null, [3, -3], [-3, 3]];
      let isNew = true;
      for (const mark of marks) {
        if (mark) pen[isNew ? "moveTo" : "lineTo"](x + mark[0] * dot, high + mark[1] * dot);
        isNew = !mark;
      }
      pen.stroke();
    }
    for (const { x, y, name } of places) {  // a name that would lie over another is left out
      const wide = 7 * dot * name.length, at = y - 14 * dot;
      if (taken.some(([tx, ty, tw]) => x < tx + tw && x + wide > tx && Math.abs(at - ty) < 14 * dot)) continue;
      taken.push([x, at, wide]);
      const isFar = x + 12 * dot + wide > canvas.width;
      pen.textAlign = isFar ? "right" : "left";
      halo(name, x + (isFar ? -12 : 12) * dot, at, dot);
      pen.textAlign = "left";
    }
  };
  return { halo, scale, north, sun, ring, pins };
};
