// What a page shows, as one record, and the same as a link or as a file.

import { isDate } from "./clock.js";
import { isMoved, NOWHERE } from "./moved.js";
import { STEP } from "./steps.js";

/** Where an object stands: in both states, only after or only before a change, or nowhere. */
/** @typedef {'on' | 'proposed' | 'removed' | 'off'} Standing */
/** @typedef {'after' | 'before' | 'swipe' | 'beside'} Compare */

/**
 * @typedef {object} Section
 * @property {'level' | 'north' | 'east'} axis that the plane is square to
 * @property {number} at where, as a share of the model's extent along the axis
 * @property {boolean} flipped which side stays
 *
 * @typedef {object} State
 * @property {Viewpoint} viewpoint
 * @property {string} date
 * @property {number} minutes
 * @property {number} share see ``When``
 * @property {number} azimuth
 * @property {number} altitude
 * @property {Map<number, Standing>} standing of objects that do not stand in both states
 * @property {import('./moved.js').Move} move of what is proposed
 * @property {Compare} compare
 * @property {number} swipe share of the picture's width
 * @property {Place | null} place
 * @property {'choose' | 'measure'} tool
 * @property {[Vec3, Vec3][]} distances
 * @property {Vec3 | null} begun
 * @property {Section | null} section
 * @property {boolean} hasPath
 * @property {boolean} hasCompass
 * @property {boolean} hasHours
 * @property {boolean} hasEdges
 * @property {boolean} hasSunHours whether hours of sun are shown in place of light and shadow
 * @property {[number, number]} interval of the day in which they are counted, minutes since midnight
 * @property {'day' | 'year' | null} playing
 */

export const COMPARE = /** @type {const} */ (["after", "before", "swipe", "beside"]);
export const AXES = /** @type {const} */ (["level", "north", "east"]);
const PLAYED = /** @type {const} */ (["day", "year"]);
const FLAGS = /** @type {const} */ (["hasPath", "hasCompass", "hasHours", "hasEdges", "hasSunHours"]);
export const FARTHEST = 1e5; // way of a move [m]
const LETTERS = { proposed: "p", removed: "r", off: "o" };

/** @param {number} value @param {number} digits */
const round = (value, digits) => Number(value.toFixed(digits));

/**
 * Whether two numbers are an interval of a day, of whole steps [min].
 * @param {number[]} ends
 */
const isInterval = ([from, to]) =>
  from >= 0 && to <= 1440 && from < to && from % STEP === 0 && to % STEP === 0;

/**
 * Write a state as the part of an address after ``#``. Positions are the model's own coordinates.
 * @param {State} state
 * @param {Vec3} origin
 */
export const toLink = (state, origin) => {
  const own = (/** @type {Vec3} */ point) =>
    point.map((value, k) => round(value + origin[k], 3)).join(",");
  const { viewpoint: view, section, place } = state;
  /** @type {string[][]} */
  const parts = [
    [
      "look",
      `${own(view.target)},${[view.heading, view.tilt, view.distance, view.fov].map((v) => round(v, 3))}`,
    ],
    ["at", `${state.date}T${round(state.minutes, 2)}`],
    ["sun", `${round(state.azimuth, 2)},${round(state.altitude, 2)}`],
    ["show", FLAGS.map((name) => Number(state[name])).join("")],
    ["hours", state.interval.join(",")],
  ];
  if (state.compare !== "after")
    parts.push(["compare", `${state.compare},${round(state.swipe, 3)}`]);
  for (const [standing, letter] of Object.entries(LETTERS)) {
    const objects = [...state.standing]
      .filter(([, status]) => status === standing)
      .map(([object]) => object);
    if (objects.length) parts.push([letter, toRanges(objects)]);
  }
  const { dx, dy, turn } = state.move;
  if (isMoved(state.move)) parts.push(["move", [dx, dy, turn].map((v) => round(v, 3)).join(",")]);
  if (section)
    parts.push(["cut", `${section.axis},${round(section.at, 4)},${Number(section.flipped)}`]);
  if (place)
    parts.push([
      "place",
      `${own(place.position)},${place.normal ? place.normal.map((v) => round(v, 4)) : ""},${place.part}`,
    ]);
  if (state.distances.length)
    parts.push(["far", state.distances.map((ends) => ends.map(own).join(",")).join(";")]);
  if (state.playing) parts.push(["play", state.playing]);
  return parts.map(([name, value]) => `${name}=${value}`).join("&");
};

/**
 * Read what a link holds; what is missing, damaged or of another model is left out.
 * @param {string} link
 * @param {Vec3} origin
 * @param {number} objects how many the model has
 * @param {number} partCount
 * @returns {Partial<State>}
 */
export const fromLink = (link, origin, objects, partCount) => {
  const given = new Map(
    link
      .replace(/^#/, "")
      .split("&")
      .map((part) => {
        const [name, ...rest] = part.split("=");
        return /** @type {[string, string]} */ ([name, rest.join("=")]);
      }),
  );
  const numbers = (/** @type {string | undefined} */ text, /** @type {number} */ count) => {
    const values = (text ?? "").split(",").map((word) => (word.trim() === "" ? NaN : Number(word)));
    return values.length === count && values.every(Number.isFinite) ? values : null;
  };
  const local = (/** @type {number[]} */ own) =>
    /** @type {Vec3} */ (own.map((value, k) => value - origin[k]));
  /** @type {Partial<State>} */
  const state = {};
  const look = numbers(given.get("look"), 7);
  if (look && look[5] > 0 && Math.abs(look[4]) < 90 && look[6] > 1 && look[6] < 150) {
    const [heading, tilt, distance, fov] = look.slice(3);
    state.viewpoint = { target: local(look.slice(0, 3)), heading, tilt, distance, fov };
  }
  const [date, minutes] = (given.get("at") ?? "").split("T");
  if (isDate(date) && Number(minutes) >= 0 && Number(minutes) < 1440) {
    Object.assign(state, { date, minutes: Number(minutes) });
  }
  const sun = numbers(given.get("sun"), 2);
  if (sun)
    [state.azimuth, state.altitude] = [
      ((sun[0] % 360) + 360) % 360,
      Math.max(0, Math.min(90, sun[1])),
    ];
  const show = given.get("show") ?? "";
  if (/^[01]{4,5}$/.test(show))
    FLAGS.forEach((name, k) => {
      state[name] = show[k] === "1";
    });
  const hours = numbers(given.get("hours"), 2);
  if (hours && isInterval(hours)) state.interval = [hours[0], hours[1]];
  const [compare, swipe] = (given.get("compare") ?? "").split(",");
  const mode = COMPARE.find((name) => name === compare);
  if (mode)
    Object.assign(state, { compare: mode, swipe: Math.max(0, Math.min(1, Number(swipe) || 0.5)) });
  /** @type {Map<number, Standing>} */
  const standing = new Map();
  for (const [name, letter] of Object.entries(LETTERS)) {
    for (const object of fromRanges(given.get(letter) ?? "", objects))
      standing.set(object, /** @type {Standing} */ (name));
  }
  if (standing.size || mode) state.standing = standing;
  const move = numbers(given.get("move"), 3);
  if (move && Math.hypot(move[0], move[1]) <= FARTHEST)
    state.move = { dx: move[0], dy: move[1], turn: move[2] % 360 };
  else if (look) state.move = NOWHERE;
  const [axis, at, flipped] = (given.get("cut") ?? "").split(",");
  const along = AXES.find((name) => name === axis);
  if (along)
    state.section = {
      axis: along,
      at: Math.max(0, Math.min(1, Number(at) || 0)),
      flipped: flipped === "1",
    };
  const chosen = numbers(given.get("place"), 7);
  if (chosen && Number.isInteger(chosen[6]) && chosen[6] >= -1 && chosen[6] < partCount) {
    const position = local(chosen.slice(0, 3));
    state.place = { position, normal: /** @type {Vec3} */ (chosen.slice(3, 6)), part: chosen[6] };
  }
  const far = (given.get("far") ?? "").split(";").flatMap((line) => {
    const ends = numbers(line, 6);
    return ends ? [ends] : [];
  });
  if (far.length) state.distances = far.map((ends) => [local(ends.slice(0, 3)), local(ends.slice(3))]);
  const playing = PLAYED.find((name) => name === given.get("play"));
  if (playing) state.playing = playing;
  return state;
};

/**
 * Write numbers as ``3-5,9``.
 * @param {number[]} numbers
 */
export const toRanges = (numbers) => {
  /** @type {[number, number][]} */
  const ranges = [];
  for (const n of [...numbers].sort((a, b) => a - b)) {
    const last = ranges[ranges.length - 1];
    if (last && n === last[1] + 1) last[1] = n;
    else ranges.push([n, n]);
  }
  return ranges.map(([a, b]) => (a === b ? `${a}` : `${a}-${b}`)).join(",");
};

/**
 * Read ``3-5,9``; numbers from ``end`` on are left out.
 * @param {string} text @param {number} end
 */
export const fromRanges = (text, end) => {
  const numbers = [];
  for (const [, first, last] of text.matchAll(/(\d{1,9})(?:-(\d{1,9}))?/g)) {
    const stop = Math.min(Number(last ?? first), end - 1);
    for (let n = Number(first); n <= stop; n++) numbers.push(n);
  }
  return numbers;
};

/**
 * Write a state as the file of a view that umbra's window reads, too; the rest of it as a link.
 * @param {State} state
 * @param {Vec3} origin
 * @param {Record<string, unknown>} given the view with which the page began
 */
export const toFile = (state, origin, given) => {
  const sun = /** @type {Record<string, unknown>} */ (given.sun ?? {});
  const walk = /** @type {Record<string, unknown>} */ (given.viewpoint ?? {});
  return {
    ...given,
    viewpoint: {
      near: 0.1,
      walks: false,
      ...walk,
      ...state.viewpoint,
      target: state.viewpoint.target.map((value, k) => value + origin[k]),
    },
    sun: {
      ...sun,
      date: state.date,
      minutes: Math.min(1439.999, state.minutes),
      azimuth: state.azimuth,
      altitude: state.altitude,
    },
    page: toLink(state, origin),
  };
};
