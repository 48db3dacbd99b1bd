"""Values of a condition at each receiver, on the date that decides, and their uncertainty."""

import datetime as dt
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.rules.record import Condition
from umbra.rules.words import MEASURES
from umbra.study.accumulators.intervals import IntervalState
from umbra.verdicts.subjects import Subjects
from umbra.verdicts.sunlight import SunDay, SunlightOf

__all__ = ["Values", "measure"]

SLACK = 1e-4
"""Rounding of hours and percents."""
_US = 3.6e9
_SKY_OFF = 0.14  # of the sky by directions, in points of 100


@dataclass(frozen=True, eq=False, kw_only=True)
class Values:
    """
    Values of k receivers on one date, or of no date.

    Parameters
    ----------
    value : (k,) float64
        In the unit of the measure; percents of the area where the condition has a share.
    unit : str
    date : tuple of (datetime.date or None)
        Of each receiver.
    before : (k,) float64, optional
        The same without the proposal.
    off : (k,) float64
        What it may be off by.
    first, last : (k,) datetime64[us]
        UTC start of the first spell and end of the last; NaT if none.
    spells : (k,) int64
    hours : (n,) float64, optional
        Of each sample, of one date.
    """

    value: NDArray[np.float64]
    unit: str
    date: tuple[dt.date | None, ...]
    before: NDArray[np.float64] | None
    off: NDArray[np.float64]
    first: NDArray[np.datetime64]
    last: NDArray[np.datetime64]
    spells: NDArray[np.int64]
    hours: NDArray[np.float64] | None = None


@dataclass(frozen=True, eq=False)
class _Hours:
    """Hours of samples, or of receivers, on a date."""

    hours: NDArray[np.float64]
    off: NDArray[np.float64]
    first: NDArray[np.datetime64]
    last: NDArray[np.datetime64]
    spells: NDArray[np.int64]


def measure(condition: Condition, sunlight: SunlightOf, *, has_before: bool) -> list[Values]:
    """
    Measure a condition at all receivers.

    Parameters
    ----------
    condition : Condition
    sunlight : SunlightOf
    has_before : bool
        Whether there is a proposal, without which the same is measured, too.

    Returns
    -------
    values : list of Values
        One for each date that is judged by itself; else one.
    """
    if not MEASURES[condition.measure].is_of_dates:
        return [_measure_sky(condition, sunlight, has_before=has_before)]
    if condition.measure == "new_shadow_share":
        return [_measure_new_share(condition, sunlight)]
    dated = [
        _measure_day(condition, sunlight.subjects, day, before)
        for day, before in _pair_days(condition, sunlight, has_before=has_before)
    ]
    return dated if condition.over == "each" else [_join(condition, dated)]


def _pair_days(
    condition: Condition, sunlight: SunlightOf, *, has_before: bool
) -> Iterator[tuple[SunDay, SunDay | None]]:
    """Yield each date after and, if it is asked for, before."""
    which = "proposed" if condition.casters == "proposed" else "after"
    after = (_choose(one, condition, sunlight.subjects)
             for one in sunlight.list_days(condition, which))  # fmt: skip
    if not has_before or condition.casters == "proposed":
        yield from ((one, None) for one in after)
        return
    before = (_choose(one, condition, sunlight.subjects)
              for one in sunlight.list_days(condition, "before"))  # fmt: skip
    yield from zip(after, before, strict=True)


def _choose(day: SunDay, condition: Condition, subjects: Subjects) -> SunDay:
    """Leave out the sun below the lowest altitude, and too flat to a facade."""
    if condition.min_altitude > 0:
        day = day.pick(day.altitudes >= condition.min_altitude)
    if condition.min_angle > 0:
        flat, toward = day.directions[:, :2], subjects.normals[:, :2]
        length = np.linalg.norm(flat, axis=1)[:, None] * np.linalg.norm(toward, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            angle = np.degrees(np.arcsin(np.clip((flat @ toward.T) / length, -1, 1)))
        day = replace(day, lit=day.lit & ~(angle < condition.min_angle))
    return day


def _measure_day(
    condition: Condition, subjects: Subjects, day: SunDay, before: SunDay | None
) -> Values:
    found = _find_hours(condition, subjects, day, before)
    value, off = _reduce(condition, subjects, found)
    earlier = None
    if before is not None and condition.measure not in {"hours_lost", "new_shadow_hours"}:
        earlier, _ = _reduce(condition, subjects, _find_hours(condition, subjects, before, None))
    of_receiver = len(found.hours) == len(subjects) and len(subjects) != len(subjects.owner)
    starts = np.searchsorted(subjects.owner, np.arange(len(subjects)))

    def collect(pick: Callable, values: NDArray) -> NDArray:
        return values if of_receiver or not len(values) else pick.reduceat(values, starts)  # type: ignore[attr-defined]

    return Values(
        value=value, unit=_find_unit(condition, subjects), before=earlier, off=off,
        date=(day.date,) * len(subjects), first=collect(np.fmin, found.first),
        last=collect(np.fmax, found.last), spells=collect(np.maximum, found.spells),
        hours=None if of_receiver else found.hours,
    )  # fmt: skip


def _find_unit(condition: Condition, subjects: Subjects) -> str:
    is_share = _judges_share(condition, subjects)
    return "%" if is_share else MEASURES[condition.measure].unit


def _judges_share(condition: Condition, subjects: Subjects) -> bool:
    """Return whether a share of each area is judged, not its hours."""
    has_hours = condition.at_least is not None or condition.at_most is not None
    is_area = subjects.kind in {"areas", "band"}
    asks = condition.share is not None or condition.ratio_to_before is not None
    return is_area and has_hours and asks and condition.lit_area is None


def _find_hours(
    condition: Condition, subjects: Subjects, day: SunDay, before: SunDay | None
) -> _Hours:
    """Return hours of each sample; of each receiver where a moment counts for it as a whole."""
    lit = day.lit
    if condition.measure == "shadow_hours":
        lit = ~lit
    elif condition.measure in {"hours_lost", "new_shadow_hours"}:
        lit = np.zeros_like(lit) if before is None else before.lit & ~lit
    if condition.measure == "new_shadow_hours":
        lit = subjects.add(lit) > 0
    elif condition.lit_area is not None:
        lit = subjects.add(lit * subjects.areas) >= condition.lit_area - SLACK
    elif condition.lit_share is not None:
        share = 100 * subjects.average(lit)
        lit = (share >= condition.lit_share - SLACK) & (share > 0)
    state = IntervalState(lit.shape[1:], int(condition.min_spell.total_seconds() * 1e6))
    if len(lit):
        state.add_steps((~lit).astype(np.uint8), day.starts, day.ends)
    table = state.finish()
    asked = {"longest_sun_hours": table.longest, "sun_hours_in_spells": table.counted}
    hours = asked.get(condition.measure, table.sun) / _US
    return _Hours(hours, _find_off(lit, day), table.first, table.last, table.count.astype(np.int64))


def _find_off(lit: NDArray[np.bool_], day: SunDay) -> NDArray[np.float64]:
    """Return what hours may be off by [h]: half a step for each change between steps in a row."""
    if len(lit) < 2:
        return np.zeros(lit.shape[1:])
    in_a_row = day.starts[1:] == day.ends[:-1]
    half = np.where(in_a_row, np.maximum(day.hours[1:], day.hours[:-1]) / 2, 0.0)
    return np.asarray(half @ (lit[1:] != lit[:-1]))


def _reduce(
    condition: Condition, subjects: Subjects, found: _Hours
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return each receiver's value, and what it may be off by."""
    hours, off = found.hours, found.off
    if len(hours) == len(subjects) and len(subjects.owner) != len(subjects):
        return hours, off
    if _judges_share(condition, subjects):
        is_least = condition.at_least is not None
        limit = condition.at_least if is_least else condition.at_most
        assert limit is not None
        meets = hours >= limit - SLACK if is_least else hours <= limit + SLACK
        near = np.abs(hours - limit) <= off + SLACK
        unsure = subjects.average(near & (off > 0)) + subjects.measure_rim(meets) / 2
        return 100 * subjects.average(meets), 100 * np.minimum(unsure, 1.0)
    if condition.has_limit and subjects.kind in {"areas", "band"}:
        is_least = condition.at_least is not None or condition.at_most is None
        worst = subjects.find_worst(hours, is_least=is_least)
        return worst, subjects.find_worst(off, is_least=False)
    return subjects.average(hours), subjects.find_worst(off, is_least=False)


def _join(condition: Condition, dated: list[Values]) -> Values:
    """Return each receiver's value of the worst or the best date, or the sum."""
    values = np.array([one.value for one in dated])
    columns = np.arange(values.shape[1])
    if condition.over == "sum":
        befores = [one.before for one in dated if one.before is not None]
        last = dated[-1]
        return replace(
            last, value=values.sum(0), off=np.sum([one.off for one in dated], 0),
            before=np.sum(befores, 0) if befores else None, date=(None,) * len(columns), hours=None,
        )  # fmt: skip
    rank = values
    if condition.ratio_to_before is not None or condition.loss_at_most is not None:
        rank = np.array([_rate(condition, one) for one in dated])
    is_low_bad = condition.at_least is not None or condition.ratio_to_before is not None
    seeks_low = is_low_bad == (condition.over == "worst")
    day = rank.argmin(0) if seeks_low else rank.argmax(0)

    def pick(name: str) -> NDArray:
        return np.array([getattr(one, name) for one in dated])[day, columns]

    has_before = dated[0].before is not None
    return replace(
        dated[0], value=values[day, columns], off=pick("off"), first=pick("first"),
        last=pick("last"), spells=pick("spells"), before=pick("before") if has_before else None,
        date=tuple(dated[k].date[0] for k in day), hours=None,
    )  # fmt: skip


def _rate(condition: Condition, values: Values) -> NDArray[np.float64]:
    """Return the ratio to before, or the loss."""
    before = values.value if values.before is None else values.before
    if condition.loss_at_most is not None:
        return before - values.value
    return np.divide(values.value, before, out=np.ones_like(before), where=before > 0)


def _measure_sky(condition: Condition, sunlight: SunlightOf, *, has_before: bool) -> Values:
    subjects = sunlight.subjects
    value = subjects.average(sunlight.measure_sky(condition.measure, "after"))
    before = None
    if has_before:
        before = subjects.average(sunlight.measure_sky(condition.measure, "before"))
    is_sky = condition.measure.startswith("sky")
    off = 0.0 if is_sky else _SKY_OFF
    none = np.full(len(subjects), np.datetime64("NaT"), "datetime64[us]")
    return Values(
        value=value, unit=MEASURES[condition.measure].unit, before=before,
        off=np.full(len(subjects), off), date=(None,) * len(subjects), first=none, last=none,
        spells=np.zeros(len(subjects), np.int64),
    )  # fmt: skip


def _measure_new_share(condition: Condition, sunlight: SunlightOf) -> Values:
    """
    Return the net new shadow of areas as a share of an open level place's sun, over all dates.

    ``before`` is the share that is shaded already.
    """
    subjects = sunlight.subjects
    lost, dark, open_hours = np.zeros(len(subjects)), np.zeros(len(subjects)), 0.0
    for after, before in _pair_days(condition, sunlight, has_before=True):
        assert before is not None
        lost += subjects.average(after.hours @ (before.lit & ~after.lit))
        dark += subjects.average(after.hours @ ~before.lit)
        open_hours += float(after.hours.sum())
    whole = max(open_hours, 1e-9)
    none = np.full(len(subjects), np.datetime64("NaT"), "datetime64[us]")
    return Values(
        value=100 * lost / whole, unit="%", before=100 * dark / whole,
        off=np.zeros(len(subjects)), date=(None,) * len(subjects), first=none, last=none,
        spells=np.zeros(len(subjects), np.int64), hours=np.array([open_hours]),
    )  # fmt: skip
