"""
Masks of a study's steps: kept, eight to a byte, or reduced to hours and sun intervals.

Each step is judged at its midpoint. A year at 15 minutes has about 17,500 instants with the
sun up, 2.2 GB for a million cells. Nights have no shadow and are not kept.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights, Period
from umbra.receivers.kind import Receivers, Variables
from umbra.study.accumulators.arrays import ResultArrays
from umbra.study.accumulators.intervals import IntervalState, SunIntervalTable, join_days
from umbra.study.light_sums import NO_PARTS, LightParts, add_up
from umbra.study.loop import Accumulator, TileRun

__all__ = [
    "MASKS",
    "DayIntervals",
    "HourSums",
    "InstantMasks",
    "IntervalCount",
    "Masks",
    "SunIntervals",
]

MASKS = ("in_shadow", "under_canopy")
"""Variables of every instant, kept packed."""


class Masks:
    """
    Receivers in shadow at each instant; reads like an (n, ...) uint8 array.

    ``masks[i]`` and iteration unpack one instant at a time, ``numpy.asarray`` all.

    Parameters
    ----------
    is_up : (n,) bool
        Instants with the sun up; others read as 0.
    shape : tuple of int
        Of the receivers.
    """

    dtype = np.dtype(np.uint8)

    def __init__(self, is_up: NDArray[np.bool_], shape: tuple[int, ...]) -> None:
        self.place = np.where(is_up, np.cumsum(is_up) - 1, -1)
        self.bits = np.zeros(((int(is_up.sum()) + 7) // 8, *shape), np.uint8)

    @property
    def shape(self) -> tuple[int, ...]:
        """Instants, then the receivers' own shape."""
        return (len(self.place), *self.bits.shape[1:])

    @property
    def ndim(self) -> int:
        """Number of dimensions."""
        return self.bits.ndim

    @property
    def size(self) -> int:
        """Number of values."""
        return int(np.prod(self.shape, dtype=np.int64))

    @property
    def nbytes(self) -> int:
        """Memory of the packed masks [byte]."""
        return self.bits.nbytes

    def keep(self, instants: NDArray[np.intp], masks: NDArray[np.uint8], where: Any = ...) -> None:
        """
        Store some instants, once each.

        Parameters
        ----------
        instants : (k,) int
            With the sun up.
        masks : (k, ...) uint8
            0 or 1.
        where : index of the receivers
            Rows and columns of a tile; all by default.
        """
        for instant, mask in zip(instants, masks, strict=True):
            position = self.place[instant]
            self.bits[position // 8][where] |= mask << np.uint8(position % 8)

    def __len__(self) -> int:
        return len(self.place)

    def __getitem__(self, key: Any) -> NDArray[np.uint8]:
        if isinstance(key, (int, np.integer)):
            position = self.place[key]
            if position < 0:
                return np.zeros(self.bits.shape[1:], np.uint8)
            return self.bits[position // 8] >> np.uint8(position % 8) & np.uint8(1)
        if isinstance(key, slice):
            return self._unpack(range(len(self))[key])
        return np.asarray(self)[key]

    def __iter__(self) -> Iterator[NDArray[np.uint8]]:
        return (self[i] for i in range(len(self)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray:
        return self._unpack(range(len(self))).astype(dtype or np.uint8, copy=False)

    def _unpack(self, which: range) -> NDArray[np.uint8]:
        masks = np.zeros((len(which), *self.bits.shape[1:]), np.uint8)
        for mask, i in zip(masks, which, strict=True):
            mask[...] = self[i]
        return masks


class InstantMasks(Accumulator):
    """
    Accumulator of every instant's shadow, and of receivers behind canopies alone.

    Parameters
    ----------
    period : Period
        Lights with a negative ``step`` are not midpoints and are skipped.
    shape : tuple of int
        Of all receivers.
    has_canopy : bool
    """

    def __init__(self, period: Period, shape: tuple[int, ...], *, has_canopy: bool) -> None:
        self.masks = Masks(period.sun.is_up, shape)
        self.behind = Masks(period.sun.is_up, shape) if has_canopy else None

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin a tile."""
        self._where = run.where

    def add(self, lights: Lights, span: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """Store these instants."""
        steps = lights.step[span]
        is_kept = steps >= 0
        dark = masks[-1][is_kept]
        self.masks.keep(steps[is_kept], dark, self._where)
        if self.behind is not None:
            self.behind.keep(steps[is_kept], masks[0][is_kept] & ~dark, self._where)

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the results where nothing receives."""
        for masks in (self.masks, self.behind):
            if masks is not None:
                masks.bits[:, nothing] = 0

    def variables(self, laid: Receivers) -> Variables:
        """Return the masks, packed."""
        dims = ("time", *laid.dims)
        variables: dict[str, Any] = {"in_shadow": (dims, self.masks)}
        if self.behind is not None:
            variables["under_canopy"] = (dims, self.behind)
        return variables


class IntervalCount(Accumulator):
    """
    Accumulator of the sun intervals of one day.

    Parameters
    ----------
    least : int
        Least length of an interval that counts as long [us].
    share : float, optional
        Share of light that canopies transmit on the day, if any.
    """

    def __init__(self, least: int, share: float | None = None) -> None:
        self.least, self.share = least, share

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin a tile."""
        self._state = IntervalState(run.shape, self.least)
        self._behind = np.zeros(run.shape if len(run.counters) > 1 else (0,), np.int64)

    def add(self, lights: Lights, span: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """Add some steps."""
        shadow = masks[0]
        if self.share is not None:
            dark = masks[1]
            for mask, length in zip(shadow & ~dark, lights.lengths[span].tolist(), strict=True):
                self._behind += mask * np.int64(length)
            shadow = dark if self.share >= 1 else shadow
        self._state.add_steps(shadow, lights.starts[span], lights.ends[span])

    def finish(self) -> SunIntervalTable:
        """Close all open intervals, and return the table."""
        intervals = self._state.finish()
        return intervals if self.share is None else intervals.add_behind(self._behind, self.share)


class DayIntervals(Accumulator):
    """
    Base of accumulators that store the sun intervals of each day, and of all days.

    Parameters
    ----------
    arrays : ResultArrays
        Written to.
    """

    def __init__(self, arrays: ResultArrays) -> None:
        self.arrays = arrays

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin a tile."""
        self._where = run.where
        self._together: SunIntervalTable | None = None
        self._up = 0

    def finish_day(self, day: int) -> tuple[SunIntervalTable, int]:
        """Return the intervals of a day, and the time with the sun up [us]."""
        raise NotImplementedError

    def end_day(self, day: int) -> None:
        """Store a day."""
        intervals, up = self.finish_day(day)
        self.arrays.enter_day(intervals, up, self._where, day)
        before = self._together
        self._together = intervals if before is None else join_days([before, intervals])
        self._up += up

    def end(self, progress: Callable[[int], object]) -> None:
        """Store all days together."""
        if self._together is not None:
            self.arrays.enter_day(self._together, self._up, self._where, None)


class SunIntervals(DayIntervals):
    """Accumulator of sun intervals that begin and end with steps."""

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin a tile."""
        super().begin(run, lights)
        self._run, self._lights = run, lights
        self._begin_day(0)

    def _begin_day(self, day: int) -> None:
        shares = self.arrays.shares
        share = None if shares is None else float(shares[day])
        self._count = IntervalCount(self.arrays.results.min_spell, share)
        self._count.begin(self._run, self._lights)

    def add(self, lights: Lights, span: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """Add some steps."""
        self._count.add(lights, span, masks)

    def finish_day(self, day: int) -> tuple[SunIntervalTable, int]:
        """End the day, and begin the next."""
        intervals = self._count.finish()
        if day + 1 < len(self._lights.days):
            self._begin_day(day + 1)
        up = sum(int(self._lights.lengths[run].sum()) for run in self._lights.days[day])
        return intervals, up


class HourSums(Accumulator):
    """
    Accumulator of hours, in any order.

    Canopies are a second set of casters: their shadow alone counts by the share of light
    absorbed on the day.

    Parameters
    ----------
    arrays : ResultArrays
        Written to.
    """

    is_streamed = False

    def __init__(self, arrays: ResultArrays) -> None:
        self.arrays = arrays

    def add_sums(self, run: TileRun, lights: Lights, progress: Callable[[int], object]) -> None:
        """Add up the hours; day by day if kept, so that one day is held at a time."""
        arrays, where = self.arrays, run.where
        day = arrays.period.day_of_step[lights.step]
        shares = np.ones(len(arrays.period.days)) if arrays.shares is None else arrays.shares
        if not arrays.has_days:
            shares, group = np.unique(shares, return_inverse=True)
            parts = LightParts.of(arrays.month_of_day[day], arrays.months, run.shape)
            hours, behind = self._add_groups(
                run, lights, group.ravel()[day], shares, progress, parts
            )
            arrays.keep_hours(hours, where)
            arrays.keep_months(parts.sums, where)
            arrays.keep_behind(behind, where)
            return
        total, total_behind = np.zeros((2, *run.shape))
        for k in range(len(shares)):
            of_day = lights.pick(day == k)
            none = np.zeros(len(of_day), np.intp)
            hours, behind = self._add_groups(run, of_day, none, shares[k : k + 1], progress)
            arrays.keep_hours(hours, where, k)
            arrays.keep_behind(behind, where, k)
            total += hours
            total_behind += behind
        arrays.keep_hours(total, where)
        arrays.keep_behind(total_behind, where)

    def _add_groups(
        self, run: TileRun, lights: Lights, group: NDArray[np.intp], shares: NDArray[np.float64],
        progress: Callable[[int], object], parts: LightParts = NO_PARTS,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:  # fmt: skip
        """
        Return the hours in shadow, and behind canopies alone; one share per group.

        The hours in shadow of each part of the lights are added to ``parts``.
        """
        hours, behind = np.zeros((2, *run.shape), np.float32)
        for k, share in enumerate(shares):
            is_own = group == k
            picked, own = lights.pick(is_own), parts.pick(is_own)
            (cast,) = add_up(run.counters[0], run.shape, picked, progress, own)
            if len(run.counters) == 1:
                hours = cast if len(shares) == 1 else hours + cast
                parts.add(own.sums)
                continue
            opaque = parts.pick(is_own)
            (dark,) = add_up(run.counters[1], run.shape, picked, parts=opaque)
            cast -= dark
            hours += dark + np.float32(1 - share) * cast
            behind += cast
            parts.add(opaque.sums + np.float32(1 - share) * (own.sums - opaque.sums))
        return hours, behind
