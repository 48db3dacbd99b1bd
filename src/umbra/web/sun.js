// The sun's place in the sky, by NREL's Solar Position Algorithm as umbra's Python does it.
//
// The series are cut after the terms below; with them the place differs from the whole
// algorithm's by less than 0.002 degrees in the years 1950 to 2050.
//
// I. Reda and A. Andreas, "Solar position algorithm for solar radiation applications",
// NREL/TP-560-34302, revised January 2008; numbers of equations are theirs.

import { hides } from "./land.js";

/**
 * @typedef {object} Site
 * @property {number} latitude north is positive [degrees]
 * @property {number} longitude east is positive [degrees]
 * @property {number} elevation above the sea [m]
 * @property {number} trueNorth its azimuth in the model's plan, clockwise from +y [degrees]
 * @property {string} zone IANA name of the local clock
 * @property {import('./land.js').Land | null} [land] far away, which hides the sun
 *
 * @typedef {object} Sun
 * @property {number} altitude of the centre above the horizon, with refraction [degrees]
 * @property {number} azimuth clockwise from true north, in [0, 360) [degrees]
 * @property {Vec3} direction unit vector toward the sun in the model's axes
 * @property {boolean} isBehind whether it is up behind the land
 */

const DEGREES = 180 / Math.PI;
const SEA_LEVEL_PRESSURE = 1010; // [hPa]
const TEMPERATURE = 12; // [degrees C]
const HORIZON_REFRACTION = 0.5667; // [degrees]
const SUN_RADIUS = 0.26667; // [degrees]

// Each term is [A, B, C] of A cos(B + C t), t in Julian millennia since 2000; one row is one power
// of t.
const LONGITUDE = [
  [
    [175347046, 0, 0],
    [3341656, 4.6692568, 6283.07585],
    [34894, 4.6261, 12566.1517],
    [3497, 2.7441, 5753.3849],
    [3418, 2.8289, 3.5231],
    [3136, 3.6277, 77713.7715],
    [2676, 4.4181, 7860.4194],
    [2343, 6.1352, 3930.2097],
    [1324, 0.7425, 11506.7698],
    [1273, 2.0371, 529.691],
    [1199, 1.1096, 1577.3435],
    [990, 5.233, 5884.927],
    [902, 2.045, 26.298],
    [857, 3.508, 398.149],
    [780, 1.179, 5223.694],
    [753, 2.533, 5507.553],
    [505, 4.583, 18849.228],
    [492, 4.205, 775.523],
    [357, 2.92, 0.067],
    [317, 5.849, 11790.629],
    [284, 1.899, 796.298],
    [271, 0.315, 10977.079],
    [243, 0.345, 5486.778],
    [206, 4.806, 2544.314],
    [205, 1.869, 5573.143],
    [202, 2.458, 6069.777],
    [156, 0.833, 213.299],
  ],
  [
    [628331966747, 0, 0],
    [206059, 2.678235, 6283.07585],
    [4303, 2.6351, 12566.1517],
    [425, 1.59, 3.523],
    [119, 5.796, 26.298],
    [109, 2.966, 1577.344],
    [93, 2.59, 18849.23],
  ],
  [
    [52919, 0, 0],
    [8720, 1.0721, 6283.0758],
    [309, 0.867, 12566.152],
  ],
  [[289, 5.844, 6283.076]],
];
const LATITUDE = [
  [
    [280, 3.199, 84334.662],
    [102, 5.422, 5507.553],
    [80, 3.88, 5223.69],
    [44, 3.7, 2352.87],
    [32, 4, 1577.34],
  ],
];
const RADIUS = [
  [
    [100013989, 0, 0],
    [1670700, 3.0984635, 6283.07585],
    [13956, 3.05525, 12566.1517],
    [3084, 5.1985, 77713.7715],
  ],
  [[103019, 1.10749, 6283.07585]],
];
// Multiples of the arguments of equations 15 to 19, then the coefficients of nutation in
// longitude and in obliquity [0.0001 arc seconds].
const NUTATION = [
  [0, 0, 0, 0, 1, -171996, 92025],
  [-2, 0, 0, 2, 2, -13187, 5736],
  [0, 0, 0, 2, 2, -2274, 977],
  [0, 0, 0, 0, 2, 2062, -895],
  [0, 1, 0, 0, 0, 1426, 54],
];

/** @param {number[][][]} series @param {number} t */
const sumSeries = (series, t) => {
  let sum = 0,
    power = 1;
  for (const terms of series) {
    for (const [a, b, c] of terms) sum += power * a * Math.cos(b + c * t);
    power *= t;
  }
  return sum / 1e8;
};

/**
 * Terrestrial time less universal time [s] in a year with its fraction (Espenak and Meeus). A
 * second of it moves the sun by 0.00001 degrees, so the parabola does for other centuries.
 * @param {number} year
 */
const findDeltaT = (year) => {
  if (year >= 1941 && year < 1961) return 29.07 + 0.407 * (year - 1950) - (year - 1950) ** 2 / 233;
  if (year >= 1961 && year < 1986) return 45.45 + 1.067 * (year - 1975) - (year - 1975) ** 2 / 260;
  if (year >= 1986 && year < 2005)
    return 63.86 + 0.3345 * (year - 2000) - 0.060374 * (year - 2000) ** 2;
  if (year >= 2005 && year < 2050)
    return 62.92 + 0.32217 * (year - 2000) + 0.005589 * (year - 2000) ** 2;
  return -20 + 32 * ((year - 1820) / 100) ** 2;
};

/**
 * Find the sun over a site.
 * @param {Site} site
 * @param {number} instant [ms since 1970, UTC]
 * @returns {Sun}
 */
export const findSun = (site, instant) => {
  const { sin, cos, tan, atan, atan2, asin } = Math;
  const day = instant / 86400000 - 10957.5; // days since noon of 1 January 2000
  const century = day / 36525;
  const t = (day + findDeltaT(2000 + day / 365.25) / 86400) / 365250;
  // Geocentric longitude and latitude, equations 9 to 14.
  const longitude = sumSeries(LONGITUDE, t) + Math.PI,
    beta = -sumSeries(LATITUDE, t);
  const radius = sumSeries(RADIUS, t);
  // Nutation and the ecliptic's obliquity, equations 15 to 25.
  const c = t * 10;
  const arguments_ = [
    297.85036 + 445267.11148 * c,
    357.52772 + 35999.05034 * c,
    134.96298 + 477198.867398 * c,
    93.27191 + 483202.017538 * c,
    125.04452 - 1934.136261 * c,
  ];
  let inLongitude = 0,
    inObliquity = 0;
  for (const term of NUTATION) {
    const angle = arguments_.reduce((sum, argument, k) => sum + argument * term[k], 0) / DEGREES;
    inLongitude += (term[5] * sin(angle)) / 36e6 / DEGREES;
    inObliquity += (term[6] * cos(angle)) / 36e6 / DEGREES;
  }
  const u = t / 10;
  const obliquity =
    (84381.448 - 4680.93 * u - 1.55 * u * u + 1999.25 * u ** 3) / 3600 / DEGREES + inObliquity;
  const apparent = longitude + inLongitude - 20.4898 / 3600 / DEGREES / radius;
  // Sidereal time, right ascension and declination, equations 28 to 31.
  const sidereal = 280.46061837 + 360.98564736629 * day + 0.000387933 * century ** 2;
  const ascension = atan2(
    sin(apparent) * cos(obliquity) - tan(beta) * sin(obliquity),
    cos(apparent),
  );
  const declination = asin(sin(beta) * cos(obliquity) + cos(beta) * sin(obliquity) * sin(apparent));
  const hour =
    ((sidereal + site.longitude) % 360) / DEGREES + inLongitude * cos(obliquity) - ascension;
  // Seen from the surface rather than the earth's centre, equations 33 to 40.
  const phi = site.latitude / DEGREES,
    parallax = sin(8.794 / 3600 / DEGREES / radius);
  const reduced = atan(0.99664719 * tan(phi)),
    high = site.elevation / 6378140;
  const x = cos(reduced) + high * cos(phi),
    y = 0.99664719 * sin(reduced) + high * sin(phi);
  const level = cos(declination) - x * parallax * cos(hour);
  const shift = atan2(-x * parallax * sin(hour), level);
  const topocentric = atan2((sin(declination) - y * parallax) * cos(shift), level),
    h = hour - shift;
  // Altitude and azimuth, equations 41 to 46. Light is bent while the upper limb is in sight.
  const sine = sin(phi) * sin(topocentric) + cos(phi) * cos(topocentric) * cos(h);
  let altitude = asin(Math.max(-1, Math.min(1, sine))) * DEGREES;
  if (altitude >= -(SUN_RADIUS + HORIZON_REFRACTION)) {
    const pressure = (1 - (0.0065 * site.elevation) / 288.15) ** 5.25588 * SEA_LEVEL_PRESSURE;
    altitude +=
      ((pressure / 1010) * (283 / (273 + TEMPERATURE)) * 1.02) /
      (60 * tan((altitude + 10.3 / (altitude + 5.11)) / DEGREES));
  }
  const west = atan2(sin(h), cos(h) * sin(phi) - tan(topocentric) * cos(phi));
  const azimuth = (((west * DEGREES + 180) % 360) + 360) % 360;
  return describeSun(site, altitude, azimuth);
};

/**
 * The sun at an altitude and an azimuth over a site.
 * @param {Site} site
 * @param {number} altitude @param {number} azimuth [degrees]
 * @returns {Sun}
 */
export const describeSun = (site, altitude, azimuth) => ({
  altitude,
  azimuth,
  direction: makeDirection(altitude, azimuth + site.trueNorth),
  isBehind: hides(site.land, azimuth, altitude),
});

/**
 * Turn an altitude and an azimuth, clockwise from +y [degrees], into a unit vector.
 * @param {number} altitude @param {number} azimuth
 * @returns {Vec3}
 */
export const makeDirection = (altitude, azimuth) => {
  const up = altitude / DEGREES,
    turn = azimuth / DEGREES;
  return [Math.sin(turn) * Math.cos(up), Math.cos(turn) * Math.cos(up), Math.sin(up)];
};

/** Altitude of the centre when the upper limb touches the horizon [degrees]. */
export const RIM = -SUN_RADIUS;

const CLOSE = 500; // of the ends of a spell [ms]

/**
 * Find the spells in which something holds, their ends to half a second.
 * @param {(instant: number) => boolean} holds
 * @param {number} from [ms] @param {number} to [ms]
 * @param {number} step between looks [ms]; shorter spells and gaps can be missed
 * @returns {[number, number][]}
 */
export const findSpells = (holds, from, to, step) => {
  /** @type {[number, number][]} */
  const spells = [];
  let was = holds(from),
    since = from;
  for (let at = from; at < to; at += step) {
    const next = Math.min(at + step, to),
      is = holds(next);
    if (is !== was) {
      let low = at,
        high = next;
      while (high - low > CLOSE) {
        const middle = (low + high) / 2;
        if (holds(middle) === was) low = middle;
        else high = middle;
      }
      const change = (low + high) / 2;
      if (was) spells.push([since, change]);
      since = change;
    }
    was = is;
  }
  if (was) spells.push([since, to]);
  return spells;
};
