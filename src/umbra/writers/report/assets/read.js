// What the file carries, unpacked, and how numbers and instants are said.

const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const { steps, ramp } = data;
const n = steps.start.length;
const { decode, inflate, unpack, packColor: color } = kit;

const load = (address) =>
  new Promise((done, failed) => {
    const image = new Image();
    image.onload = () => done(image);
    image.onerror = failed;
    image.src = address;
  });

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
const number = (v, decimals = data.decimals) => v.toFixed(decimals).replace("-", "\u2212");
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
const dayOf = (step) => days.findIndex((d) => step <= d.last);
const hoursUp = (first, last) => {
  let sum = 0;
  for (let i = first; i <= last; i++) if (steps.up[i]) sum += length(i);
  return sum;
};
const upHours = hoursUp(0, n - 1);
const years = new Set(data.days.map((day) => day.slice(0, 4)));
const nameDay = (day, month = "long") =>  // the title has the year, if it is one
  new Date(day + "T00:00Z").toLocaleDateString("en-GB", { day: "numeric", month, ...(years.size > 1 && { year: "numeric" }), timeZone: "UTC" });
const withDay = (i, text) => (days.length > 1 ? nameDay(data.days[steps.day[i]]) + ", " : "") + text;

// ---- masks: a bit for each receiver, of the steps with the sun up

const makeMasks = async (count) => {
  const perMask = Math.ceil(count / 8);
  const unpackMasks = async (text) => {
    const bits = new Uint8Array(await inflate(text));
    // Each is kept as what changes since the one before: shadows move slowly.
    for (let i = perMask; i < bits.length; i++) bits[i] ^= bits[i - perMask];
    return bits;
  };
  const shadow = await unpackMasks(data.bits);
  const behind = data.behind ? await unpackMasks(data.behind) : null;  // of it, what canopies alone cast
  const rowOf = [];
  let rows = 0;
  for (let i = 0; i < n; i++) rowOf.push(steps.up[i] ? rows++ : -1);
  const isIn = (bits, step, k) => (bits[rowOf[step] * perMask + (k >> 3)] >> (7 - (k & 7))) & 1;
  const kindOf = (step, k) =>
    rowOf[step] < 0 ? "night" : !isIn(shadow, step, k) ? "lit" : behind && isIn(behind, step, k) ? "behind" : "dark";
  const addHours = (hours, bits, first, last, weigh) => {
    for (let i = first; i <= last; i++) {
      if (rowOf[i] < 0) continue;
      const base = rowOf[i] * perMask, h = weigh(i);
      for (let byte = 0; byte < perMask; byte++) {
        const value = bits[base + byte];
        if (!value) continue;
        for (let k = 0; k < 8; k++) {
          const receiver = byte * 8 + k;
          if (value & (128 >> k) && receiver < count) hours[receiver] += h;
        }
      }
    }
  };
  const sumHours = (first, last) => {
    const hours = new Float32Array(count);
    addHours(hours, shadow, first, last, length);
    if (behind) addHours(hours, behind, first, last, (i) => -length(i) * data.share[i]);
    return hours;
  };
  return { kindOf, sumHours };
};

// ---- sun lost to a proposal: the arrays of each date, or one of all

// The scale ends at the figures' own most, as sentences tell it, though finer steps may reach a minute more.
const readLosses = async (fine = null) => {
  const losses = data.lost ? await Promise.all(data.lost.map(async (text) => new Float32Array(await inflate(text)))) : [];
  let lost = 0, won = 0;
  const reach = (all) => {
    for (const hours of all) for (const h of hours) { if (h > lost) lost = h; else if (-h > won) won = -h; }
  };
  reach(losses);
  if (fine && losses.length && Math.max(lost, won) === 0) reach(fine.dates.map((date) => date.lost));
  mostWon = won > LEAST_WON ? won : 0;
  const lostOf = (view) => losses[losses.length > 1 ? steps.day[days[view.day].first] : 0];
  return { losses, lostOf, mostLost: Math.max(lost, mostWon) };
};

// ---- colours of pixels, as a canvas keeps them

const rampColors = ramp.map(([r, g, b]) => color(r, g, b));
const LEAST_WON = 1 / 60;  // hours, of more than which the key names what is won
let mostWon = 0;
// From the most that is won to the most that is lost; paper in the middle.
const changeColors = (data.change_ramp || []).map(([r, g, b]) => color(r, g, b));
const lossOf = (hours, most) => {
  const middle = (changeColors.length - 1) / 2;
  return changeColors[Math.round(middle + (most > 0 ? Math.max(-1, Math.min(1, hours / most)) : 0) * middle)];
};
const NO_HOURS = color(226, 226, 231);  // of a night
const NO_SUN = color(...data.no_sun);
const ROUNDING = 1e-3;  // of hours
const colorOf = (hours, most) =>
  most > 0 && hours >= most - ROUNDING ? NO_SUN
    : most > 0 ? rampColors[Math.min(ramp.length - 1, Math.round((hours / most) * (ramp.length - 1)))] : NO_HOURS;
