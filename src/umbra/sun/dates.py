"""Which dates a study asks for: one, several, every n-th of a range, a month or a year."""

import calendar
import datetime as dt
import re
from collections.abc import Sequence

import numpy as np

from umbra.errors import InputError
from umbra.sun.local_time import parse_date

__all__ = ["parse_dates"]

Date = str | dt.date | np.datetime64
"""What is read as a date; pandas' timestamps are dates of the standard library."""

_YEAR = re.compile(r"([0-9]{4})(?:-([0-9]{1,2}))?")
_EVERY_MONTH = re.compile(r"([0-9]{4})-\*-([0-9]{1,2})")


def parse_dates(dates: Date | Sequence[Date], every_days: int = 1) -> tuple[dt.date, ...]:
    """
    List the dates that some words name, in order and each once.

    Parameters
    ----------
    dates : str, date, datetime64, Timestamp, or a sequence of them
        ``2026-03-21``; several joined by commas; ``2026-03-21..2026-09-23``, both ends
        included; ``2026``, the whole year; ``2026-06``, the whole month; ``2026-*-21``,
        that day of every month which has it.
    every_days : int
        Of a range, a month or a year take every so many days, from its first on.

    Returns
    -------
    dates : tuple of datetime.date

    Raises
    ------
    InputError
        If a word is no date and none of these, a range runs backward, or ``every_days``
        is below 1.
    """
    if every_days < 1:
        msg = f"every {every_days} days is not possible; give 1 or more"
        raise InputError(msg, every_days=every_days)
    given = [dates] if isinstance(dates, Date) else list(dates)
    words: list[Date] = []
    for item in given:
        words += item.split(",") if isinstance(item, str) else [item]
    found = {day for word in words for day in _find_days(word, every_days)}
    if not found:
        msg = "there is no date; give one, such as 2026-09-18"
        raise InputError(msg, dates=dates)
    return tuple(sorted(found))


def _find_days(word: Date, every_days: int) -> list[dt.date]:
    """Give the dates that one word names."""
    if not isinstance(word, str):
        return [parse_date(word)]
    text = word.strip()
    if ".." in text:
        start, _, end = (part.strip() for part in text.partition(".."))
        return _walk(_find_days(start, 1)[0], _find_days(end, 1)[-1], every_days, text)
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
    return [parse_date(text)]


def _last_day(year: int, month: int) -> int:
    return calendar.monthrange(year, month)[1] if 1 <= month <= 12 else 1


def _walk(first: dt.date, last: dt.date, every_days: int, text: str) -> list[dt.date]:
    if last < first:
        msg = f"the range {text} ends before it begins; swap its dates"
        raise InputError(msg, dates=text)
    days = (last - first).days
    return [first + dt.timedelta(days=n) for n in range(0, days + 1, every_days)]
