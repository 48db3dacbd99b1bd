"""Values of a condition at each receiver, on the date that decides, and their uncertainty."""

import datetime as dt
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.rules.record import Condition
from umbra.rules.words import MEASURES
from umbra.study.accumulators.intervals import IntervalState
from umbra.verdicts.doubt import ShareDoubt, bound_hours, bound_lost_hours, doubt_share
from umbra.verdicts.subjects import Subjects
from umbra.verdicts.sunlight import SunDay, SunlightOf

__all__ = ["Values", "measure"]

SLACK = 1e-4
"""Rounding of hours and percents."""
_PLAIN = frozenset({"sun_hours", "shadow_hours"})  # that add up moments
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
    before_off, lost_off : (k,) float64, optional
        What ``before``, and what the proposal takes of it, may be off by.
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
    before_off: NDArray[np.float64] | None = None
    lost_off: NDArray[np.float64] | None = None


@dataclass(frozen=True, eq=False)
class _Hours:
    """Hours of samples, or of receivers, on a date."""

    lit: NDArray[np.bool_]
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
    after = (_choose(day, condition, sunlight.subjects)
             for day in sunlight.list_days(condition, which))  # fmt: skip
    if not has_before or condition.casters == "proposed":
        yield from ((day, None) for day in after)
        return
    before = (_choose(day, condition, sunlight.subjects)
              for day in sunlight.list_days(condition, "before"))  # fmt: skip
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
    measured = _find_hours(condition, subjects, day, before)
    value, off = _reduce(condition, subjects, measured)
    earlier = before_off = lost_off = None
    if before is not None and condition.measure not in {"hours_lost", "new_shadow_hours"}:
        was = _find_hours(condition, subjects, before, None)
        earlier, before_off = _reduce(condition, subjects, was)
        lost_off = _bound_lost(condition, subjects, day, measured, was)
    of_receiver = len(measured.hours) == len(subjects) and len(subjects) != len(subjects.owner)
    starts = np.searchsorted(subjects.owner, np.arange(len(subjects)))

    def collect(pick: Callable, values: NDArray) -> NDArray:
        return values if of_receiver or not len(values) else pick.reduceat(values, starts)  # type: ignore[attr-defined]

    return Values(
        value=value, unit=_find_unit(condition, subjects), before=earlier, off=off,
        date=(day.date,) * len(subjects), first=collect(np.fmin, measured.first),
        last=collect(np.fmax, measured.last), spells=collect(np.maximum, measured.spells),
        hours=None if of_receiver else measured.hours, before_off=before_off, lost_off=lost_off,
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
        if condition.casters == "proposed":  # what is turned away is no shadow of its own
            lit &= ~subjects.find_away(day.directions)
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
    by_measure = {"longest_sun_hours": table.longest, "sun_hours_in_spells": table.counted}
    hours = by_measure.get(condition.measure, table.sun) / _US
    off, count = bound_hours(lit, day), table.count.astype(np.int64)
    return _Hours(lit, hours, off, table.first, table.last, count)


def _doubt_share(condition: Condition, subjects: Subjects, measured: _Hours) -> ShareDoubt:
    """Return which cells meet the limit of hours, of a share of each area, and the doubt."""
    hours, is_least = measured.hours, condition.at_least is not None
    limit = condition.at_least if is_least else condition.at_most
    assert limit is not None
    meets = hours >= limit - SLACK if is_least else hours <= limit + SLACK
    near = (np.abs(hours - limit) <= measured.off + SLACK) & (measured.off > 0)
    return doubt_share(subjects, meets, near)


def _bound_lost(
    condition: Condition, subjects: Subjects, day: SunDay, measured: _Hours, was: _Hours
) -> NDArray[np.float64]:
    """Return what the difference to before may be off by, of each receiver."""
    changed = (measured.lit != was.lit).any(0)
    if _judges_share(condition, subjects):
        doubt = _doubt_share(condition, subjects, measured)
        return 100 * doubt.bound_lost(subjects, _doubt_share(condition, subjects, was), changed)
    if condition.measure in _PLAIN and subjects.kind not in {"areas", "band"}:
        off = bound_lost_hours(measured.lit, was.lit, day)
    else:  # the least of an area may be another cell's; a spell may end at another moment
        off = np.where(changed, measured.off + was.off, 0.0)
    of_receiver = len(off) == len(subjects)
    return off if of_receiver else subjects.find_worst(off, is_least=False)


def _reduce(
    condition: Condition, subjects: Subjects, measured: _Hours
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return each receiver's value, and what it may be off by."""
    hours, off = measured.hours, measured.off
    if len(hours) == len(subjects) and len(subjects.owner) != len(subjects):
        return hours, off
    if _judges_share(condition, subjects):
        doubt = _doubt_share(condition, subjects, measured)
        return 100 * subjects.average(doubt.meets), 100 * doubt.bound(subjects)
    if condition.has_limit and subjects.kind in {"areas", "band"}:
        is_least = condition.at_least is not None or condition.at_most is None
        worst = subjects.find_worst(hours, is_least=is_least)
        return worst, subjects.find_worst(off, is_least=False)
    return subjects.average(hours), subjects.find_worst(off, is_least=False)


def _join(condition: Condition, dated: list[Values]) -> Values:
    """Return each receiver's value of the worst or the best date, or the sum."""
    values = np.array([item.value for item in dated])
    columns = np.arange(values.shape[1])
    if condition.over == "sum":

        def add(name: str) -> Any:
            arrays = [getattr(item, name) for item in dated]
            return None if arrays[0] is None else np.sum(arrays, 0)

        return replace(
            dated[-1], value=values.sum(0), date=(None,) * len(columns), hours=None,
            **{name: add(name) for name in ("off", "before", "before_off", "lost_off")},
        )  # fmt: skip
    rank = values
    if condition.ratio_to_before is not None or condition.loss_at_most is not None:
        rank = np.array([_rate(condition, item) for item in dated])
    is_low_bad = condition.at_least is not None or condition.ratio_to_before is not None
    seeks_low = is_low_bad == (condition.over == "worst")
    day = rank.argmin(0) if seeks_low else rank.argmax(0)

    def pick(name: str) -> Any:
        arrays = [getattr(item, name) for item in dated]
        return None if arrays[0] is None else np.array(arrays)[day, columns]

    names = ("off", "first", "last", "spells", "before", "before_off", "lost_off")
    return replace(
        dated[0],
        value=values[day, columns],
        date=tuple(dated[k].date[0] for k in day),
        hours=None,
        **{name: pick(name) for name in names},
    )


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
    off = np.full(len(subjects), 0.0 if is_sky else _SKY_OFF)
    lost_off = None if before is None else np.where(np.isclose(value, before), 0.0, off)
    none = np.full(len(subjects), np.datetime64("NaT"), "datetime64[us]")
    return Values(
        value=value, unit=MEASURES[condition.measure].unit, before=before,
        off=off, date=(None,) * len(subjects), first=none, last=none,
        spells=np.zeros(len(subjects), np.int64), before_off=off, lost_off=lost_off,
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
