"""
Local dates and clock times: the dates of a study, and local times in UTC.

``zoneinfo`` gives every local time an instant, also those that the clock skips. Here
such a time is refused, and the error describes the clock's jump.
"""

import calendar
import datetime as dt
import re
from collections.abc import Sequence
from dataclasses import dataclass
from zoneinfo import ZoneInfo

import numpy as np

from umbra.errors import InputError, show_value

__all__ = [
    "find_instant", "has_offset", "name_date", "parse_date", "parse_dates", "tell_skipped",
]  # fmt: skip

# The calendar is Gregorian since October 1582; pvlib's Delta T ends with the year 3000, which
# the last evening of 2999 reaches in UTC.
FIRST_YEAR, LAST_YEAR = 1583, 2999

DATE = re.compile(r"([0-9]{4})-([0-9]{1,2})-([0-9]{1,2})")
TIME = re.compile(r"([0-9]{1,2}):([0-9]{2})(?::([0-9]{2}))?([+-][0-9]{2}:[0-9]{2}(?::[0-9]{2})?)?")
SECOND = dt.timedelta(seconds=1)


@dataclass(frozen=True)
class _Jump:
    """A moment [UTC] at which the local clock jumps, and what it shows before and after."""

    instant: dt.datetime
    before: dt.datetime
    after: dt.datetime


def parse_date(date: str | dt.date | np.datetime64) -> dt.date:
    """
    Read a date ``YYYY-MM-DD`` in the years 1583 to 2999, from text or any library's date.

    One with a clock time has to be midnight.
    """
    if isinstance(date, np.datetime64):
        date = _find_moment(date)
    if isinstance(date, dt.datetime) and date == date:  # noqa: PLR0124 - pandas' NaT is unlike itself
        if date.time() != dt.time():
            msg = (
                f"'{date}' is a date with a clock time, which a day of study has not; give the "
                "date, and the time as start= and end="
            )
            raise InputError(msg, date=date)
        date = date.date()
    if isinstance(date, dt.date) and not isinstance(date, dt.datetime):
        year, month, day = date.year, date.month, date.day
    else:
        match = DATE.fullmatch(date.strip()) if isinstance(date, str) else None
        if not match:
            msg = f"{show_value(date)} is not a date; write YYYY-MM-DD, such as 2026-09-18"
            raise InputError(msg, date=date)
        year, month, day = map(int, match.groups())
    if not FIRST_YEAR <= year <= LAST_YEAR:
        msg = f"the date {date} is in the year {year}; give a year from {FIRST_YEAR} to {LAST_YEAR}"
        raise InputError(msg, date=date)
    if not 1 <= month <= 12:
        msg = f"there is no date {date}: months go from 01 to 12; write YYYY-MM-DD"
        raise InputError(msg, date=date)
    length = calendar.monthrange(year, month)[1]
    if not 1 <= day <= length:
        month_name = calendar.month_name[month]
        msg = f"there is no date {date}: {month_name} {year} has {length} days; give 1 to {length}"
        raise InputError(msg, date=date)
    return dt.date(year, month, day)


def _find_moment(date: np.datetime64) -> dt.datetime | str:
    """Convert a ``numpy.datetime64`` to a datetime, or to its text if Python has none for it."""
    moment = date.astype("datetime64[us]").item()
    return moment if isinstance(moment, dt.datetime) else str(date)


def find_instant(date: dt.date, time: str | dt.time, zone: ZoneInfo, what: str) -> dt.datetime:
    """
    Find the instant [UTC] at which a local clock shows ``HH:MM`` or ``HH:MM:SS``.

    ``24:00`` is the end of the date. A time that comes twice, when the clock goes back, needs its
    offset from UTC: ``02:30+02:00``. ``what`` it is ("start", "end") is for messages.
    """
    wanted, offset, text = _parse_time(date, time, what)
    # fold 0 and 1 are the offsets before and after a jump, whichever way the clock goes.
    first, second = (wanted.replace(tzinfo=zone, fold=fold) for fold in (0, 1))
    early, late = _to_utc(first), _to_utc(second)
    is_end_of_day = wanted.date() > date
    if early == late:
        _check_offset(text, offset, [first], zone)
        return early
    jump = _find_jump(zone, min(early, late) - SECOND, max(early, late))
    if early > late:  # skipped
        if is_end_of_day:
            return jump.instant  # the date ends where the clock jumps
        raise _skipped(date, text, zone, jump)
    if offset is not None:
        _check_offset(text, offset, [first, second], zone)
        return early if first.utcoffset() == offset else late
    if is_end_of_day:
        # 24:00 twice: the later, if the clock went back into the date, ends it.
        return late if (late - SECOND).astimezone(zone).date() == date else early
    choices = [f"{text}{_offset_text(when)}" for when in (first, second)]
    msg = (
        f"{text} comes twice on {date} in {zone.key}: the clock goes back from "
        f"{jump.before:%H:%M} to {jump.after:%H:%M}; say which with {choices[0]} "
        f"({first.tzname()}, the first) or {choices[1]} ({second.tzname()}, the second)"
    )
    raise InputError(msg, time=text, choices=choices)


def has_offset(time: str | dt.time) -> bool:
    """Return whether a clock time names its offset from UTC, which only some zones have."""
    match = TIME.fullmatch(str(time).strip())
    return bool(match and match[4])


def _parse_time(
    date: dt.date, time: str | dt.time, what: str
) -> tuple[dt.datetime, dt.timedelta | None, str]:
    text = time.isoformat() if isinstance(time, dt.time) else str(time).strip()
    match = TIME.fullmatch(text)
    if not match:
        msg = f"the {what} {show_value(time)} is not a clock time; write HH:MM, such as 09:30"
        raise InputError(msg, time=text)
    hour, minute, second = (int(number or 0) for number in match.groups()[:3])
    if (hour, minute, second) == (24, 0, 0) and what == "end":
        hour, date = 0, date + dt.timedelta(days=1)
    if hour > 23 or minute > 59 or second > 59:
        last = "24:00" if what == "end" else "23:59"
        msg = f"the {what} {text} is not on the clock; give a time from 00:00 to {last}"
        raise InputError(msg, time=text)
    offset = None
    if match[4]:
        parts = [int(part) for part in match[4][1:].split(":")]
        seconds = sum(part * unit for part, unit in zip(parts, (3600, 60, 1)))
        offset = dt.timedelta(seconds=-seconds if match[4][0] == "-" else seconds)
        text = text[: match.start(4)]
    wanted = dt.datetime.combine(date, dt.time(hour, minute, second))
    return wanted, offset, text


def _check_offset(
    text: str, offset: dt.timedelta | None, readings: list[dt.datetime], zone: ZoneInfo
) -> None:
    if offset is None or any(when.utcoffset() == offset for when in readings):
        return
    possible = " or ".join(_offset_text(when) for when in readings)
    msg = f"{text} in {zone.key} is {possible} from UTC on {readings[0].date()}; " + (
        "give one of these" if len(readings) > 1 else "leave the offset out"
    )
    raise InputError(msg, time=text)


def _skipped(date: dt.date, text: str, zone: ZoneInfo, jump: _Jump) -> InputError:
    if jump.before <= dt.datetime.combine(date, dt.time()) and jump.after.date() > date:
        msg = (
            f"there is no {date} in {zone.key}: the calendar jumps from the end of "
            f"{jump.before.date() - dt.timedelta(days=1)} to {jump.after.date()}; "
            "give another date"
        )
    else:
        msg = (
            f"there is no {text} on {date} in {zone.key}: the clock jumps from "
            f"{jump.before:%H:%M} to {jump.after:%H:%M}; give a time before or after"
        )
    return InputError(msg, date=date, time=text, before=jump.before, after=jump.after)


def _find_jump(zone: ZoneInfo, low: dt.datetime, high: dt.datetime) -> _Jump:
    """Bisect, to the second, for the first instant in (low, high] with another offset."""

    def offset(instant: dt.datetime) -> dt.timedelta:
        return instant.astimezone(zone).utcoffset() or dt.timedelta(0)

    old = offset(low)
    while high - low > SECOND:
        middle = low + (high - low) // SECOND // 2 * SECOND
        low, high = (middle, high) if offset(middle) == old else (low, middle)
    naive = high.replace(tzinfo=None)
    return _Jump(high, naive + old, naive + offset(high))


def _to_utc(local: dt.datetime) -> dt.datetime:
    return local.astimezone(dt.UTC)


def _offset_text(local: dt.datetime) -> str:
    return local.isoformat()[19:]


Date = str | dt.date | np.datetime64
"""Types that are read as dates; pandas' timestamps are dates of the standard library."""

_YEAR = re.compile(r"([0-9]{4})(?:-([0-9]{1,2}))?")
_THIS_YEAR = re.compile(r"[0-9]{1,2}-[0-9]{1,2}")
_EVERY_MONTH = re.compile(r"([0-9]{4})-\*-([0-9]{1,2})")


def name_date(day: dt.date) -> str:
    """Write a date in words: 21 March 2026."""
    return f"{day.day} {calendar.month_name[day.month]} {day.year}"


def parse_dates(
    dates: Date | Sequence[Date], every_days: int = 1, zone: str = "UTC"
) -> tuple[dt.date, ...]:
    """
    List the dates that an expression names, in order and each once.

    ``2026-03-21``; several joined by commas; ``2026-03-21..2026-09-23``, both ends included;
    ``2026``, the whole year; ``2026-06``, the whole month; ``2026-*-21``, that day of every month
    which has it; ``2026-great-cold`` or another of ``umbra.sun.terms``, by a zone's calendar, and
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
    found = {day for word in words for day in _find_days(word, every_days, zone)}
    if not found:
        msg = "there is no date; give one, such as 2026-09-18"
        raise InputError(msg, dates=dates)
    return tuple(sorted(found))


def tell_skipped(dates: Date | Sequence[Date]) -> list[str]:
    """Name the months that a day of every month leaves out, one line for each expression."""
    given = [dates] if isinstance(dates, Date) else dates
    words = [word.strip() for item in given if isinstance(item, str) for word in item.split(",")]
    told = []
    for word in words:
        found = {day.month for day in _find_days(word, 1)} if _EVERY_MONTH.fullmatch(word) else ()
        lost = [
            calendar.month_name[month] for month in range(1, 13) if found and month not in found
        ]
        if lost:
            told.append(f"date={word}: left out are {', '.join(lost)}, which have no such day")
    return told


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
    if any(letter.isalpha() for letter in text):
        from umbra.sun.terms import find_term_day, is_term  # noqa: PLC0415 - it imports this module

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
