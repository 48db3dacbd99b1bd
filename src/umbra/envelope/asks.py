"""
What a check asks on one date: which receivers, when, how many hours, of how many of them.

An ask is measured on any casters by the study's own counters: on what stands around before a height
is sought, and on the found heights to verify them.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.envelope.needs import LONGEST, SPELLS, SUM, Needs, measure_lit
from umbra.envelope.planes import Crossings, Pieces, cross_cells
from umbra.envelope.plot import Plot
from umbra.errors import InputError
from umbra.lights import Lights, Period
from umbra.machine import find_memory, name_memory
from umbra.receivers.single import PointTile
from umbra.scene.grid import Places
from umbra.study.accumulators.arrays import ResultArrays, ResultOptions
from umbra.study.accumulators.exact import ExactIntervals, follow_sun
from umbra.study.accumulators.hours import IntervalCount
from umbra.study.accumulators.intervals import SunIntervalTable, to_hours
from umbra.study.loop import look, pass_lights

__all__ = ["Ask", "Base", "find_base", "join_needs"]

_HOUR = 3.6e9  # [us]
_SLACK = 1e-4  # rounding of hours kept as float32 [h]
_EXACT = 0.1  # tolerance of solved times [s]
_BYTES = 150  # of a crossing while it is sorted [byte]


@dataclass(frozen=True, eq=False)
class Ask:
    """
    A check on one date.

    Parameters
    ----------
    name : str
        Of the check, with its date.
    period : Period
        Of one date.
    places : Places
        Receivers, local frame.
    labels : tuple of str
        Name of each receiver.
    measure : int
        SUM, LONGEST or SPELLS.
    limit : (n,) float64
        Hours that each must have [h].
    least : float
        Least length of a spell [h].
    min_altitude : float
        Lowest altitude of the sun that counts [degrees].
    owner : (n,) int64
        Group of each receiver, ascending; a group of one must meet the limit.
    names : tuple of str
        Of the groups.
    weight : (n,) float64
        Of each receiver in its group.
    share : float
        Share of a group's weight that must meet the limit.
    is_continuous : bool
        Whether hours are of the sun's path, not of steps judged at their middle.
    is_alone : bool
        Whether the envelope alone casts, as if nothing stood around.
    """

    name: str
    period: Period
    places: Places
    labels: tuple[str, ...]
    limit: NDArray[np.float64]
    measure: int = SUM
    least: float = 0.0
    min_altitude: float = 0.0
    owner: NDArray[np.int64] | None = None
    names: tuple[str, ...] = ()
    weight: NDArray[np.float64] | None = None
    share: float = 1.0
    is_continuous: bool = False
    is_alone: bool = False

    @cached_property
    def group(self) -> NDArray[np.int64]:
        """Group of each receiver."""
        return np.arange(len(self.labels)) if self.owner is None else self.owner

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """Weight of each receiver."""
        return np.ones(len(self.labels)) if self.weight is None else self.weight

    @property
    def group_names(self) -> tuple[str, ...]:
        """Name of each group."""
        return self.labels if self.owner is None else self.names

    @cached_property
    def lights(self) -> Lights:
        """The suns: at the middles of steps, or close enough to miss no minute."""
        if self.is_continuous:
            return follow_sun(self.period, _EXACT)
        return self.period.make_lights(self.period.sun.altitude >= self.min_altitude)

    def count(self, casting: Casting | None) -> NDArray[np.float64]:
        """Measure the hours of all receivers among casters, (n,) [h]; None: nothing casts."""
        if casting is None:
            return measure_pieces(self, self.cut(self.find_masks(None)))
        part = np.full(len(self.places), -1)
        tile = PointTile(casting, self.places, part)
        if not self.is_continuous:
            count = IntervalCount(round(self.least * _HOUR))
            pass_lights(look(tile, None), self.lights, [count])
            return self._pick(count.finish())
        kept = ResultOptions(tolerance=_EXACT, min_spell=round(self.least * _HOUR), spells=True)
        arrays = ResultArrays(self.period, tile.shape, kept, None, reads_days=True)
        exact = _ExactTable(arrays)
        pass_lights(look(tile, None), self.lights, [exact])
        return self._pick(exact.table)

    def _pick(self, table: SunIntervalTable) -> NDArray[np.float64]:
        values = {SUM: table.sun, LONGEST: table.longest, SPELLS: table.counted}[self.measure]
        return to_hours(values).astype(np.float64)

    def meets(self, hours: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which groups meet the ask, (n_groups,) bool."""
        met = hours >= self.limit - _SLACK
        whole = np.bincount(self.group, self.weights)
        return np.bincount(self.group, self.weights * met) >= self.share * whole - 1e-9

    def lower(self, hours: NDArray[np.float64]) -> "Ask":
        """Ask of groups that do not meet it no more than these hours, each of its receivers."""
        broken = ~self.meets(hours)[self.group]
        # All receivers of a broken group keep what they have; of others as many as before.
        limit = np.where(broken, hours, self.limit)
        return replace(self, limit=limit) if broken.any() else self

    def find_masks(self, casting: Casting | None) -> NDArray[np.uint8]:
        """Return the receivers in shadow at each instant, (m, n) uint8."""
        suns = self.lights.directions
        if casting is None:
            facing = self.places.normals @ suns.T if len(suns) else np.zeros((0, 0))
            return (facing <= 0).T.astype(np.uint8)
        return PointTile(casting, self.places, np.full(len(self.places), -1)).masks(suns)

    def cut(self, masks: NDArray[np.uint8]) -> Pieces:
        """Cut the lit time of each receiver into pieces: steps, or what is lit of them."""
        lit = masks.T == 0
        lights = self.lights
        if not self.is_continuous:
            receiver, at = np.nonzero(lit)
            goes_on = np.zeros(len(at), np.bool_)
            goes_on[1:] = (receiver[1:] == receiver[:-1]) & (at[1:] == at[:-1] + 1)
            goes_on[1:] &= lights.starts[at[1:]] == lights.ends[at[:-1]]
            hours = lights.lengths[at] / _HOUR
            return Pieces(receiver, at, at, hours, goes_on)
        times = lights.starts
        is_run = np.zeros(max(len(times) - 1, 0), np.bool_)
        for runs in lights.days:
            for run in runs:
                is_run[run.start : run.stop - 1] = True
        step = np.searchsorted(self.period.starts, (times[1:] + times[:-1]) // 2, "right")
        receiver, at = np.nonzero(lit[:, 1:] & lit[:, :-1] & is_run)
        follows = np.zeros(len(at), np.bool_)
        follows[1:] = (receiver[1:] == receiver[:-1]) & (at[1:] == at[:-1] + 1)
        begins = ~follows
        begins[1:] |= step[at[1:]] != step[at[:-1]]
        first = np.flatnonzero(begins)
        last = np.append(first[1:], len(at)) - 1
        hours = (times[at[last] + 1] - times[at[first]]) / _HOUR if len(at) else np.zeros(0)
        return Pieces(receiver[first], at[first], at[last] + 1, hours, follows[first])


class _ExactTable(ExactIntervals):
    """Sun intervals with solved ends, of the last day that was counted."""

    def finish_day(self, day: int) -> tuple[SunIntervalTable, int]:
        """Keep the day's table."""
        self.table, up = super().finish_day(day)
        return self.table, up


def measure_pieces(ask: Ask, pieces: Pieces) -> NDArray[np.float64]:
    """Measure all pieces of an ask's receivers, (n,) [h]."""
    count = len(ask.labels)
    none = Crossings(np.zeros(len(pieces.hours) + 1, np.int64), *np.zeros((3, 0)))  # type: ignore
    needs = _make_needs(ask, pieces, none)
    lit = np.ones(len(pieces.hours), np.bool_)
    return np.array([measure_lit(needs, k, lit) for k in range(count)])


def _make_needs(ask: Ask, pieces: Pieces, crossings: Crossings) -> Needs:
    count = len(ask.labels)
    groups = np.searchsorted(ask.group, np.arange(len(ask.group_names) + 1))
    whole = np.bincount(ask.group, ask.weights)
    return Needs(
        crossings, pieces.hours, pieces.goes_on,
        np.searchsorted(pieces.receiver, np.arange(count + 1)), np.full(count, ask.measure),
        np.full(count, ask.least), np.array(ask.limit, np.float64), ask.weights,
        groups.astype(np.int64), ask.share * whole,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Base:
    """
    What receivers have before anything is built, and what must remain.

    Parameters
    ----------
    ask : Ask
        With limits that are not above what is there.
    hours : (n,) float64
        Before [h].
    broken : (n_groups,) bool
        Whether a group does not meet what was asked.
    needs : Needs
    """

    ask: Ask
    hours: NDArray[np.float64]
    broken: NDArray[np.bool_]
    needs: Needs


def find_base(ask: Ask, casting: Casting | None, plot: Plot) -> Base:
    """
    Measure an ask on what stands around, and find the planes of the sun over the plot.

    Raises
    ------
    InputError
        If the planes do not fit in memory.
    """
    pieces = ask.cut(ask.find_masks(casting))
    hours = measure_pieces(ask, pieces)
    broken = ~ask.meets(hours)
    ask = ask.lower(hours)
    longest = int((pieces.last - pieces.first).max(initial=0)) + 1
    most = len(pieces.hours) * sum(plot.index.shape) * (2 if longest > 1 else 1)
    if most * _BYTES / 3 > find_memory():
        msg = (
            f"the rays of {len(pieces.hours):,} lit steps over {sum(plot.index.shape):,} rows and "
            f"columns of cells need some {most * _BYTES / 3e9:,.0f} GB and "
            f"{name_memory(find_memory())}; give a larger cell= or fewer receivers"
        )
        raise InputError(msg, option="cell")
    suns = ask.lights.directions
    crossings = cross_cells(plot, pieces, ask.places.points, suns)
    return Base(ask, hours, broken, _make_needs(ask, pieces, crossings))


def join_needs(bases: list[Base]) -> Needs:
    """Join the needs of several asks."""
    all_needs = [base.needs for base in bases]

    def join(name: str) -> NDArray:
        return np.concatenate([getattr(needs, name) for needs in all_needs])

    def chain(starts: list[NDArray[np.int64]]) -> NDArray[np.int64]:
        counts = np.concatenate([np.diff(some) for some in starts])
        return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)

    crossings = Crossings(
        chain([needs.crossings.start for needs in all_needs]),
        np.concatenate([needs.crossings.cell for needs in all_needs]),
        np.concatenate([needs.crossings.clear for needs in all_needs]),
        np.concatenate([needs.crossings.dark for needs in all_needs]),
    )
    return Needs(
        crossings, join("hours"), join("goes_on"), chain([needs.start for needs in all_needs]),
        join("measure"), join("least"), join("limit"), join("weight"),
        chain([needs.group for needs in all_needs]), join("wanted"),
    )  # fmt: skip
