"""
A day's clock at a site: steps of a period and clock times, in UTC.

A period runs in elapsed time, daylight saving counted as it is. Its two ends are read from the
local clock, and only they: from 01:00 to 05:00 on the night the clock jumps ahead is three hours.
"""

import datetime as dt
import itertools
import math
import re
import zoneinfo
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value
from umbra.sun.local_time import find_instant, has_offset, parse_date
from umbra.sun.zones import find_zone

__all__ = [
    "ROUND",
    "Stamps",
    "Steps",
    "check_stamps",
    "check_steps",
    "find_round_stamps",
    "find_stamps",
    "make_steps",
    "parse_duration",
    "say_hours",
]

FindTime = Callable[[dt.date, str | dt.time, str], dt.datetime]
MOST_STEPS = 100_000
MOST_OF_ALL_DATES = 2_000_000
MINUTE = 60_000_000  # [us]
MICROSECOND = dt.timedelta(microseconds=1)
UNITS = {"h": 3600, "hour": 3600, "min": 60, "minute": 60, "m": 60, "s": 1, "sec": 1, "second": 1}
DURATION = re.compile(  # a plural is of words: "1ms" is no minute
    r"([0-9]+(?:\.[0-9]+)?|\.[0-9]+)\s*(h|hour|min|minute|m|s|sec|second)(?:(?<=[a-z]{3})s)?\s*"
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Stamps:
    """Instants of a local date, with their clock times."""

    stamps: NDArray[np.datetime64]  # (n,): UTC, ascending
    zone: str  # IANA name of the local clock

    def labels(self) -> list[str]:
        """
        Format the stamps as local clock times, ``HH:MM``, or ``HH:MM:SS`` where seconds are needed.

        The end of the day is 24:00. Where the clock goes back within the period, each carries its
        abbreviation: ``02:30 CEST``, ``02:30 CET``.
        """
        local = self.local()
        spec = "minutes"
        if any(when.second or when.microsecond for when in local):
            spec = "microseconds" if any(when.microsecond for when in local) else "seconds"
        labels = [when.time().isoformat(spec) for when in local]
        if local[-1].date() > local[0].date():
            labels[-1] = dt.time().isoformat(spec).replace("00", "24", 1)
        if any(later <= label for label, later in itertools.pairwise(labels)):
            labels = [f"{label} {name}" for label, name in zip(labels, self.abbreviations())]
        return labels

    def abbreviations(self) -> list[str]:
        """Return the zone's name at each stamp: ``CEST``, or ``UTC+05:45`` without letters."""
        offsets = self.offsets()
        names = [when.tzname() or "" for when in self.local()]
        return [name if name.isalpha() else offset for name, offset in zip(names, offsets)]

    def offsets(self) -> list[str]:
        """Return the local clock's offset from UTC at each stamp: ``UTC+02:00``."""
        return [f"UTC{when.isoformat()[len(_clock_text(when)) :]}" for when in self.local()]

    def local(self) -> list[dt.datetime]:
        """Return the stamps by the local clock."""
        zone = zoneinfo.ZoneInfo(self.zone)
        return [when.replace(tzinfo=dt.UTC).astimezone(zone) for when in self.stamps.tolist()]


@dataclass(frozen=True, eq=False, kw_only=True)
class Steps(Stamps):
    """The n steps of a period without gaps; stamps (n + 1,) are their starts and the last end."""

    instants: NDArray[np.datetime64]  # (n,) UTC middle of each step
    hours: NDArray[np.float64]  # (n,) length of each step [h], rounded once from whole microseconds


def make_steps(
    date: str | dt.date,
    start: str | dt.time,
    end: str | dt.time,
    every: str | dt.timedelta,
    zone: str,
    find: "FindTime | None" = None,
) -> Steps:
    """
    Cut a period of one local date, start included and end not, into equal steps.

    The last step is shorter where the period is no multiple of the step. The date is
    ``YYYY-MM-DD``; start and end are ``HH:MM`` or ``HH:MM:SS`` on the local clock, the end may be
    ``24:00``, and an offset, ``02:30+02:00``, tells which where the clock shows the time twice.
    The step is ``15min``, ``1h``, ``1h30min``, ``0.5h`` or ``30s``, the zone an IANA name.
    ``find`` finds the instants of start and end instead, as `umbra.sun.day_times.DayClock.find`.

    Raises
    ------
    InputError
        If one of them is not written so; if the date does not exist, or the local time
        is skipped or comes twice on it; if the end is not after the start; if the step
        is not above 0, is longer than the period, or makes over 100,000 steps.
    """
    clock = find_zone(zone)
    day = parse_date(date)
    step = parse_duration(every)
    if find is None:
        first = find_instant(day, start, clock, "start")
        last = find_instant(day, end, clock, "end")
    else:
        first, last = find(day, start, "start"), find(day, end, "end")
    if last <= first:
        ends_at_midnight = str(end).strip() in {"00:00", "0:00", "00:00:00"}
        advice = "write 24:00 for midnight" if ends_at_midnight else "swap them or correct one"
        when = "" if find is None else f" on {day}"
        msg = f"the end {end} is not after the start {start}{when}; {advice}"
        raise InputError(msg, start=start, end=end)
    # Whole microseconds from here, so that the lengths add up.
    length, width = (last - first) // MICROSECOND, step // MICROSECOND
    if width > length:
        whole = _duration_text(last - first)
        msg = (
            f"the step {every} is longer than the period from {start} to {end}; "
            f"give {whole} or less"
        )
        raise InputError(msg, every=every, length=last - first)
    if find is not None:
        # A solar day is not 24 h to a second: steps are stretched rather than one of seconds added.
        near = max(round(length / width), 1)
        width = -(-length // near) if abs(length - near * width) < MINUTE else width
    count = -(-length // width)
    if count > MOST_STEPS:
        least = _duration_text(dt.timedelta(seconds=-(-length // (MOST_STEPS * 1_000_000))))
        msg = f"a step of {every} makes {count:,} steps; give {least} or more"
        raise InputError(msg, every=every, count=count)
    marks = np.minimum(np.arange(count + 1, dtype=np.int64) * width, length)
    stamps = np.datetime64(first.replace(tzinfo=None), "us") + marks.astype("timedelta64[us]")
    lengths = np.diff(marks)
    instants = stamps[:-1] + (lengths // 2).astype("timedelta64[us]")
    return Steps(instants=instants, hours=lengths / 3.6e9, stamps=stamps, zone=zone)


def check_steps(steps: Steps, dates: int, every: str | dt.timedelta) -> None:
    """Refuse more suns than can be counted: the steps of one date, times the dates."""
    count = len(steps.hours) * dates
    if count > MOST_OF_ALL_DATES:
        least = float(steps.hours.sum()) * 3600 * dates / MOST_OF_ALL_DATES
        words = _duration_text(dt.timedelta(seconds=math.ceil(least)))
        msg = (
            f"{dates:,} dates in steps of {every} make {count:,} suns, and {MOST_OF_ALL_DATES:,} "
            f"are the most; give steps of {words} or more, or fewer dates (every_days=)"
        )
        raise InputError(msg, option="every_days", count=count)


def parse_duration(
    every: str | dt.timedelta, what: str = "step", option: str = "every"
) -> dt.timedelta:
    """Read a duration above 0: ``15min``, ``1h``, ``1h30min``, ``30s``; errors name an option."""
    shown = (
        f"the {what} {option}={show_value(every)}" if option else f"the {what} {show_value(every)}"
    )
    if isinstance(every, dt.timedelta):
        duration = every
    else:
        text = str(every).strip().lower()
        if not text or not re.fullmatch(rf"(?:{DURATION.pattern})+", text):
            msg = f"{shown} is not a duration; write it like 15min, 1h, 1h30min or 30s"
            raise InputError(msg, every=every, option=option)
        # Fractions, so that 0.1h is 360 s and not a bit less.
        seconds = sum(Fraction(n) * UNITS[unit] for n, unit in DURATION.findall(text))
        try:
            duration = dt.timedelta(microseconds=round(seconds * 1_000_000))
        except OverflowError:
            duration = dt.timedelta.max
    if duration <= dt.timedelta(0):
        msg = f"{shown} is not longer than 0; write it like 15min, 1h or 30s"
        raise InputError(msg, every=every)
    return duration


def say_hours(hours: float) -> str:
    """Format hours for reading."""
    minutes = round(hours * 60)
    h, m = divmod(minutes, 60)
    return f"{m} min" if not h and m else f"{h} h" + (f" {m} min" if m else "")


def _duration_text(duration: dt.timedelta) -> str:
    minutes, seconds = divmod(int(duration.total_seconds()), 60)
    hours, minutes = divmod(minutes, 60)
    parts = ((hours, "h"), (minutes, "min"), (seconds, "s"))
    return "".join(f"{number}{unit}" for number, unit in parts if number) or "1s"


ROUND = (1, 2, 5, 10, 15, 20, 30, 60, 120, 180, 240, 360, 720, 1440)
"""Spacings at which clock times are round [min]."""


def _clock_text(when: dt.datetime) -> str:
    return when.replace(tzinfo=None).isoformat()


def check_stamps(times: Sequence[str]) -> None:
    """Refuse clock times that no zone has; those with an offset are checked at the site."""
    for word in _split(times):
        if not has_offset(word):
            find_instant(dt.date(2000, 1, 1), word, zoneinfo.ZoneInfo("UTC"), "time of at=")


def _split(times: Sequence[str]) -> list[str]:
    return [word for text in times for word in str(text).replace(",", " ").split()]


def find_stamps(day: dt.date, times: Sequence[str], zone: str) -> Stamps:
    """Find the instants at which a date's clock shows some times, ``09:00,12:00``, in any order."""
    clock = zoneinfo.ZoneInfo(zone)
    instants = {find_instant(day, word, clock, "time of at=") for word in _split(times)}
    naive = [when.replace(tzinfo=None) for when in sorted(instants)]
    return Stamps(stamps=np.array(naive, "datetime64[us]"), zone=zone)


def find_round_stamps(period: Stamps, minutes: int) -> Stamps:
    """Find the clock times within a period that are multiples of some minutes of ``ROUND``."""
    zone = zoneinfo.ZoneInfo(period.zone)
    at, last = (when.replace(tzinfo=dt.UTC) for when in period.stamps[[0, -1]].tolist())
    stamps = []
    while at <= last:
        local = at.astimezone(zone)
        past = dt.timedelta(
            hours=local.hour, minutes=local.minute, seconds=local.second,
            microseconds=local.microsecond,
        ) % dt.timedelta(minutes=minutes)  # fmt: skip
        if not past:
            stamps.append(at.replace(tzinfo=None))
        # Converted at each, as a clock may jump between.
        at += dt.timedelta(minutes=minutes) - past
    return Stamps(stamps=np.array(stamps, "datetime64[us]"), zone=period.zone)
