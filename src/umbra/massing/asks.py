"""
What is asked on one date: which receivers, when, and how many hours.

An ask is measured on any casters by the study's own counters: on what stands around before a height
is sought, and on the found heights to verify them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.lights import Lights, Period
from umbra.massing.planes import LONGEST, SPELLS, SUM, Needs, RayCrossings, SunPieces, measure_lit
from umbra.receivers.openings import Openings
from umbra.receivers.single import PointTile
from umbra.scene.grid import Places
from umbra.study.accumulators.arrays import ResultArrays, ResultOptions
from umbra.study.accumulators.exact import ExactIntervals, follow_sun
from umbra.study.accumulators.intervals import SunIntervalTable, to_hours
from umbra.study.accumulators.step_masks import IntervalCount
from umbra.study.loop import make_tile_run, pass_lights

__all__ = ["Ask", "measure_pieces"]

_HOUR = 3.6e9  # [us]
_SLACK = 1e-4  # rounding of hours kept as float32 [h]
_EXACT = 0.1  # tolerance of solved times [s]


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
    owner, share : (n_places,) int64 and float64, optional
        Of places that are samples of a receiver, such as a whole pane: which, in ascending order,
        and their share of it. Its hours are the mean of theirs. By default each is a receiver.
    measure : int
        SUM, LONGEST or SPELLS.
    limit : (n,) float64
        Hours that each must have [h].
    least : float
        Least length of a spell [h].
    min_altitude : float
        Lowest altitude of the sun that counts [degrees].
    min_angle : float
        Lowest angle between a receiver's plane and the sun's azimuth that counts [degrees].
    is_continuous : bool
        Whether hours are of the sun's path, not of steps judged at their middle.
    is_alone : bool
        Whether the envelope alone casts, as if nothing stood around.
    openings : Openings, optional
        Of places on windows, which see the sun through them alone.
    """

    name: str
    period: Period
    places: Places
    labels: tuple[str, ...]
    limit: NDArray[np.float64]
    measure: int = SUM
    least: float = 0.0
    min_altitude: float = 0.0
    min_angle: float = 0.0
    is_continuous: bool = False
    is_alone: bool = False
    owner: NDArray[np.int64] | None = None
    share: NDArray[np.float64] | None = None
    openings: Openings | None = None

    @property
    def receivers(self) -> NDArray[np.int64]:
        """The receiver of each place, (n_places,)."""
        return np.arange(len(self.labels)) if self.owner is None else self.owner

    def gather(self, pieces: SunPieces) -> SunPieces:
        """Return pieces of places as those of receivers, each of which counts by its share."""
        if self.owner is None or self.share is None:
            return pieces
        at = pieces.receiver
        return pieces._replace(receiver=self.owner[at], hours=pieces.hours * self.share[at])

    @cached_property
    def lights(self) -> Lights:
        """The suns: at the middles of steps, or close enough to miss no minute."""
        if self.is_continuous:
            return follow_sun(self.period, _EXACT)
        sun = self.period.sun
        is_behind = self.period.meets_land(sun.direction)
        return self.period.make_lights((sun.altitude >= self.min_altitude) & ~is_behind)

    def count(self, casting: Casting | None) -> NDArray[np.float64]:
        """Measure the hours of all receivers among casters, (n,) [h]; None: nothing casts."""
        is_framed = self.openings is not None and self.openings.are_deep
        if casting is None or self.min_angle > 0 or is_framed:
            return measure_pieces(self, self.cut(self.find_masks(casting)))
        tile = PointTile(casting, self.places, np.full(len(self.places), -1))
        if not self.is_continuous:
            count = IntervalCount(round(self.least * _HOUR))
            pass_lights(make_tile_run(tile, None), self.lights, [count])
            return self._pick(count.finish())
        results = ResultOptions(tolerance=_EXACT, min_spell=round(self.least * _HOUR), spells=True)
        arrays = ResultArrays(self.period, tile.shape, results, None, reads_days=True)
        exact = _ExactTable(arrays)
        pass_lights(make_tile_run(tile, None), self.lights, [exact])
        return self._pick(exact.table)

    def _pick(self, table: SunIntervalTable) -> NDArray[np.float64]:
        values = {SUM: table.sun, LONGEST: table.longest, SPELLS: table.counted}[self.measure]
        hours: NDArray[np.float64] = to_hours(values).astype(np.float64)
        if self.owner is not None and self.share is not None:
            totals = np.bincount(self.owner, self.share * hours, len(self.labels))
            hours = totals.astype(np.float64)
        return hours

    def meets(self, hours: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which receivers have enough, (n,) bool."""
        return hours >= self.limit - _SLACK

    def find_masks(self, casting: Casting | None) -> NDArray[np.uint8]:
        """Return the receivers in shadow at each instant, (m, n) uint8."""
        suns, normals = self.lights.directions, self.places.normals
        if casting is None:
            with np.errstate(invalid="ignore"):  # points without a plane face every sun
                masks = (suns @ normals.T <= 0).astype(np.uint8)
        else:
            masks = PointTile(casting, self.places, np.full(len(normals), -1)).masks(suns)
        if self.min_angle > 0:
            level = np.hypot(suns[:, 0], suns[:, 1])[:, None]
            level = np.maximum(level * np.hypot(normals[:, 0], normals[:, 1]), 1e-12)
            masks |= suns[:, :2] @ normals[:, :2].T / level < np.sin(np.radians(self.min_angle))
        if self.openings is not None:
            masks |= self.openings.find_framed(suns[:, None])
        return masks

    def cut(self, masks: NDArray[np.uint8]) -> SunPieces:
        """Cut the lit time of each receiver into pieces: steps, or what is lit of them."""
        lit = masks.T == 0
        lights = self.lights
        if not self.is_continuous:
            receiver, at = np.nonzero(lit)
            goes_on = np.zeros(len(at), np.bool_)
            goes_on[1:] = (receiver[1:] == receiver[:-1]) & (at[1:] == at[:-1] + 1)
            goes_on[1:] &= lights.starts[at[1:]] == lights.ends[at[:-1]]
            hours = lights.lengths[at] / _HOUR
            return SunPieces(receiver, at, at, hours, goes_on)
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
        return SunPieces(receiver[first], at[first], at[last] + 1, hours, follows[first])


class _ExactTable(ExactIntervals):
    """Sun intervals with solved ends, of the last day that was counted."""

    def finish_day(self, day: int) -> tuple[SunIntervalTable, int]:
        """Keep the day's table."""
        self.table, up = super().finish_day(day)
        return self.table, up


def measure_pieces(ask: Ask, pieces: SunPieces) -> NDArray[np.float64]:
    """Measure all pieces of an ask's places at its receivers, (n,) [h]."""
    pieces = ask.gather(pieces)
    count = len(ask.labels)
    indices = np.arange(count)
    start = np.searchsorted(pieces.receiver, np.arange(count + 1))
    none = RayCrossings(np.zeros(len(pieces.hours) + 1, np.int64), np.zeros(0, np.int32),
                     np.zeros(0), np.zeros(0))  # fmt: skip
    needs = Needs(
        none, pieces.hours, pieces.goes_on, start, np.full(count, ask.measure),
        np.full(count, ask.least), ask.limit, np.ones(count), np.arange(count + 1), np.ones(count),
    )  # fmt: skip
    lit = np.ones(len(pieces.hours), np.bool_)
    return np.array([measure_lit(needs, k, lit) for k in indices], np.float64)
