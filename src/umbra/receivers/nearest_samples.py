"""The nearest samples to places on surfaces, so that each place shows what was counted by it."""

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.receivers.surface_samples import Samples

__all__ = ["find_nearest"]


def find_nearest(
    samples: Samples,
    points: NDArray[np.float64],
    surface: NDArray[np.intp],
    preferred: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """
    Find the sample nearest to each point among those of the point's surface.

    Parameters
    ----------
    samples : Samples
    points : (n, 3) float64
        In the scene's local frame [m].
    surface : (n,) int
        Surface on which each lies; -1 for none.
    preferred : (m,) bool
        Samples to choose from, where a surface has any of them.

    Returns
    -------
    nearest : (n,) int64
        Index of the sample; -1 for points on no surface.
    """
    square = np.zeros((samples.count, 2), np.int64)
    _find_squares(
        samples.points, samples.surface, samples.axes, samples.start, samples.spacing, square
    )
    order = np.lexsort((square[:, 0], square[:, 1], samples.surface))
    has_any = np.bincount(samples.surface, preferred, len(samples.part)) > 0
    order = order[(preferred | ~has_any[samples.surface])[order]]
    first = np.searchsorted(samples.surface[order], np.arange(len(samples.part) + 1))
    nearest = np.full(len(points), -1)
    _find(
        points, surface, first, order, square[order], samples.axes, samples.start,
        samples.spacing, nearest,
    )  # fmt: skip
    return nearest


@kernel
def _find_squares(points, surface, axes, start, spacing, square):
    """Find the column and row of the square that holds each sample."""
    for i in range(surface.size):
        for k in range(2):
            position = _locate(points[i], surface[i], axes, start, spacing, k)
            square[i, k] = np.int64(np.rint(position))


@kernel
def _locate(point, surface, axes, start, spacing, k):
    """Return a point's place along a surface's axis [squares]."""
    along = -start[surface, k]
    for q in range(3):
        along += point[q] * axes[surface, k, q]
    return along / spacing


@kernel
def _find(points, surface, first, order, square, axes, start, spacing, nearest):
    """Search row after row away from each point, until no row can hold a nearer sample."""
    for i in range(surface.size):
        s = surface[i]
        if s < 0:
            continue
        begin, end = first[s], first[s + 1]
        u = _locate(points[i], s, axes, start, spacing, 0)
        v = _locate(points[i], s, axes, start, spacing, 1)
        col, lowest, highest = np.int64(np.rint(u)), square[begin, 1], square[end - 1, 1]
        row = min(max(np.int64(np.rint(v)), lowest), highest)
        best, least = begin, np.inf
        away = 0
        while row - away >= lowest or row + away <= highest:
            is_near = False
            for side in range(1 if away == 0 else 2):
                r = row + away if side == 0 else row - away
                if r < lowest or r > highest or (r - v) ** 2 >= least:
                    continue
                is_near = True
                k = _bisect(square, begin, end, r, col)
                for m in (k - 1, k):  # the row's last before this column, and its first from there
                    if m < begin or m >= end or square[m, 1] != r:
                        continue
                    far = (square[m, 0] - u) ** 2 + (r - v) ** 2
                    if far < least:
                        best, least = m, far
            if not is_near:
                break
            away += 1
        nearest[i] = order[best]


@kernel
def _bisect(square, begin, end, row, col):
    """Return the first of some samples, sorted by row and column, that is not before a square."""
    while begin < end:
        middle = (begin + end) // 2
        if square[middle, 1] < row or (square[middle, 1] == row and square[middle, 0] < col):
            begin = middle + 1
        else:
            end = middle
    return begin
