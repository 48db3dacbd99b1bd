"""
Days of the sun's year: equinoxes, solstices and solar terms, by its apparent longitude.

The date is that of the site's calendar: Great Cold of 2026 is on 20 January in Beijing.
"""

import datetime as dt
import re
from functools import lru_cache
from zoneinfo import ZoneInfo

from umbra.errors import InputError, find_similar
from umbra.sun.position import find_longitude

__all__ = ["TERMS", "find_term_day", "is_term"]

TERMS = {
    "equinox": 0, "spring-equinox": 0, "march-equinox": 0, "summer-solstice": 90,
    "june-solstice": 90, "autumn-equinox": 180, "september-equinox": 180, "winter-solstice": 270,
    "december-solstice": 270, "minor-cold": 285, "great-cold": 300, "start-of-spring": 315,
    "rain-water": 330, "start-of-summer": 45, "start-of-autumn": 135, "start-of-winter": 225,
}  # fmt: skip
"""Apparent longitude of the sun [degrees] of each."""
_WORD = re.compile(r"(?:([0-9]{4})-)?([a-z]+(?:-[a-z]+)*)")
_YEAR = 365.2422  # [day]
_SECOND = 1.0 / 86_400.0


def is_term(word: str) -> bool:
    """Return whether a word is written as a term, ``great-cold`` or ``2026-great-cold``."""
    return _WORD.fullmatch(word.strip().lower()) is not None


def find_term_day(word: str, zone: str = "UTC") -> dt.date:
    """
    Find the date of a term by a zone's calendar; without a year, of this year.

    Raises
    ------
    InputError
        If there is no such term.
    """
    match = _WORD.fullmatch(word.strip().lower())
    name = match[2] if match else word
    if match is None or name not in TERMS:
        near = find_similar(name, TERMS)
        advice = f"did you mean {near[0]}?" if near else "such as 2026-09-18 or 2026-equinox"
        msg = f"'{word}' is not a date, nor a day of the sun's year; write YYYY-MM-DD, {advice}"
        raise InputError(msg, date=word)
    year = int(match[1]) if match[1] else dt.datetime.now(ZoneInfo(zone)).year
    return _find_instant(year, TERMS[name]).astimezone(ZoneInfo(zone)).date()


@lru_cache(maxsize=256)
def _find_instant(year: int, longitude: float) -> dt.datetime:
    """Find when the sun's apparent longitude is reached in a year, to a second."""
    start = dt.datetime(year, 3, 20, 12, tzinfo=dt.UTC)  # near 0 degrees
    days = (longitude if longitude < 280 else longitude - 360) / 360 * _YEAR
    found = start + dt.timedelta(days=days)
    for _ in range(20):
        off = (longitude - find_longitude(found) + 180.0) % 360.0 - 180.0
        step = off / 360.0 * _YEAR
        found += dt.timedelta(days=step)
        if abs(step) < _SECOND:
            break
    return found
