"""Hours in shadow, added up: of the whole period, and of each day where that is asked for."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from umbra.study.accumulators.arrays import ResultArrays
from umbra.study.lights import Lights
from umbra.study.loop import Accumulator, TileRun, add_up

__all__ = ["HourSums"]


class HourSums(Accumulator):
    """
    Adds up hours, in whatever order.

    A canopy is a second set of casters: what it alone hides counts by the share that it keeps
    back on the day.

    Parameters
    ----------
    arrays : ResultArrays
        Written to.
    """

    is_streamed = False

    def __init__(self, arrays: ResultArrays) -> None:
        self.arrays = arrays

    def add_sums(self, run: TileRun, lights: Lights, progress: Callable[[int], object]) -> None:
        """Add the hours up, a column for each day or for each share of light let through."""
        arrays, where = self.arrays, run.where
        day = arrays.period.day_of_step[lights.step]
        if arrays.has_days:
            column, shares = day, arrays.shares
            count = len(arrays.period.days)
        else:
            kept = np.zeros(1) if arrays.shares is None else arrays.shares[day]
            shares, column = np.unique(kept, return_inverse=True)
            count, column = len(shares), np.broadcast_to(column.ravel(), len(lights))
        weights = np.zeros((len(lights), count))
        weights[np.arange(len(lights)), column] = lights.weights[:, 0]
        lights = lights.weigh(weights, tuple(map(str, range(count))))
        hours = add_up(run.counters[0], run.shape, lights, progress)
        behind = np.zeros((0, *run.shape), np.float32)
        if len(run.counters) > 1 and shares is not None:
            dark = add_up(run.counters[1], run.shape, lights)
            behind = hours - dark
            for k, share in enumerate(shares):
                hours[k] = dark[k] + np.float32(1 - share) * behind[k]
        if arrays.has_days:
            for k, one in enumerate(hours):
                arrays.keep_hours(one, where, k)
            for k, one in enumerate(behind):
                arrays.keep_behind(one, where, k)
        kind = np.float64 if arrays.has_days else np.float32
        arrays.keep_hours(_sum(hours, kind), where)
        if len(behind):
            arrays.keep_behind(_sum(behind, kind), where)


def _sum(columns: NDArray[np.float32], kind: type) -> NDArray:
    """Add columns in their order."""
    total: NDArray = np.zeros(columns.shape[1:], kind)
    for one in columns:
        total += one
    return total
