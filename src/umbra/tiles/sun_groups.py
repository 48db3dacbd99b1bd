"""
Counter of a window for many suns: those of each height with the casters that they need.

A low sun's shadows come from afar; few suns are low. If all casters that reach a window at any time
were counted for every sun, most of a year's work would be for casters whose shadows end far away.
"""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights
from umbra.receivers.kind import Counter

__all__ = ["SunGroups", "group_lights", "group_suns"]

_EDGES = np.sin(np.radians([0.5, 1, 2, 4, 8, 15, 30]))
LEAST = 128
"""Suns of a group: casters are prepared in the time in which some 100 suns are counted."""


class SunGroups:
    """
    Counter that prepares casters anew for each group of suns, one group after the other.

    Parameters
    ----------
    make : callable
        Returns the counter of the casters that can reach the receivers from some suns (n, 3).
    """

    def __init__(self, make: Callable[[NDArray[np.float64]], Counter]) -> None:
        self._make = make

    def add_weights(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each receiver the weights (n, k) of the suns that leave it in shadow."""
        for some in group_suns(suns):
            self._make(suns[some]).add_weights(suns[some], weights[some], sums, progress)

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each sun the receivers in shadow, cast or attached."""
        return self._make(suns).masks(suns)


def group_lights(lights: Lights) -> Iterator[NDArray[np.intp]]:
    """Yield the indices of lights: those of suns of similar height, then all others."""
    suns = np.flatnonzero(lights.are_suns)
    for some in group_suns(lights.vectors[suns, :3]):
        yield suns[some]
    others = np.flatnonzero(~lights.are_suns)
    if len(others):
        yield others


def group_suns(suns: NDArray[np.float64]) -> Iterator[NDArray[np.intp]]:
    """Yield the indices of suns (n, 3) of similar height, ``LEAST`` or more if there are enough."""
    band = np.searchsorted(_EDGES, suns[:, 2])
    counts = np.bincount(band, minlength=len(_EDGES) + 1)
    first = 0
    for last in range(len(counts)):
        left = counts[last + 1 :].sum()
        if last == len(counts) - 1 or (counts[first : last + 1].sum() >= LEAST <= left):
            some = np.flatnonzero((band >= first) & (band <= last))
            if len(some):
                yield some
            first = last + 1
