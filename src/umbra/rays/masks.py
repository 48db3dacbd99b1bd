"""Masks of lights, added up with weights."""

from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["CounterByMasks", "add_masks"]


def add_masks(
    find: Callable[[NDArray[np.float64]], NDArray[np.uint8]],
    lights: NDArray[np.float64],
    weights: NDArray[np.int32],
    sums: NDArray[np.int32],
    progress: Callable[[int], object] = lambda _: None,
    *,
    at_once: int = 1,
) -> None:
    """
    Add to each receiver the weights of the lights that leave it in shadow, mask by mask.

    Parameters
    ----------
    find : callable
        Returns for each of some lights the receivers in shadow, (n, ...) uint8.
    lights : (n, 3) or (n, 4) float64
    weights : (n, k) int32
    sums : (k, ...) int32
        Added to.
    progress : callable
        Called with the number of lights done.
    at_once : int
        Lights whose masks are held at a time.
    """
    for first in range(0, len(lights), at_once):
        batch = slice(first, first + at_once)
        masks = find(lights[batch])
        for mask, row in zip(masks, weights[batch], strict=True):
            for k in np.flatnonzero(row):
                sums[k] += row[k] * mask
        progress(len(masks))


class CounterByMasks:
    """
    Base of counters that find masks of receivers: weights are added mask by mask.

    Attributes
    ----------
    at_once : int
        Lights whose masks are held at a time.
    """

    at_once: ClassVar[int] = 1

    @abstractmethod
    def masks(self, lights: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each light the receivers in shadow, cast or attached, (n, ...) uint8."""

    def add_weights(
        self,
        lights: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each receiver the weights (n, k) of the lights that leave it in shadow."""
        add_masks(self.masks, lights, weights, sums, progress, at_once=self.at_once)
