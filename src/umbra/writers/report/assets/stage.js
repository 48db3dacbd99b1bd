// The stage: one picture, the clock and the date, a place that is read, and the keys.

const makeStage = (picture) => {
  const modes = [...document.getElementsByName("mode")];
  // Of several dates it begins with that of the first sentence; with the sum if that is of sums.
  const begin = days.findIndex((d) => d.day === data.first_day);
  if (days.length > 1 && begin >= 0 && modes.find((choice) => choice.checked).value === "hours")
    modes.find((choice) => choice.value === "day").checked = true;
  const mode = modes.find((choice) => choice.checked).value;
  const view = { now: 0, day: 0, mode, chosen: 0 };
  let pinned = 0, hovered = -1, timer = 0, speaking = 0, which = "";
  const slider = $("time"), chooser = $("day");
  const sky = makeSky(picture);

  const draw = () => {
    view.chosen = hovered < 0 ? pinned : hovered;
    picture.draw(view);
  };
  const read = () => {
    view.chosen = hovered < 0 ? pinned : hovered;
    which = showFigures(picture, view.chosen, view);
    drawLine(picture.kindOf, view.chosen, view.now);
  };
  const recolor = () => {
    picture.paint(view);
    const most = say(picture.mostHours(view)), hasWon = view.mode === "lost" && mostWon > 0;
    $("key-low").textContent = hasWon ? `won ${most}` : "0 h";
    $("key-high").textContent = hasWon ? `lost ${most}` : most;
    draw();
  };
  const dressKey = () => {
    const isLoss = view.mode === "lost", change = data.change_ramp || [];
    const colors = !isLoss ? ramp : mostWon ? change : change.slice((change.length - 1) / 2), strip = $("ramp").getContext("2d");
    $("key").hidden = view.mode === "shadow";
    $("ramp").width = colors.length;
    $("ramp").classList.toggle("mirrored", !isLoss && data.show === "sun");
    colors.forEach(([r, g, b], i) => { strip.fillStyle = `rgb(${r},${g},${b})`; strip.fillRect(i, 0, 1, 1); });
    $("no-sun").parentElement.hidden = isLoss;
    for (const part of document.querySelectorAll(".of-loss")) part.hidden = !isLoss || data.kind !== "plan";
  };
  const choose = (value) => {
    view.mode = value;
    modes.find((choice) => choice.value === value).checked = true;
    dressKey();
    recolor();
    read();
    markMoment();
  };
  // Who moves through time looks for shadows, not for the hours of the whole day.
  const follow = () => { if (data.kind === "plan" && view.mode !== "shadow") choose("shadow"); };

  // ---- moving through time

  const go = (step) => {
    const was = view.day;
    view.now = Math.max(0, Math.min(n - 1, step));
    view.day = dayOf(view.now);
    const { first, last } = days[view.day];
    slider.max = last - first;
    slider.value = view.now - first;
    chooser.value = view.day;
    const span = withDay(view.now, startOf(view.now) + "\u2013" + endOf(view.now)) + " " + steps.name[view.now];
    $("clock").textContent = span;
    $("sun").textContent = steps.up[view.now]
      ? `sun ${steps.altitude[view.now].toFixed(1)}° high, azimuth ${steps.azimuth[view.now].toFixed(1)}°, as at ` +
        clockAt(steps.mid[view.now], steps.offset[view.now])
      : "the sun is below the horizon";
    slider.setAttribute("aria-valuetext", span);
    if (data.behind) $("share").textContent = tellShare(data.share[view.now]);
    if (view.mode === "shadow" || (/^(day|lost)$/.test(view.mode) && was !== view.day)) recolor();
    else draw();
    if (was !== view.day) {
      showMoments();
      which = showFigures(picture, view.chosen, view);
      sky.show(pinned, view);
    } else sky.move(view);
    markMoment();
    drawLine(picture.kindOf, view.chosen, view.now);
  };
  const tellShare = (share) =>
    share < 1 ? `behind canopies: ${Number((100 * share).toPrecision(3))} % of the sun` : "canopies weaken nothing on this date";
  // The same day at three times, of which each is a way to it.
  const CLOCKS = [9, 12, 15], NEAR = 1800;
  const showMoments = () => {
    if (!picture.drawMoment) return;
    const { first, last, day } = days[view.day];
    const up = [...Array(last - first + 1).keys()].map((k) => first + k).filter((i) => steps.up[i]);
    const off = (i, hour) => Math.abs(steps.mid[i] + steps.offset[i] - Date.parse(day) / 1000 - 3600 * hour);
    let found = CLOCKS.map((hour) => up.reduce((a, b) => (off(b, hour) <= off(a, hour) ? b : a), up[0]))
      .filter((i, k) => i !== undefined && off(i, CLOCKS[k]) <= Math.max(NEAR, 3600 * length(i)));
    if (found.length < 3) found = [0, 0.5, 1].map((share) => up[Math.round(share * (up.length - 1))]);
    $("moments").replaceChildren(...[...new Set(found)].filter((i) => i !== undefined).map((step) => {
      const button = document.createElement("button"), image = new Image();
      Object.assign(image, { src: picture.drawMoment(step, 480), alt: "" });
      button.type = "button";
      button.dataset.step = step;
      button.append(image, startOf(step) + "\u2013" + endOf(step));
      button.addEventListener("click", () => { stop(); choose("shadow"); go(step); });
      return button;
    }));
  };
  const markMoment = () => {
    for (const button of $("moments").children)
      button.setAttribute("aria-pressed", String(view.mode === "shadow" && Number(button.dataset.step) === view.now));
  };
  const goToDay = (day) => {
    // The same clock time on the other date, as nearly as it has one.
    const clock = steps.mid[view.now] + steps.offset[view.now] - Date.parse(days[view.day].day) / 1000;
    const { first, last } = days[Math.max(0, Math.min(days.length - 1, day))];
    let best = first;
    const off = (i) => Math.abs(steps.mid[i] + steps.offset[i] - Date.parse(data.days[steps.day[i]]) / 1000 - clock);
    for (let i = first; i <= last; i++) if (off(i) < off(best)) best = i;
    go(best);
  };
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    $("play-icon").setAttribute("d", "M4 2v12l10-6z");
    $("play").setAttribute("aria-label", "Play the day");
  };
  const play = () => {
    if (timer) return stop();
    follow();
    const { first, last } = days[view.day];
    if (view.now === last) go(first);
    const stride = Math.max(1, Math.round((last - first + 1) / 240));
    timer = setInterval(() => (view.now >= last ? stop() : go(Math.min(last, view.now + stride))), 120);
    $("play-icon").setAttribute("d", "M3 2h4v12H3zM9 2h4v12H9z");
    $("play").setAttribute("aria-label", "Pause");
  };
  $("play").addEventListener("click", play);
  slider.addEventListener("input", () => { stop(); follow(); go(days[view.day].first + Number(slider.value)); });
  chooser.addEventListener("change", () => { stop(); goToDay(Number(chooser.value)); });
  for (const choice of modes) {
    choice.addEventListener("change", () => choose(choice.value));
  }

  // ---- reading a place

  const hover = (receiver) => {
    if (receiver === hovered) return;
    hovered = receiver;
    read();
    draw();
  };
  const pick = (receiver) => {
    pinned = receiver;
    hovered = -1;
    read();
    draw();
    sky.show(receiver, view, true);
    // For who listens: one short line, of the last of many moves.
    clearTimeout(speaking);
    speaking = setTimeout(() => {
      $("said").textContent = `${picture.where(receiver)}: ${$("in-sun").textContent} of sun${$("of-up").textContent}, ${$("in-shadow").textContent} of shadow${which}`;
    }, 500);
  };
  picture.listen({ hover, pick, draw, view });
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const at = document.activeElement, { first, last } = days[view.day];
    if (at === $("map")) {
      const moved = picture.move(event.key, event.shiftKey, pinned);
      if (moved !== null) {
        event.preventDefault();
        return moved === pinned ? draw() : pick(moved);
      }
    }
    const isTyped = at && /^(INPUT|SELECT|TEXTAREA)$/.test(at.tagName);
    if (at === slider || isTyped || (at && at.tagName === "BUTTON" && event.key === " ")) {
      if (at !== slider || !/^Page/.test(event.key)) return;
    }
    if (event.key === " ") play();
    else if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
      stop();
      follow();
      go(Math.max(first, Math.min(last, view.now + (event.key === "ArrowLeft" ? -1 : 1))));
    } else if (event.key === "Home") { stop(); go(first); }
    else if (event.key === "End") { stop(); go(last); }
    else if (/^Page(Up|Down)$/.test(event.key) && (days.length > 1 || at === slider)) {
      stop();
      goToDay(view.day + (event.key === "PageUp" ? -1 : 1));
    } else return;
    event.preventDefault();
  });

  // ---- begin: when the sun stands highest

  $("no-sun").style.background = `rgb(${data.no_sun})`;
  days.forEach((d, k) => chooser.add(new Option(nameDay(d.day), k)));
  chooser.hidden = days.length < 2;
  for (const part of document.querySelectorAll(".of-days")) part.hidden = days.length < 2;
  $("sum").textContent = tellSum(picture);
  if ($("lost-sum") && data.lost.length === 1) $("lost-sum").textContent = tellSum(picture);
  for (const part of document.querySelectorAll(".of-canopies")) part.hidden = !data.behind;
  pinned = picture.choose();
  const opening = days[Math.max(begin, 0)];
  let noon = opening.first;
  for (let i = opening.first; i <= opening.last; i++) if (steps.altitude[i] > steps.altitude[noon]) noon = i;
  $("stage").hidden = false;
  dressKey();
  const fit = (least = 1) => { picture.fit(least); draw(); };
  picture.fit();
  go(noon);
  recolor();
  read();
  sky.show(pinned, view);
  if (view.mode === "lost") { picture.frameLoss?.(); draw(); }
  showMoments();
  markMoment();
  window.addEventListener("resize", () => fit());
  // Paper is finer than a screen, and browsers misplace a canvas on it: it gets a picture.
  const paper = new Image();
  paper.id = "paper";
  paper.alt = $("map").getAttribute("aria-label");
  $("map").after(paper);
  window.addEventListener("beforeprint", () => {
    fit(2.5);
    paper.src = $("map").toDataURL();
    fit();
  });
  return { pick, view, draw };
};
