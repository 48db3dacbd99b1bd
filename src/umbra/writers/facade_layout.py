"""Sampled surfaces as small pictures: which sample stands for each square of each surface."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from umbra.receivers.samples import Samples

__all__ = ["FacadeLayout", "lay_out_facades"]

MOST_SQUARES = 4_000_000
"""Of all surfaces together; else squares grow until they fit."""


@dataclass(frozen=True, eq=False)
class FacadeLayout:
    """
    A grid of squares on each surface, and the sample that is shown in each.

    Parameters
    ----------
    side : (n_surfaces,) float64
        Of a surface's squares [m].
    shape : (n_surfaces, 2) int64
        Squares along the surface's horizontal and upward axes.
    first : (n_surfaces,) int64
        Where a surface's squares begin in ``sample``.
    sample : (n_squares,) int64
        Surface after surface, row after row upward; a square without a sample of its own
        shows the nearest one of its surface.
    """

    side: NDArray[np.float64]
    shape: NDArray[np.int64]
    first: NDArray[np.int64]
    sample: NDArray[np.int64]

    @property
    def is_whole(self) -> bool:
        """Whether no square is larger than the samples are apart."""
        return bool((self.side == self.side.min()).all())


def lay_out_facades(samples: Samples, most: int = MOST_SQUARES) -> FacadeLayout:
    """Lay out every surface in its own plane, in at most so many squares altogether."""
    surfaces = len(samples.part)
    times = np.ones(surfaces, np.int64)
    # A ragged surface in a large box takes far more squares than it has samples.
    counts = np.bincount(samples.surface, minlength=surfaces)
    while True:
        shape = -(-samples.cells // times[:, None])
        squares = shape.prod(1)
        if squares.sum() <= most or not (squares > 4).any():
            break
        wide = squares > 16 * counts + 64
        times[wide if wide.any() else squares > 4] *= 2
    first = np.cumsum([0, *squares])[:-1]
    axes = samples.axes[samples.surface]
    flat = np.einsum("nj,nkj->nk", samples.points, axes) - samples.start[samples.surface]
    place = np.rint(flat / samples.spacing).astype(np.int64) // times[samples.surface, None]
    col, row = np.clip(place, 0, shape[samples.surface] - 1).T
    table = np.full(int(squares.sum()), -1, np.int64)
    square = first[samples.surface] + row * shape[samples.surface, 0] + col
    table[square[::-1]] = np.arange(len(samples.points))[::-1]  # of several the first
    empty = np.flatnonzero(table < 0)
    for surface in np.unique(np.searchsorted(first, empty, side="right") - 1):
        some = slice(first[surface], first[surface] + squares[surface])
        own = table[some].reshape(shape[surface, 1], shape[surface, 0])
        nearest = distance_transform_edt(own < 0, return_distances=False, return_indices=True)
        table[some] = own[tuple(nearest)].ravel()
    return FacadeLayout(times * np.float64(samples.spacing), shape, first, table)
