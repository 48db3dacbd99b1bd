"""Shadow counts of many suns on one raster: batches, widening, and code shared by both sweeps."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.scene.grid import Grid
from umbra.volume.adjacency import Caster
from umbra.volume.silhouette import Silhouettes, find_silhouettes

__all__ = ["Sweep", "bound_counts"]


@borrowing
def bound_counts(load):
    """Bound all counts by ``load``, what begins (+) and ends (-) at each row or column."""
    deepest = held = 0
    for i in range(load.size):
        held += load[i]
        deepest = max(deepest, held)
    return deepest


@partial(kernel, boundscheck=False)
def _empty_into(sums, out, weight, taken):
    """Add ``weight`` times each thread's ``out`` to ``sums``, and reset ``out`` to 0."""
    while True:
        r = take_next(taken)
        if r >= sums.shape[1]:
            return
        for t in range(out.shape[0]):
            for k in range(sums.shape[0]):
                for c in range(sums.shape[2]):
                    sums[k, r, c] += weight * np.int32(out[t, k, r, c])
                    out[t, k, r, c] = 0


class Sweep(ABC):
    """
    Counter of the shadows of many suns on one raster.

    Parameters
    ----------
    caster : Caster
    grid : Grid
        In the caster's frame.
    threads : int
    """

    narrow: ClassVar[type[np.signedinteger]]
    """Type of a sun's counts before summation, where they fit."""

    def __init__(self, caster: Caster, grid: Grid, threads: int = 1) -> None:
        self.caster, self.grid, self.threads = caster, grid, threads
        self.asked = caster
        self._buffers: dict[tuple, NDArray] = {}

    def add_weights(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """
        Add to each cell the weights of the suns that leave it in shadow.

        Parameters
        ----------
        suns : (n, 3) float64
            Directions toward the sun, above the horizon.
        weights : (n, k) int32
        sums : (k, rows, cols) int32
            Added to.
        progress : callable
            Called now and then with the number of suns done.
        """
        if not len(suns):
            return
        weight = np.int32(1)
        if weights.shape[1] == 1 and (weights == weights[0]).all():
            # Numbers of suns take a quarter of the memory; a batch has at most 64.
            weight, weights = weights[0, 0], np.ones(weights.shape, np.uint8)
        shape = (self.threads, *sums.shape)
        at_once = max(8 * self.threads, 16)
        for which, silhouettes in self._batches(suns):
            group, group_weights = suns[which], np.ascontiguousarray(weights[which])
            out = self._buffer("out", shape, weights.dtype.type)
            for first in range(0, len(group), at_once):
                batch = np.arange(first, min(first + at_once, len(group)))
                self._count(
                    silhouettes, group, batch, group_weights, out, np.zeros((0, 1, 1), np.int32)
                )
                progress(len(batch))
            run_shared(sums.shape[1], _empty_into, sums, out, weight)

    def masks(
        self, suns: NDArray[np.float64], progress: Callable[[int], object] = lambda _: None
    ) -> NDArray[np.uint8]:
        """
        Return the cells in cast or attached shadow for each sun.

        Parameters
        ----------
        suns : (n, 3) float64
        progress : callable

        Returns
        -------
        masks : (n, rows, cols) uint8
            0 or 1.
        """
        masks = np.zeros((len(suns), self.grid.rows, self.grid.cols), np.uint8)
        for first in range(0, len(suns), 8):
            batch = suns[first : first + 8]
            np.not_equal(self.counts(batch), 0, out=masks[first : first + 8].view(np.bool_))
            self._attach(batch, masks[first : first + 8])
            progress(len(batch))
        return masks

    def counts(self, suns: NDArray[np.float64]) -> NDArray[np.int32]:
        """
        Return the shadow count of every cell for every sun.

        Parameters
        ----------
        suns : (n, 3) float64

        Returns
        -------
        counts : (n, rows, cols) int32
        """
        counts = np.zeros((len(suns), self.grid.rows, self.grid.cols), np.int32)
        for which, silhouettes in self._batches(suns):
            group = suns[which]
            none, nothing = np.zeros((len(group), 1), np.uint8), np.zeros((1, 1, 1, 1), np.uint8)
            self._count(silhouettes, group, np.arange(len(group)), none, nothing, counts[which])
        return counts

    def _batches(self, suns: NDArray[np.float64]) -> Iterator[tuple[slice, Silhouettes]]:
        use_threads(self.threads)
        return find_silhouettes(self.asked, np.append(suns, np.zeros((len(suns), 1)), 1))

    def _count(
        self,
        silhouettes: Silhouettes,
        suns: NDArray[np.float64],
        which: NDArray[np.int64],
        weights: NDArray,
        out: NDArray,
        counts: NDArray,
    ) -> None:
        # Suns whose counts might overflow the narrow type are counted again in int32.
        deep = self._run(silhouettes, suns, which, weights, out, counts, self.narrow)
        if deep.any():
            self._run(silhouettes, suns, np.flatnonzero(deep), weights, out, counts, np.int32)

    def _attach(self, suns: NDArray[np.float64], masks: NDArray[np.uint8]) -> None:  # noqa: B027
        """Add attached shadow (surfaces facing away from the sun); a horizontal plane has none."""

    @abstractmethod
    def _run(
        self,
        silhouettes: Silhouettes,
        suns: NDArray[np.float64],
        which: NDArray[np.int64],
        weights: NDArray,
        out: NDArray,
        counts: NDArray,
        count_type: type,
    ) -> NDArray[np.bool_]:
        """Count some suns; return the suns whose counts might overflow (left out)."""

    def _buffer(
        self, name: str, shape: tuple[int, ...], dtype: type, owner: type | None = None
    ) -> NDArray:
        """Return a work array that the next batch reuses, of one ``owner``; it starts at 0."""
        key = (name, shape, dtype, owner)
        if key not in self._buffers:
            self._buffers[key] = np.zeros(shape, dtype)
        return self._buffers[key]
