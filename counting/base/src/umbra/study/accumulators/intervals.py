"""
Sun intervals: first and last sun, number, and longest.

Instants come in time order, and each receiver keeps seven numbers. A step [start, end) is
judged at its midpoint, so intervals begin and end with steps; ``exact.py`` solves their
ends. An interval also ends with its day's period and at sunset.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel, run_shared, take_next

__all__ = [
    "BEGAN",
    "BLOCK",
    "NEVER",
    "IntervalState",
    "SunIntervalTable",
    "end_interval",
    "join_days",
    "to_hours",
]

BEGAN, TOTAL, LONGEST, COUNTED, INTERVALS, FIRST, LAST = range(7)
NEVER = np.iinfo(np.int64).min
"""No instant: NaT as an integer."""
BLOCK = 4096
"""Receivers per thread and block."""
_HOUR = 3.6e9  # [us]


@dataclass(frozen=True, eq=False)
class SunIntervalTable:
    """
    Sun intervals of each receiver.

    Parameters
    ----------
    sun : (...) int64
        Time in the sun [us].
    first, last : (...) datetime64[us]
        UTC start of the first interval and end of the last; NaT if none.
    count : (...) int32
    longest : (...) int64
        Longest unbroken interval [us].
    counted : (...) int64
        Time in intervals of at least the required length [us].
    behind : (...) int64, optional
        Time behind canopies alone, outside all intervals [us].
    light : (...) float64, optional
        With canopies: ``sun`` plus the transmitted share of ``behind`` [us].
    """

    sun: NDArray[np.int64]
    first: NDArray[np.datetime64]
    last: NDArray[np.datetime64]
    count: NDArray[np.int32]
    longest: NDArray[np.int64]
    counted: NDArray[np.int64]
    behind: NDArray[np.int64] | None = None
    light: NDArray[np.float64] | None = None

    def add_behind(self, behind: NDArray[np.int64], share: float) -> "SunIntervalTable":
        """
        Return a copy with the time behind canopies that transmit a share of the light.

        With a share of 1 intervals include this time already, as without canopies.
        """
        light = self.sun + (share * behind if share < 1 else 0.0)
        return replace(self, behind=behind, light=light)


def join_days(days: list[SunIntervalTable]) -> SunIntervalTable:
    """Join the sun intervals of several days, in order, in one table."""
    first, last = days[0].first.copy(), days[0].last.copy()
    for day in days[1:]:
        # fmin and fmax skip NaT.
        first, last = np.fmin(first, day.first), np.fmax(last, day.last)
    return SunIntervalTable(
        np.sum([day.sun for day in days], axis=0),
        first,
        last,
        np.sum([day.count for day in days], axis=0, dtype=np.int32),
        np.max([day.longest for day in days], axis=0),
        np.sum([day.counted for day in days], axis=0),
        _sum([day.behind for day in days]),
        _sum([day.light for day in days]),
    )


def _sum(arrays: list[Any]) -> Any:
    return None if any(array is None for array in arrays) else np.sum(arrays, axis=0)


class IntervalState:
    """
    Running sun intervals of one day.

    Parameters
    ----------
    shape : tuple of int
        Of the receivers.
    least : int
        Least length of an interval that counts as long [us].
    """

    def __init__(self, shape: tuple[int, ...], least: int = 0) -> None:
        self.shape, self.least = shape, least
        cells = int(np.prod(shape, dtype=np.int64))
        self.state = np.zeros((7, cells), np.int64)
        self._blocks = -(-cells // BLOCK)
        self.state[[BEGAN, FIRST, LAST]] = NEVER
        self.until = NEVER  # end of the last step

    def add_steps(
        self, masks: NDArray[np.uint8], starts: NDArray[np.int64], ends: NDArray[np.int64]
    ) -> None:
        """
        Add steps with the sun up, later than all before.

        Parameters
        ----------
        masks : (n, ...) uint8
            1 where in shadow at the midpoint.
        starts, ends : (n,) int64
            UTC [us since 1970].
        """
        before = np.append(self.until, ends[:-1])
        given = masks.reshape(len(masks), -1), starts, before, self.least, self.state
        run_shared(self._blocks, _add_steps, *given)
        self.until = int(ends[-1])

    def end_all(self, at: int) -> None:
        """Close all open intervals at an instant [us since 1970]."""
        run_shared(self._blocks, _end_all, at, self.least, self.state)

    def finish(self) -> SunIntervalTable:
        """Close all open intervals, and return the table."""
        if self.until != NEVER:
            self.end_all(self.until)

        def shaped(row: int) -> NDArray[np.int64]:
            return self.state[row].reshape(self.shape)

        return SunIntervalTable(
            shaped(TOTAL),
            shaped(FIRST).view("datetime64[us]"),
            shaped(LAST).view("datetime64[us]"),
            shaped(INTERVALS).astype(np.int32),
            shaped(LONGEST),
            shaped(COUNTED),
        )


def to_hours(duration: NDArray) -> NDArray[np.float32]:
    """Return microseconds as hours, float32."""
    return (duration / _HOUR).astype(np.float32)


@partial(kernel, inline="always")
def end_interval(state, c, at, least):
    """Close a receiver's sun interval, which began at ``state[BEGAN, c]``."""
    length = at - state[BEGAN, c]
    if length > 0:
        if state[FIRST, c] == NEVER:
            state[FIRST, c] = state[BEGAN, c]
        state[TOTAL, c] += length
        state[LONGEST, c] = max(state[LONGEST, c], length)
        if length >= least:
            state[COUNTED, c] += length
        state[INTERVALS, c] += 1
        state[LAST, c] = at
    state[BEGAN, c] = NEVER


@partial(kernel, boundscheck=False)
def _add_steps(masks, starts, before, least, state, taken):
    """Add steps to every receiver; ``before`` holds the end of the step before each."""
    cells = masks.shape[1]
    while True:
        block = take_next(taken)
        if block >= (cells + BLOCK - 1) // BLOCK:
            return
        for c in range(block * BLOCK, min(cells, (block + 1) * BLOCK)):
            for s in range(masks.shape[0]):
                is_on = state[BEGAN, c] != NEVER
                if is_on and before[s] != starts[s]:  # the sun was down in between
                    end_interval(state, c, before[s], least)
                    is_on = False
                if masks[s, c] == 0 and not is_on:
                    state[BEGAN, c] = starts[s]
                elif masks[s, c] != 0 and is_on:
                    end_interval(state, c, starts[s], least)


@partial(kernel, boundscheck=False)
def _end_all(at, least, state, taken):
    cells = state.shape[1]
    while True:
        block = take_next(taken)
        if block >= (cells + BLOCK - 1) // BLOCK:
            return
        for c in range(block * BLOCK, min(cells, (block + 1) * BLOCK)):
            if state[BEGAN, c] != NEVER:
                end_interval(state, c, at, least)
