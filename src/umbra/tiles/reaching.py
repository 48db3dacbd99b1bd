"""Counter of a city's tile whose casters follow the lights that it is asked to count."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.kind import Counter, Tile
from umbra.study.counters import LightCounter

__all__ = ["ReachingCounter"]


class ReachingCounter(LightCounter):
    """
    Counter of any lights, with all casters that can hide them.

    Parameters
    ----------
    tile : Tile
        With the casters that the study's lights need.
    counter : Counter or None
        Of these lights, if not the tile's own.
    known : (n, 4) float64
        The study's lights.
    find_tile : callable
        Returns the tile with the casters that other lights need, (n, 3) or (n, 4).
    """

    def __init__(
        self,
        tile: Tile,
        counter: Counter | None,
        known: NDArray[np.float64],
        find_tile: Callable[[NDArray[np.float64]], Tile],
    ) -> None:
        super().__init__(tile, counter)
        self._known = {row.tobytes() for row in known}
        self._find_tile = find_tile

    def masks(self, lights: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each light, (n, 3) suns or (n, 4) any, the receivers in shadow."""
        if self._knows(lights):
            return super().masks(lights)
        return LightCounter(self._find_tile(lights)).masks(lights)

    def add_weights(
        self,
        lights: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each receiver the weights (n, k) of the lights that leave it in shadow."""
        if self._knows(lights):
            super().add_weights(lights, weights, sums, progress)
        else:
            tile = self._find_tile(lights)
            LightCounter(tile).add_weights(lights, weights, sums, progress)

    def _knows(self, lights: NDArray[np.float64]) -> bool:
        whole = np.zeros((len(lights), 4))
        whole[:, : lights.shape[1]] = lights
        return all(row.tobytes() in self._known for row in whole)
