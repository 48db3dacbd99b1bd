"""
Moments of rules: days that astronomy names, and times by the sun or by a clock without summer time.

Days are those of `umbra.sun.date_words`. The equation of time is of Meeus, Astronomical Algorithms,
chapters 25 and 28: right to some seconds from 1950 to 2100.
"""

import datetime as dt
import re
import zoneinfo
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.rules.record import Condition
from umbra.sun import Site, date_words, find_sun
from umbra.sun.clock import parse_duration

__all__ = ["find_term", "find_windows", "follows_clock"]

RIM = -0.833
"""Altitude of the sun's middle at sunrise and sunset, without air [degrees]."""
_CLOCK = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}))?")
_EVENT = re.compile(r"(sunrise|sunset)(?:\s*([+-])\s*(.+))?")
_DAY = 86_400_000_000  # [us]
_EVERY = 600_000_000  # between altitudes among which a crossing is sought [us]


def find_term(term: str, year: int, zone: str) -> list[dt.date]:
    """Return the local dates of a term in a year; ``equinox`` has two."""
    if term == "equinox":
        return [day for name in ("spring-equinox", "autumn-equinox")
                for day in find_term(name, year, zone)]  # fmt: skip
    return [date_words.find_term_day(f"{year}-{term}", zone)]


def _count_centuries(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Julian centuries since 2000 of UTC seconds since 1970, by dynamical time (69 s)."""
    return ((seconds + 69.0) / 86400 + 2440587.5 - 2451545.0) / 36525


def _find_equation(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the equation of time [minutes]."""
    mean = 280.46646 + 36000.76983 * t + 0.0003032 * t * t
    anomaly = np.radians(357.52911 + 35999.05029 * t - 0.0001537 * t * t)
    centre = (
        (1.914602 - 0.004817 * t) * np.sin(anomaly)
        + (0.019993 - 0.000101 * t) * np.sin(2 * anomaly)
        + 0.000289 * np.sin(3 * anomaly)
    )
    node = np.radians(125.04 - 1934.136 * t)
    longitude = mean + centre - 0.00569 - 0.00478 * np.sin(node)
    tilt = np.radians(23.439291 - 0.0130042 * t + 0.00256 * np.cos(node))
    along = np.radians(longitude)
    ascension = np.degrees(np.arctan2(np.cos(tilt) * np.sin(along), np.cos(along)))
    nutation = -0.00478 * np.sin(node) * np.cos(tilt)
    return 4 * ((mean - 0.0057183 - ascension + nutation + 180) % 360 - 180)


def follows_clock(condition: Condition) -> bool:
    """Return whether a condition's hours are plain times of the local clock."""
    times = (condition.start, condition.end)
    return condition.clock == "local" and all(":" in one and one[0].isdigit() for one in times)


def find_windows(
    condition: Condition, days: Sequence[dt.date], site: Site
) -> list[tuple[int, int]]:
    """
    Return the hours of a condition on dates, as instants.

    Parameters
    ----------
    condition : Condition
    days : sequence of date
    site : Site

    Returns
    -------
    windows : list of (int, int)
        Start and end, UTC [us since 1970]; equal where the sun does not rise.
    """
    starts = _find_times(condition.start, condition.clock, days, site, is_first=True)
    ends = _find_times(condition.end, condition.clock, days, site, is_first=False)
    return [(a, max(a, b)) for a, b in zip(starts, ends, strict=True)]


def _find_times(
    text: str, clock: str, days: Sequence[dt.date], site: Site, *, is_first: bool
) -> list[int]:
    found = _CLOCK.match(text)
    if found:
        hour, minute, second = (int(part or 0) for part in found.groups())
        past = (hour * 60 + minute) * 60 + second
        return [_read_clock(day, past, clock, site) for day in days]
    if text.startswith("altitude:"):
        wanted = float(text.partition(":")[2])
        return _find_crossings(days, site, wanted, "standard", is_rising=is_first)
    event = _EVENT.fullmatch(text)
    assert event is not None
    moments = _find_crossings(days, site, RIM, "none", is_rising=event[1] == "sunrise")
    if event[2] is None:
        return moments
    past_us = int(parse_duration(event[3], "time past the sun's rise or set", "")
                  / dt.timedelta(microseconds=1))  # fmt: skip
    return [moment + (past_us if event[2] == "+" else -past_us) for moment in moments]


def _read_clock(day: dt.date, past: int, clock: str, site: Site) -> int:
    """Return the instant of a time of the day, [s past midnight], by a clock."""
    midnight = dt.datetime(day.year, day.month, day.day, tzinfo=dt.UTC)
    seconds = midnight.timestamp() + past
    if clock == "solar":
        guess = seconds - 240 * site.longitude
        for _ in range(2):
            minutes = _find_equation(_count_centuries(np.array([guess])))
            guess = seconds - 240 * site.longitude - 60 * float(minutes[0])
        return round(guess * 1e6)
    zone = zoneinfo.ZoneInfo(site.zone)
    noon = dt.datetime(day.year, day.month, day.day, 12, tzinfo=zone)
    offset, summer = noon.utcoffset(), noon.dst()
    if offset is None:
        msg = f"the zone {site.zone} has no offset on {day}; name another with zone="
        raise InputError(msg)
    if clock == "standard" and summer:
        offset -= summer
    if clock == "local":
        whole, rest = divmod(past, 86400)
        local = dt.datetime(day.year, day.month, day.day, tzinfo=zone) + dt.timedelta(
            days=whole, seconds=rest)  # fmt: skip
        return round(local.timestamp() * 1e6)
    return round((seconds - offset.total_seconds()) * 1e6)


def _find_crossings(
    days: Sequence[dt.date], site: Site, altitude: float, refraction: str, *, is_rising: bool
) -> list[int]:
    """Return when the sun first rises above an altitude, or last sinks below it, on each date."""
    zone = zoneinfo.ZoneInfo(site.zone)
    begins = np.array([
        round(dt.datetime(day.year, day.month, day.day, tzinfo=zone).timestamp() * 1e6)
        for day in days
    ])  # fmt: skip
    times = begins[:, None] + np.arange(0, _DAY + 1, _EVERY)

    def is_above(instants: NDArray[np.int64]) -> NDArray[np.bool_]:
        flat = instants.ravel().astype("datetime64[us]")
        path = find_sun(site, flat, refraction=refraction)  # type: ignore[arg-type]
        return (path.altitude >= altitude).reshape(instants.shape)

    above = is_above(times)
    turns = (above[:, 1:] & ~above[:, :-1]) if is_rising else (above[:, :-1] & ~above[:, 1:])
    rows = np.arange(len(days))
    first = turns.argmax(1) if is_rising else turns.shape[1] - 1 - turns[:, ::-1].argmax(1)
    low, high = times[rows, first], times[rows, first + 1]
    for _ in range(24):  # to a tenth of a millisecond
        middle = (low + high) // 2
        before = is_above(middle) != is_rising
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    # A sun that is up all day, or never: the day's ends.
    fallback = times[:, 0] if is_rising else np.where(above.any(1), times[:, -1], times[:, 0])
    return [int(one) for one in np.where(turns.any(1), high, fallback)]
