// One receiver's sun: its spells, their figures, and a line for each day.

const findSpells = (kindOf, receiver, first, last) => {
  const spells = [];
  let shadow = 0, behind = 0;
  for (let i = first; i <= last; i++) {
    if (!steps.up[i]) continue;
    const kind = kindOf(i, receiver);
    if (kind === "behind") { behind += length(i); shadow += (1 - data.share[i]) * length(i); }
    else if (kind === "dark") shadow += length(i);
    if (kind !== "lit") continue;  // a spell is of sun that nothing weakens
    const before = spells[spells.length - 1];
    if (before && before.to === i - 1 && steps.day[i] === steps.day[i - 1]) before.to = i;
    else spells.push({ from: i, to: i });
  }
  for (const spell of spells) {
    spell.hours = (steps.end[spell.to] - steps.start[spell.from]) / 3600;
  }
  return { shadow, behind, sun: hoursUp(first, last) - shadow, spells };
};

const tellSum = (picture) =>
  days.length > 1 ? `, sum of ${picture.hours ? data.days.length : days.length} dates` : "";

const labelOf = (id) => $(id).closest("div").querySelector("dt");

// Of several dates the one that is chosen; their sum only while the picture shows it.
const showFigures = (picture, receiver, view) => {
  const isSum = days.length > 1 && view.mode === "hours", isOne = days.length > 1 && !isSum;
  const { day, first: from, last: to } = isOne ? days[view.day] : { first: 0, last: n - 1 };
  const isOwn = !isOne && picture.hours;
  const upHere = isOwn ? data.up_hours : hoursUp(from, to);
  const figures = findSpells(picture.kindOf, receiver, from, to);
  const isThere = picture.exists(receiver);
  if (!isThere) figures.shadow = figures.behind = figures.sun = figures.spells.length = 0;
  else if (isOwn) {  // the study's own, solved or of more instants than are shown
    figures.shadow = picture.hours[receiver];
    figures.sun = data.up_hours - figures.shadow;
    if (picture.behindHours) figures.behind = picture.behindHours[receiver];
  }
  const first = figures.spells[0], last = figures.spells[figures.spells.length - 1];
  const longest = figures.spells.reduce((a, b) => (a && a.hours >= b.hours ? a : b), null);
  const tell = (i, text) => (isOne ? text : withDay(i, text));
  $("where").textContent = picture.where(receiver);
  $("in-sun").textContent = say(figures.sun);
  $("of-up").textContent = ` of ${say(upHere)}`;
  $("in-shadow").textContent = say(figures.shadow);
  $("behind").textContent = say(figures.behind);
  $("first").textContent = first ? tell(first.from, startOf(first.from)) : "none";
  $("last").textContent = last ? tell(last.to, endOf(last.to)) : "none";
  $("spells").textContent = String(figures.spells.length);
  $("longest").textContent = longest ? say(longest.hours) : "none";
  const listed = figures.spells.slice(0, 12);
  const texts = listed.map((s) => tell(s.from, startOf(s.from) + "\u2013" + endOf(s.to)));
  $("spell-list").innerHTML = listed.length
    ? `${data.behind ? "In unweakened sun" : "In the sun"} ${texts.map((text) => `<span>${text}</span>`).join(", ")}` + (figures.spells.length > 12 ? " and later" : "")
    : !isThere ? "" : upHere ? `No ${data.behind ? "unweakened " : ""}sun ${isOne ? "on this date" : "in this period"}.` : "The sun stays below the horizon.";
  const which = isSum ? tellSum(picture) : isOne ? ` on ${nameDay(day, "short")}` : "";
  labelOf("in-sun").textContent = "sun" + which;
  labelOf("in-shadow").textContent = "shadow" + which;
  return which;
};

const drawLine = (kindOf, receiver, now) => {
  const wide = 320, left = days.length > 1 ? 74 : 0, high = days.length > 40 ? 12 : 22, gap = 5;
  const seconds = (d) => [steps.start[d.first], steps.end[d.last]];
  const local = (t, d) => t + steps.offset[d.first] - Date.parse(d.day) / 1000;
  const low = Math.min(...days.map((d) => local(seconds(d)[0], d)));
  const top = Math.max(...days.map((d) => local(seconds(d)[1], d)));
  const place = (t, d) => left + ((local(t, d) - low) / (top - low)) * (wide - left);
  let svg = "";
  days.forEach((d, row) => {
    const y = row * (high + gap);
    if (left) svg += `<text x="0" y="${y + high - 7 + (high < 20 ? 4 : 0)}">${nameDay(d.day, "short")}</text>`;
    for (let i = d.first; i <= d.last; ) {
      const kind = kindOf(i, receiver);
      let j = i;
      while (j < d.last && kindOf(j + 1, receiver) === kind) j++;
      const x = place(steps.start[i], d), w = place(steps.end[j], d) - x;
      svg += `<rect class="${kind}" x="${x.toFixed(2)}" y="${y}" width="${w.toFixed(2)}" height="${high}"/>`;
      i = j + 1;
    }
    if (now >= d.first && now <= d.last) {
      const x = place(steps.mid[now], d).toFixed(2);
      svg += `<path d="M${x} ${y - 2}V${y + high + 2}" stroke="#fff" stroke-width="4"/>`;
      svg += `<path d="M${x} ${y - 2}V${y + high + 2}" stroke="#1c1c22" stroke-width="1.6"/>`;
    }
  });
  const bottom = days.length * (high + gap) + 2;
  const apart = [0.25, 0.5, 1, 2, 3, 4, 6].find((h) => ((top - low) / 3600 / h) * 56 <= wide - left) || 6;
  for (let t = Math.ceil(low / 3600 / apart) * apart; t * 3600 <= top + 1; t += apart) {
    const x = left + ((t * 3600 - low) / (top - low)) * (wide - left);
    const anchor = x < left + 12 ? "start" : x > wide - 12 ? "end" : "middle";
    const text = two(Math.floor(t)) + ":" + two(Math.round((t % 1) * 60));
    svg += `<path class="tick" d="M${x.toFixed(2)} ${bottom - 4}v4"/>`;
    svg += `<text x="${x.toFixed(2)}" y="${bottom + 13}" text-anchor="${anchor}">${text}</text>`;
  }
  $("line").innerHTML =
    `<svg viewBox="0 -3 ${wide} ${bottom + 20}" role="img" aria-label="Sun and shadow through the day">${svg}</svg>`;
};
