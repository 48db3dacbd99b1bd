"""Measurement of a rule on its dates and hours, and its wording."""

import datetime as dt
import zoneinfo
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.errors import show_count
from umbra.lights import Period
from umbra.rules.first_format import Check
from umbra.rules.record import Place
from umbra.study.accumulators.intervals import SunIntervalTable, to_hours
from umbra.study.accumulators.step_masks import IntervalCount
from umbra.study.loop import TileRun, pass_lights
from umbra.sun.clock import say_hours

__all__ = ["Verdict", "find_check_intervals", "meets_limit", "pick_hours"]

_SLACK = 1e-4  # rounding of microsecond sums kept as float32 hours [h]
_WORDS = {
    "sun_hours": "sun",
    "longest_sun_hours": "unbroken sun",
    "sun_hours_in_spells": "sun in spells",
    "shadow_hours": "shadow",
}


@dataclass(frozen=True)
class Verdict:
    """
    A check's outcome on one date at one receiver.

    Parameters
    ----------
    check : str
    date : datetime.date
    where : str
        An area, or a place's name.
    wanted, measured : str
        In words, with units.
    passes : bool
    evidence : str
        Evidence of the verdict.
    place : Place, optional
        Position of a named place.
    standing : str
        Building that it lies in, under or on: ``inside Church``.
    """

    check: str
    date: dt.date
    where: str
    wanted: str
    measured: str
    passes: bool
    evidence: str
    place: Place | None = None
    standing: str = ""


def find_check_intervals(
    check: Check,
    period: Period,
    run: TileRun,
    canopy: Canopy | None = None,
) -> SunIntervalTable:
    """
    Measure a check's instants on some receivers.

    Parameters
    ----------
    check : Check
    period : Period
        Of one date of the check.
    run : TileRun
        With a second counter if there are canopies.
    canopy : Canopy, optional
        Hours behind it alone count by its transmitted share, and are in no interval.

    Returns
    -------
    intervals : SunIntervalTable
    """
    share = None if canopy is None else canopy.season.find_share(period.days[0])
    count = IntervalCount(check.min_spell // dt.timedelta(microseconds=1), share)
    run = run.behind_land(period)
    pass_lights(run, period.make_lights(period.sun.altitude >= check.min_altitude), [count])
    return count.finish()


def pick_hours(check: Check, period: Period, intervals: SunIntervalTable) -> NDArray[np.float32]:
    """Return the hours that the check measures [h]."""
    light = intervals.sun if intervals.light is None else intervals.light
    if check.measure == "longest_sun_hours":
        return to_hours(intervals.longest)
    if check.measure == "sun_hours_in_spells":
        return to_hours(intervals.counted)
    if check.measure == "shadow_hours":
        is_counted = period.sun.is_up & (period.sun.altitude >= check.min_altitude)
        return (period.hours[is_counted].sum() - to_hours(light)).astype(np.float32)
    return to_hours(light)


def meets_limit(check: Check, hours: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return which hours meet the limit."""
    limit = check.limit.total_seconds() / 3600
    return hours >= limit - _SLACK if check.is_least else hours <= limit + _SLACK


def say_limit(check: Check) -> str:
    """Describe the limit."""
    limit = check.limit.total_seconds() / 3600
    length = f" of at least {say_hours(check.min_spell.total_seconds() / 3600)}"
    return (
        f"at {'least' if check.is_least else 'most'} {say_hours(limit)} of {_WORDS[check.measure]}"
        + (length if check.min_spell else "")
    )


def say_how(check: Check) -> str:
    """Describe the hours and steps of measurement."""
    altitude = f", sun at {check.min_altitude:g}° or higher" if check.min_altitude > 0 else ""
    return f"{check.start} to {check.end}, steps of {check.every}{altitude}"


def say_intervals(zone: str, intervals: SunIntervalTable, index: tuple[int, ...]) -> str:
    """Describe the sun intervals of one receiver."""
    first, last = intervals.first[index], intervals.last[index]
    behind = ""
    if intervals.behind is not None and intervals.behind[index] > 0:
        behind = f", {say_hours(float(to_hours(intervals.behind)[index]))} more behind canopies"
    if np.isnat(first):
        return f"no sun{behind}"
    n = int(intervals.count[index])
    hours = float(to_hours(intervals.sun)[index])
    return (
        f"{say_hours(hours)} of sun in {show_count(n, 'spell')}, "
        f"from {read_clock(zone, first)} to {read_clock(zone, last)}{behind}"
    )


def read_clock(zone: str, instant: np.datetime64) -> str:
    """Format an instant in local time."""
    local = instant.astype("datetime64[us]").item().replace(tzinfo=dt.UTC)
    return f"{local.astimezone(zoneinfo.ZoneInfo(zone)):%H:%M}"
