// Local clocks: dates and times of a site's zone, and the instants that they name.

const MINUTE = 60000;

/** @type {Map<string, Intl.DateTimeFormat>} */
const formats = new Map();

/** @param {string} zone */
const findFormat = (zone) => {
  let format = formats.get(zone);
  if (!format) {
    format = new Intl.DateTimeFormat("en-GB-u-ca-gregory-nu-latn", {
      timeZone: zone,
      hourCycle: "h23",
      era: "narrow",
      year: "numeric",
      month: "2-digit",
      day: "2-digit",
      hour: "2-digit",
      minute: "2-digit",
      second: "2-digit",
    });
    formats.set(zone, format);
  }
  return format;
};

/**
 * Read the local clock.
 * @param {string} zone IANA name
 * @param {number} instant [ms since 1970, UTC]
 * @returns {{ date: string, minutes: number, offset: number }} ``YYYY-MM-DD``, minutes since
 *   midnight with their fraction, and the clock less UTC [ms]
 */
export const readClock = (zone, instant) => {
  /** @type {Record<string, string>} */
  const parts = {};
  for (const { type, value } of findFormat(zone).formatToParts(instant)) parts[type] = value;
  const { year, month, day, hour, minute, second } = parts;
  const whole = Math.floor(instant / 1000) * 1000;
  const shown = Date.UTC(+year, +month - 1, +day, +hour, +minute, +second);
  return {
    date: `${year.padStart(4, "0")}-${month}-${day}`,
    minutes: +hour * 60 + +minute + (+second + (instant - whole) / 1000) / 60,
    offset: shown - whole,
  };
};

/**
 * Find the instant at which the clock shows a time. Where the clock goes back, the first; a time
 * that it skips is taken as if it had not jumped yet.
 * @param {string} zone
 * @param {string} date ``YYYY-MM-DD``
 * @param {number} minutes since midnight; below 0 and from 1440 on it is another date
 * @returns {number} [ms since 1970, UTC]
 */
export const findInstant = (zone, date, minutes) => {
  const [year, month, day] = date.split("-").map(Number);
  const shown = Date.UTC(year, month - 1, day) + minutes * MINUTE;
  // The offsets a day before and after: at most one jump lies between.
  const before = readClock(zone, shown - 1440 * MINUTE).offset;
  const after = readClock(zone, shown + 1440 * MINUTE).offset;
  for (const offset of [before, after]) {
    if (readClock(zone, shown - offset).offset === offset) return shown - offset;
  }
  return shown - before;
};

/**
 * Move a date by whole days.
 * @param {string} date ``YYYY-MM-DD`` @param {number} days
 */
export const addDays = (date, days) => {
  const [year, month, day] = date.split("-").map(Number);
  return new Date(Date.UTC(year, month - 1, day + days)).toISOString().slice(0, 10);
};

/**
 * The number of a date in its year, from 0.
 * @param {string} date
 */
export const findDayOfYear = (date) =>
  Math.round((Date.parse(date) - Date.parse(`${date.slice(0, 4)}-01-01`)) / 86400000);

/**
 * Whether a text is a date of the calendar, ``YYYY-MM-DD``.
 * @param {string} text
 */
export const isDate = (text) => {
  if (!/^\d{4}-\d\d-\d\d$/.test(text)) return false;
  const parsed = Date.parse(text);
  return !Number.isNaN(parsed) && new Date(parsed).toISOString().startsWith(text);
};

const longDate = new Intl.DateTimeFormat("en-GB", {
  day: "numeric", month: "long", year: "numeric", timeZone: "UTC",
});

/**
 * Show a date in words: ``21 March 2026``.
 * @param {string} date
 */
export const tellDate = (date) => longDate.format(Date.parse(date));

/**
 * Show minutes since midnight as ``HH:MM``.
 * @param {number} minutes
 */
export const tellMinutes = (minutes) => {
  const whole = Math.floor(minutes + 1e-6);
  return `${String(Math.floor(whole / 60)).padStart(2, "0")}:${String(whole % 60).padStart(2, "0")}`;
};

/**
 * Read ``HH:MM``, ``H`` or ``HH.MM``; null if it is no clock time.
 * @param {string} text
 */
export const parseMinutes = (text) => {
  const match = /^\s*(\d{1,2})(?:[:.h](\d{2}))?\s*$/.exec(text);
  if (!match || +match[1] > 23 || +(match[2] || 0) > 59) return null;
  return +match[1] * 60 + +(match[2] || 0);
};

/**
 * The zone's short name at an instant, such as ``CEST`` or ``GMT+2``.
 * @param {string} zone @param {number} instant
 */
export const nameZone = (zone, instant) => {
  const format = new Intl.DateTimeFormat("en-GB", { timeZone: zone, timeZoneName: "short" });
  return format.formatToParts(instant).find((part) => part.type === "timeZoneName")?.value ?? zone;
};
