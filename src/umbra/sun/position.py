"""
Position of the sun, by NREL's Solar Position Algorithm; sunrise and sunset as almanacs do.

pvlib's numpy copy of SPA is used as it stands (0.0003 degrees, years -2000 to
6000): solposx was the alternative, but its SPA wraps the same pvlib code, no more
exact, and needs pandas and matplotlib besides.

References
----------
.. [1] I. Reda and A. Andreas, "Solar position algorithm for solar radiation
   applications", NREL/TP-560-34302, revised January 2008.
.. [2] F. Espenak and J. Meeus, "Polynomial expressions for Delta T", NASA.
.. [3] U.S. Standard Atmosphere, 1976.
"""

from __future__ import annotations

import datetime as dt
import functools
import importlib.util
import os
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Literal
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError, check_type, show_value
from umbra.sun.local_time import find_instant
from umbra.sun.site import Site

__all__ = ["Daylight", "SunPath", "find_daylight", "find_longitude", "find_sun"]

SEA_LEVEL_PRESSURE = 1010.0  # [hPa], yearly mean; the reference of SPA's refraction, [1] eq. 42
TEMPERATURE = 12.0  # [degrees C], yearly mean
# At sunrise and sunset [degrees]. SPA bends light down to this and the sun's radius below 0.
HORIZON_REFRACTION = 0.5667

_importing = threading.Lock()
RIM = -0.26667
"""Altitude of the sun's centre when its upper rim is on the horizon [degrees]."""
_LOOK = 300_000_000  # step of the search for sunrise and sunset [us]
_CLOSE = 1_000_000  # tolerance of sunrise and sunset [us]


@dataclass(frozen=True, eq=False)
class SunPath:
    """
    Position of the sun's centre at n instants.

    Parameters
    ----------
    altitude : (n,) float64
        Above the horizon [degrees].
    azimuth : (n,) float64
        Clockwise from true north, in [0, 360) [degrees].
    direction : (n, 3) float64
        Unit vectors toward the sun in the model's axes.
    is_up : (n,) bool
        Whether the altitude is above 0.
    """

    altitude: NDArray[np.float64]
    azimuth: NDArray[np.float64]
    direction: NDArray[np.float64]
    is_up: NDArray[np.bool_]


def find_sun(
    site: Site,
    instants: ArrayLike | Sequence[dt.datetime],
    *,
    refraction: Literal["standard", "none"] = "standard",
) -> SunPath:
    """
    Find the sun's direction over a site.

    Parameters
    ----------
    site : Site
    instants : (n,) datetime64, or datetimes
        UTC. A ``datetime`` with its own zone is converted; one instant gives n = 1.
    refraction : {"standard", "none"}
        ``standard``: the place from where the light arrives, bent by air of 12
        degrees C and 1010 hPa at sea level, thinner at the site's elevation. Light is
        bent only while the sun's upper limb is at or above the horizon, so the altitude
        steps by half a degree, well below 0. ``none``: the place in space.

    Returns
    -------
    path : SunPath
        Altitude and direction follow the chosen refraction; the azimuth is the same.

    Raises
    ------
    InputError
        If an instant is missing (NaT) or outside the years -1999 to 3000, or the
        refraction is neither of the two.

    Examples
    --------
    >>> site = Site(48.2, 16.37, "Europe/Vienna")
    >>> find_sun(site, np.datetime64("2026-06-21T11:00")).altitude.round(1)
    array([65.2])
    """
    check_type("site", site, Site)
    if not isinstance(refraction, str) or refraction not in {"standard", "none"}:
        msg = f"refraction {show_value(refraction)} is not known; give 'standard' or 'none'"
        raise InputError(msg, refraction=refraction)
    utc = _to_utc(instants)
    geometric, apparent, azimuth = _find_angles(
        utc.astype(np.int64) / 1e6,
        site.latitude,
        site.longitude,
        site.elevation,
        pressure=_pressure_at(site.elevation),
        temperature=TEMPERATURE,
        delta_t=_delta_t(utc),
    )
    altitude = apparent if refraction == "standard" else geometric
    direction = _to_direction(altitude, azimuth + site.true_north)
    return SunPath(altitude, azimuth, direction, altitude > 0)


def _to_direction(
    altitude: NDArray[np.float64], azimuth: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Turn altitude and azimuth, clockwise from +y [degrees], into unit vectors (n, 3)."""
    up, turn = np.radians(altitude), np.radians(azimuth)
    return np.stack([np.sin(turn) * np.cos(up), np.cos(turn) * np.cos(up), np.sin(up)], axis=-1)


def _find_angles(
    seconds: NDArray[np.float64],
    latitude: float,
    longitude: float,
    elevation: float,
    *,
    pressure: float,
    temperature: float,
    delta_t: ArrayLike,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Run SPA: altitude without and with refraction, and azimuth from true north [degrees]."""
    # Two fixes below: SPA refracts every altitude and masks afterwards, which leaves NaN at
    # the formula's pole at -5.11 degrees; and at the zenith rounding can take arcsin's
    # argument above 1.
    with np.errstate(all="ignore"):
        _, _, apparent, geometric, azimuth, _ = _load_spa().solar_position(
            seconds,
            latitude,
            longitude,
            elevation,
            pressure,
            temperature,
            delta_t,
            HORIZON_REFRACTION,
            1,
        )
    geometric = np.where(np.isnan(geometric), 90.0, geometric)
    return geometric, np.where(np.isnan(apparent), geometric, apparent), azimuth


def _pressure_at(elevation: float) -> float:
    """Scale the pressure at sea level to an elevation [m], by the standard atmosphere [3]_."""
    return SEA_LEVEL_PRESSURE * (1 - 0.0065 * elevation / 288.15) ** 5.25588


def _delta_t(utc: NDArray[np.datetime64]) -> NDArray[np.float64]:
    """Terrestrial time less universal time [s], from each instant's own year and month [2]_."""
    months = utc.astype("datetime64[M]").astype(np.int64)  # since January 1970
    return np.asarray(_load_spa().calculate_deltat(1970 + months // 12, months % 12 + 1), float)


def _to_utc(instants: Any) -> NDArray[np.datetime64]:
    """Instants as a checked (n,) datetime64[us] array."""
    msg = "instants must be a list or 1-D array of datetime64 or datetime; give them in UTC"
    try:
        listed = np.atleast_1d(np.asarray(instants))
    except ValueError as error:  # rows of different lengths
        raise InputError(msg) from error
    if listed.ndim != 1 or (listed.dtype.kind not in "MOU" and listed.size):
        raise InputError(msg)
    try:
        if listed.dtype == object:
            # numpy would drop the offset of a zoned datetime: take it to UTC first.
            listed = np.array([_drop_offset(when) for when in listed])
        utc = listed.astype("datetime64[us]")
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(msg) from error
    years = utc.astype("datetime64[Y]").astype(np.int64) + 1970
    wrong = (years < -1999) | (years > 3000)  # NaT is the lowest year of all
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        msg = (
            f"{int(wrong.sum())} of {len(utc)} instants are missing or outside the years "
            f"-1999 to 3000 (first: instant {first}, {utc[first]}); correct or remove them"
        )
        raise InputError(msg, indices=np.flatnonzero(wrong))
    return utc


def find_longitude(instant: dt.datetime) -> float:
    """Return the sun's apparent ecliptic longitude at an instant, [1] 3.1 to 3.6 [degrees]."""
    spa = _load_spa()
    utc = _to_utc([instant])
    julian = spa.julian_day(utc.astype("datetime64[us]").astype(np.int64) / 1e6)
    ephemeris = spa.julian_ephemeris_day(julian, _delta_t(utc))
    century = spa.julian_ephemeris_century(ephemeris)
    millennium = spa.julian_ephemeris_millennium(century)
    terms = [
        spa.mean_elongation(century), spa.mean_anomaly_sun(century),
        spa.mean_anomaly_moon(century), spa.moon_argument_latitude(century),
        spa.moon_ascending_longitude(century),
    ]  # fmt: skip
    nutation = np.zeros((2, 1))
    spa.longitude_obliquity_nutation(century, *terms, nutation)
    radius = spa.heliocentric_radius_vector(millennium)
    true = spa.geocentric_longitude(spa.heliocentric_longitude(millennium))
    shift = spa.aberration_correction(radius)
    return float(spa.apparent_sun_longitude(true, nutation[0], shift)[0]) % 360.0


def _drop_offset(when: Any) -> Any:
    is_zoned = isinstance(when, dt.datetime) and when.tzinfo is not None
    return when.astimezone(dt.UTC).replace(tzinfo=None) if is_zoned else when


@functools.cache
def _load_spa() -> ModuleType:
    """
    Load ``pvlib/spa.py`` alone.

    ``import pvlib`` runs pandas, scipy and requests, 0.8 s; the one module
    needed here imports numpy and nothing else, a millisecond. So it is loaded from its file,
    under a name of its own; where that file is not found, the usual way.
    """
    # The module reads PVLIB_USE_NUMBA as it loads. Compiled, its numpy entry would
    # fail, so the variable is hidden from it and given back.
    with _importing:
        wish = os.environ.pop("PVLIB_USE_NUMBA", None)
        try:
            package = importlib.util.find_spec("pvlib")  # finds a top-level package, runs nothing
            for folder in (package and package.submodule_search_locations) or ():
                path = Path(folder) / "spa.py"
                spec = importlib.util.spec_from_file_location("umbra_pvlib_spa", path)
                if path.is_file() and spec and spec.loader:
                    module = importlib.util.module_from_spec(spec)
                    spec.loader.exec_module(module)
                    return module
            return importlib.import_module("pvlib.spa")
        finally:
            if wish is not None:
                os.environ["PVLIB_USE_NUMBA"] = wish


@dataclass(frozen=True)
class Daylight:
    """When the sun is above the horizon on a date."""

    rises: dt.datetime | None  # local, as sets; None where the sun does not rise or set that day
    sets: dt.datetime | None
    is_up: bool  # whether it is up when the date begins

    def __str__(self) -> str:
        """Describe sunrise and sunset: "sunrise 06:05, sunset 18:14"."""
        events = [
            f"{name} {_round_to_minute(when):%H:%M}"
            for name, when in (("sunrise", self.rises), ("sunset", self.sets))
            if when is not None
        ]
        if events:
            return ", ".join(events)
        return "the sun does not set" if self.is_up else "the sun does not rise"


def find_daylight(site: Site, day: dt.date) -> Daylight:
    """
    Find when the sun rises and sets on a local date, to a second.

    Its upper rim is then seen on a level horizon through standard air, as in almanacs.
    Shadows are cast while its centre is up, some two minutes less on each side.
    """
    zone = ZoneInfo(site.zone)

    def is_up(times: NDArray[np.int64]) -> NDArray[np.bool_]:
        return find_sun(site, times.view("datetime64[us]")).altitude > RIM

    start = dt.datetime.combine(day, dt.time(), zone).astimezone(dt.UTC)
    end = find_instant(day, "24:00", zone, "end")
    first, last = (round(when.timestamp() * 1e6) for when in (start, end))
    times = np.arange(first, last + _LOOK, _LOOK)
    up = is_up(times)
    change = np.flatnonzero(up[1:] != up[:-1])
    low, high = times[change], times[change + 1]
    while len(change) and (high - low).max() > _CLOSE:
        middle = (low + high) // 2
        is_low = is_up(middle) == up[change]
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)

    def find_first(rising: bool) -> dt.datetime | None:
        crossings = np.flatnonzero((up[change] != rising) & (low < last))
        if not len(crossings):
            return None
        when = int(low[crossings[0 if rising else -1]])
        return dt.datetime.fromtimestamp(when / 1e6, dt.UTC).astimezone(zone)

    return Daylight(find_first(rising=True), find_first(rising=False), bool(up[0]))


def _round_to_minute(when: dt.datetime) -> dt.datetime:
    return (when + dt.timedelta(seconds=30)).replace(second=0, microsecond=0)
