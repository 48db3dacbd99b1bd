// The sky above the place that is read, drawn in the page from the model that it carries.

const LATER = 200;  // from a choice to its sky [ms]

const makeSky = (picture) => {
  const host = $("sky"), ask = $("sky-show"), way = $("sky-way");
  const tell = (words) => { way.textContent = words; way.hidden = !words; };
  if (!data.sky) {
    ask.hidden = true;
    tell($("live-show") ? "The sky above a place: show the live model below, and click the place." : "");
    return { show: () => {}, move: () => {} };
  }
  let model = null, sky = null, timer = 0, last = null;

  // Of a plan the surface that receives, as a ray from above meets it.
  const placeOf = (receiver) => {
    if (data.kind !== "plan") return { position: picture.place(receiver), normal: picture.normal(receiver), part: 0 };
    const { ground, added } = data.sky, row = Math.floor(receiver / data.cols), col = receiver % data.cols;
    const x = data.x0 + col * data.dx - model.origin[0], y = data.y0 + row * data.dy - model.origin[1];
    const top = model.bounds[1][2] + 1, met = model.trace([x, y, top], [0, 0, -1], { every: true });
    const hit = data.under_roofs ? met.find(({ part }) => added.includes(part)) : met[0];
    if (!hit) return ground === null ? null : { position: [x, y, ground - model.origin[2]], normal: [0, 0, 1], part: -1 };
    const own = model.faceNormal(hit.face), side = own[2] < 0 ? -1 : 1;
    return { position: [x, y, top - hit.distance], normal: own.map((v) => v * side), part: hit.part };
  };
  const whenOf = (view) => {
    const seconds = steps.mid[view.now] + steps.offset[view.now];
    return { date: days[view.day].day, minutes: (((seconds % 86400) + 86400) % 86400) / 60 };
  };
  const open = async () => {
    model ??= await kit.unpackModel(decode($("live-block").textContent));
    if (!sky) {
      sky = kit.makeModelSky(model);
      host.append(sky.body, sky.dialog);
      ask.hidden = true;
      host.hidden = false;
    }
  };
  const draw = async ({ receiver, view }) => {
    await open();
    const place = picture.exists(receiver) ? placeOf(receiver) : null;
    sky.body.hidden = !place;
    tell(place ? "" : "Nothing receives here.");
    if (!place) return;
    const cast = data.sky.cast && Uint8Array.from(model.parts, (_, part) => data.sky.cast.includes(part));
    sky.show(place, cast, whenOf(view), "this place");
  };
  const show = (receiver, view) => {
    last = { receiver, view };
    clearTimeout(timer);
    timer = setTimeout(() => draw(last), sky ? LATER : 0);
  };
  ask.addEventListener("click", () => draw(last));
  ask.hidden = false;
  return {
    show: (receiver, view, isAsked) => {
      if (sky || isAsked) show(receiver, view);
      else last = { receiver, view };
    },
    move: (view) => sky?.moveSun(whenOf(view)),
  };
};
