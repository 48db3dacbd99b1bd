"""
Dates that words name: ranges, months, years, and days of the sun's year.

Days of the sun's year are equinoxes, solstices and solar terms, by its apparent longitude. The date
is that of the site's calendar: Great Cold of 2026 is on 20 January in Beijing.
"""

import calendar
import datetime as dt
import re
from collections.abc import Sequence
from functools import lru_cache
from zoneinfo import ZoneInfo

import numpy as np

from umbra.errors import InputError, find_similar, show_value
from umbra.sun.local_time import parse_date
from umbra.sun.position import find_longitude

__all__ = [
    "TERMS", "Date", "find_term_day", "is_term", "name_date", "name_days", "parse_dates",
    "tell_skipped",
]  # fmt: skip

TERMS = {
    "equinox": 0, "spring-equinox": 0, "march-equinox": 0, "summer-solstice": 90,
    "june-solstice": 90, "autumn-equinox": 180, "september-equinox": 180, "winter-solstice": 270,
    "december-solstice": 270, "minor-cold": 285, "great-cold": 300, "start-of-spring": 315,
    "rain-water": 330, "start-of-summer": 45, "start-of-autumn": 135, "start-of-winter": 225,
}  # fmt: skip
"""Apparent longitude of the sun [degrees] of each."""
_WORD = re.compile(r"(?:([0-9]{4})-)?([a-z]+(?:-[a-z]+)*)")
_TROPICAL_YEAR = 365.2422  # [day]
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
    return _find_term(year, TERMS[name]).astimezone(ZoneInfo(zone)).date()


@lru_cache(maxsize=256)
def _find_term(year: int, longitude: float) -> dt.datetime:
    """Find when the sun's apparent longitude is reached in a year, to a second."""
    start = dt.datetime(year, 3, 20, 12, tzinfo=dt.UTC)  # near 0 degrees
    days = (longitude if longitude < 280 else longitude - 360) / 360 * _TROPICAL_YEAR
    instant = start + dt.timedelta(days=days)
    for _ in range(20):
        off = (longitude - find_longitude(instant) + 180.0) % 360.0 - 180.0
        step = off / 360.0 * _TROPICAL_YEAR
        instant += dt.timedelta(days=step)
        if abs(step) < _SECOND:
            break
    return instant


Date = str | dt.date | np.datetime64
"""Types that are read as dates; pandas' timestamps are dates of the standard library."""

_YEAR = re.compile(r"([0-9]{4})(?:-([0-9]{1,2}))?")
_THIS_YEAR = re.compile(r"[0-9]{1,2}-[0-9]{1,2}")
_EVERY_MONTH = re.compile(r"([0-9]{4})-\*-([0-9]{1,2})")


def name_date(day: dt.date) -> str:
    """Write a date in words: 21 March 2026."""
    return f"{day.day} {calendar.month_name[day.month]} {day.year}"


def name_days(days: Sequence[dt.date], most: int) -> str:
    """Write dates in words, each year once; of more than ``most`` the number and the ends."""
    if len(days) > most:
        return f"{len(days)} days from {name_date(days[0])} to {name_date(days[-1])}"
    nexts = (*days[1:], None)
    named = [
        name_date(day) if after is None or after.year != day.year
        else name_date(day).rpartition(" ")[0]
        for day, after in zip(days, nexts, strict=True)
    ]  # fmt: skip
    *others, last = named
    return f"{', '.join(others)} and {last}" if others else last


def parse_dates(
    dates: Date | Sequence[Date], every_days: int = 1, zone: str = "UTC"
) -> tuple[dt.date, ...]:
    """
    List the dates that an expression names, in order and each once.

    ``2026-03-21``; several joined by commas; ``2026-03-21..2026-09-23``, both ends included;
    ``2026``, the whole year; ``2026-06``, the whole month; ``2026-*-21``, that day of every month
    which has it; ``2026-great-cold`` or another of ``TERMS``, by a zone's calendar, and
    without a year, as ``03-21``, in this year; or a sequence of dates of any library.
    ``every_days`` takes only every n-th day of a range, a month or a year, from its first day on.
    An `InputError` says that a word is no date and none of these, a range runs backward, or
    ``every_days`` is below 1.
    """
    if every_days < 1:
        msg = f"every {every_days} days is not possible; give 1 or more"
        raise InputError(msg, every_days=every_days)
    try:
        given = [dates] if isinstance(dates, Date) else list(dates)
    except TypeError as error:
        msg = f"dates are text, such as 2026-09-18, or dates; got {show_value(dates)}"
        raise InputError(msg, dates=dates) from error
    words: list[Date] = []
    for item in given:
        words += item.split(",") if isinstance(item, str) else [item]
    days = {day for word in words for day in _find_days(word, every_days, zone)}
    if not days:
        msg = "there is no date; give one, such as 2026-09-18"
        raise InputError(msg, dates=dates)
    return tuple(sorted(days))


def tell_skipped(dates: Date | Sequence[Date]) -> list[str]:
    """Name the months that a day of every month leaves out, one line for each expression."""
    given = [dates] if isinstance(dates, Date) else dates
    words = [word.strip() for item in given if isinstance(item, str) for word in item.split(",")]
    notes = []
    for word in words:
        months = {day.month for day in _find_days(word, 1)} if _EVERY_MONTH.fullmatch(word) else ()
        lost = [
            calendar.month_name[month] for month in range(1, 13) if months and month not in months
        ]
        if lost:
            notes.append(f"date={word}: left out are {', '.join(lost)}, which have no such day")
    return notes


def _find_days(word: Date, every_days: int, zone: str = "UTC") -> list[dt.date]:
    """Return the dates that one expression names."""
    if not isinstance(word, str):
        return [parse_date(word)]
    text = word.strip()
    if ".." in text:
        start, _, end = (part.strip() for part in text.partition(".."))
        begin, finish = (_find_days(part, 1, zone) for part in (start, end))
        return _walk(begin[0], finish[-1], every_days, text)
    if match := _YEAR.fullmatch(text):
        year = int(match[1])
        months = range(int(match[2]), int(match[2]) + 1) if match[2] else range(1, 13)
        first = parse_date(f"{year:04}-{months[0]:02}-01")
        last = parse_date(f"{year:04}-{months[-1]:02}-{_last_day(year, months[-1])}")
        return _walk(first, last, every_days, text)
    if match := _EVERY_MONTH.fullmatch(text):
        year, day = int(match[1]), int(match[2])
        parse_date(f"{year:04}-01-{day:02}")  # refuses a year or day that no month has
        return [
            dt.date(year, month, day) for month in range(1, 13) if day <= _last_day(year, month)
        ]
    return [parse_date(_spell_out(text, zone))]


def _spell_out(text: str, zone: str) -> str:
    """Return a date in full: of one without a year in this one, or of a day of the sun's year."""
    if _THIS_YEAR.fullmatch(text):
        return f"{dt.datetime.now(ZoneInfo(zone)).year:04}-{text}"
    if is_term(text):
        return str(find_term_day(text, zone))
    return text


def _last_day(year: int, month: int) -> int:
    return calendar.monthrange(year, month)[1] if 1 <= month <= 12 else 1


def _walk(first: dt.date, last: dt.date, every_days: int, text: str) -> list[dt.date]:
    if last < first:
        msg = f"the range {text} ends before it begins; swap its dates"
        raise InputError(msg, dates=text)
    days = (last - first).days
    return [first + dt.timedelta(days=n) for n in range(0, days + 1, every_days)]
