"""Sweeping many suns over one receiver: batches, widening, and what is shared by both kinds."""

from collections.abc import Callable

import numba
import numpy as np
from numpy.typing import NDArray

from umbra.scene.grid import Grid
from umbra.volume.adjacency import Caster
from umbra.volume.silhouette import Silhouettes, find_silhouettes

__all__ = ["MOST", "Sweep"]

MOST = 32_767
"""The deepest count that int16 holds; a sun that might exceed it is counted anew in int32."""


class Sweep:
    """
    Count the shadows of many suns on one raster.

    Parameters
    ----------
    caster : Caster
    grid : Grid
        In the caster's frame.
    threads : int
    """

    def __init__(self, caster: Caster, grid: Grid, threads: int = 1) -> None:
        self.caster, self.grid, self.threads = caster, grid, threads
        self._buffers: dict[tuple, NDArray] = {}

    def add_steps(
        self,
        suns: NDArray[np.float64],
        steps: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """
        Count for each cell how many suns leave it in shadow.

        Parameters
        ----------
        suns : (n, 3) float64
            Directions toward the sun, above the horizon.
        steps : (rows, cols) int32
            Added to.
        progress : callable
            Called with the number of suns done, now and then.
        """
        shape = (self.threads, *steps.shape)
        for which, found in self._batches(suns):
            out = self._buffer("out", shape, np.uint8)  # a batch has at most 64 suns
            out[:] = 0
            self._count(found, suns[which], out, np.zeros((0, 1, 1), np.int32))
            for part in out:
                steps += part
            progress(which.stop - which.start)

    def counts(self, suns: NDArray[np.float64]) -> NDArray[np.int32]:
        """
        Give the shadow count of every cell for every sun.

        Parameters
        ----------
        suns : (n, 3) float64

        Returns
        -------
        counts : (n, rows, cols) int32
        """
        counts = np.zeros((len(suns), self.grid.rows, self.grid.cols), np.int32)
        nothing = np.zeros((self.threads, 1, 1), np.uint8)
        for which, found in self._batches(suns):
            self._count(found, suns[which], nothing, counts[which])
        return counts

    def _batches(self, suns: NDArray[np.float64]):
        numba.set_num_threads(self.threads)
        return find_silhouettes(self.caster, np.append(suns, np.zeros((len(suns), 1)), 1))

    def _count(
        self, found: Silhouettes, suns: NDArray[np.float64], out: NDArray, counts: NDArray
    ) -> None:
        deep = self._run(found, suns, np.arange(len(suns)), out, counts, np.int16)
        if deep.any():
            self._run(found, suns, np.flatnonzero(deep), out, counts, np.int32)

    def _run(
        self,
        found: Silhouettes,
        suns: NDArray[np.float64],
        which: NDArray[np.int64],
        out: NDArray,
        counts: NDArray,
        count_type: type,
    ) -> NDArray[np.bool_]:
        """Count some suns; tell of which the counts might not fit (those are left out)."""
        raise NotImplementedError

    def _buffer(self, name: str, shape: tuple[int, ...], dtype: type) -> NDArray:
        """Give a work array that is kept for the next batch; it starts at 0."""
        key = (name, shape, dtype)
        if key not in self._buffers:
            self._buffers[key] = np.zeros(shape, dtype)
        return self._buffers[key]
