"""
Moments of rules: days that astronomy names, and times by the sun or by a clock without summer time.

Days are those of `umbra.sun.date_words`, clocks those of `umbra.sun.day_times`.
"""

import datetime as dt
import re
import zoneinfo
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.rules.record import Condition
from umbra.sun import Site, date_words, find_sun
from umbra.sun.clock import parse_duration
from umbra.sun.day_times import Clock, DayClock

__all__ = ["find_sun_windows", "find_term", "follows_clock"]

RIM = -0.833
"""Altitude of the sun's middle at sunrise and sunset, without air [degrees]."""
_CLOCK = re.compile(r"\d{1,2}:\d{2}")
_EVENT = re.compile(r"(sunrise|sunset)(?:\s*([+-])\s*(.+))?")
_DAY = 86_400_000_000  # [us]
_EVERY = 600_000_000  # between altitudes among which a crossing is sought [us]


def find_term(term: str, year: int, zone: str) -> list[dt.date]:
    """Return the local dates of a term in a year; ``equinox`` has two."""
    if term == "equinox":
        return [day for name in ("spring-equinox", "autumn-equinox")
                for day in find_term(name, year, zone)]  # fmt: skip
    return [date_words.find_term_day(f"{year}-{term}", zone)]


def follows_clock(condition: Condition) -> bool:
    """Return whether a condition's hours are plain times of the local clock."""
    times = (condition.start, condition.end)
    return condition.clock == "local" and all(":" in time and time[0].isdigit() for time in times)


def find_sun_windows(
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
    text: str, clock: Clock, days: Sequence[dt.date], site: Site, *, is_first: bool
) -> list[int]:
    if _CLOCK.match(text):
        shown = DayClock(site, clock)
        what = "start" if is_first else "end"
        return [round(shown.find(day, text, what).timestamp() * 1e6) for day in days]
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
    return [int(instant) for instant in np.where(turns.any(1), high, fallback)]
