"""
Results of named receivers by date: means, first and last sun of areas and windows.

A day's hours of all samples are held, and no more than figures of each group are kept of it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights
from umbra.study.accumulators.arrays import ResultArrays
from umbra.study.accumulators.intervals import SunIntervalTable, to_hours
from umbra.study.accumulators.step_masks import DayIntervals
from umbra.study.loop import Accumulator, TileRun

if TYPE_CHECKING:
    from umbra.receivers.named import NamedReceivers

__all__ = ["GroupDays", "NamedDays"]

_SLACK = 1e-4  # rounding of microsecond sums kept as float32 hours [h]


@dataclass(eq=False)
class GroupDays:
    """
    Figures of groups by date.

    Parameters
    ----------
    laid : NamedReceivers
    days : int
    least : float
        Hours of sun that the share has at least [h].

    Attributes
    ----------
    share, mean, fewest, most : (n_groups, n_days) float64
        Share of the area with at least so many hours [1]; hours of sun [h].
    first, last : (n_groups, n_days) datetime64[us]
        UTC of the first and last sun anywhere in the group; NaT if none.
    """

    laid: "NamedReceivers"
    days: int
    least: float
    share: NDArray[np.float64] = field(init=False)
    mean: NDArray[np.float64] = field(init=False)
    fewest: NDArray[np.float64] = field(init=False)
    most: NDArray[np.float64] = field(init=False)
    first: NDArray[np.datetime64] = field(init=False)
    last: NDArray[np.datetime64] = field(init=False)

    def __post_init__(self) -> None:
        shape = len(self.laid.records), self.days
        self.share, self.mean = np.zeros((2, *shape))
        self.fewest, self.most = np.full(shape, np.inf), np.full(shape, -np.inf)
        self.first = np.full(shape, np.datetime64("NaT"), "datetime64[us]")
        self.last = self.first.copy()

    def add(self, intervals: SunIntervalTable, where: Any, day: int) -> None:
        """Add a day of some of the samples."""
        owner, weights = self.laid.owner[where], self.laid.areas[where]
        light = intervals.sun if intervals.light is None else intervals.light
        hours = to_hours(light).astype(np.float64)
        groups, begin = np.unique(owner, return_index=True)
        whole = self.laid.group_areas[groups]
        enough = weights * (hours >= self.least - _SLACK)
        self.share[groups, day] += np.add.reduceat(enough, begin) / whole
        self.mean[groups, day] += np.add.reduceat(weights * hours, begin) / whole
        for figures, values, join in (
            (self.fewest, hours, np.minimum), (self.most, hours, np.maximum),
            (self.first, intervals.first, np.fmin), (self.last, intervals.last, np.fmax),
        ):  # fmt: skip
            figures[groups, day] = join(figures[groups, day], join.reduceat(values, begin))


class _DaySink:
    """
    Stands for the arrays of a result, of which no sample's are kept.

    Parameters
    ----------
    arrays : ResultArrays
        Of the study.
    groups : GroupDays
    """

    def __init__(self, arrays: ResultArrays, groups: GroupDays) -> None:
        self.period, self.results, self.shares = arrays.period, arrays.results, arrays.shares
        self.up_hours_by_day = arrays.up_hours_by_day  # exact intervals write to it, all the same
        self._arrays, self._groups = arrays, groups

    def is_fully_transmissive(self, day: int) -> bool:
        """Return whether canopies transmit all light on a day."""
        return self._arrays.is_fully_transmissive(day)

    def enter_day(self, intervals: SunIntervalTable, up: int, where: Any, day: int | None) -> None:
        """Reduce the sun intervals of one day."""
        if day is not None:
            self._groups.add(intervals, where, day)


class NamedDays(Accumulator):
    """
    Accumulator of figures of groups by date.

    Parameters
    ----------
    arrays : ResultArrays
    laid : NamedReceivers
    least : float
        Hours of sun that the share has at least [h].
    make_inner : callable
        Makes the accumulator of sun intervals, of steps or exact, that writes to arrays.
    """

    def __init__(
        self, arrays: ResultArrays, laid: "NamedReceivers", least: float,
        make_inner: Callable[[Any], DayIntervals],
    ) -> None:  # fmt: skip
        self.groups = GroupDays(laid, len(arrays.period.days), least)
        self._inner = make_inner(_DaySink(arrays, self.groups))

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin a tile."""
        self._inner.begin(run, lights)

    def begin_run(self, lights: Lights, span: slice) -> None:
        """Begin a run of consecutive lights."""
        self._inner.begin_run(lights, span)

    def add(self, lights: Lights, span: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """Add some lights."""
        self._inner.add(lights, span, masks)

    def end_run(self, lights: Lights, span: slice) -> None:
        """End a run of lights."""
        self._inner.end_run(lights, span)

    def end_day(self, day: int) -> None:
        """Reduce a day."""
        self._inner.end_day(day)
