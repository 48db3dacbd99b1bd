"""
Local dates and clock times, and the instants in UTC that they are.

``zoneinfo`` gives every local time an instant, also those that the clock skips. Here
such a time is refused, and the error describes the clock's jump.
"""

import calendar
import datetime as dt
import re
from dataclasses import dataclass
from zoneinfo import ZoneInfo

import numpy as np

from umbra.errors import InputError, show_value

__all__ = ["find_instant", "has_offset", "parse_date"]

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
            raise InputError(msg, option="start", date=date)
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
