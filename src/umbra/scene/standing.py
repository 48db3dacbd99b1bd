"""Which things stand on nothing else: not a roof on its walls, nor a floor on another."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["find_standing"]

_CELL = 2.0  # things that share a cell may stand on one another [m]
_MOST = 1024  # cells along a side


def find_standing(boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """
    Find the things that have no other below them.

    Parameters
    ----------
    boxes : (n, 2, 3) float64
        Lowest and highest corner of each thing [m].

    Returns
    -------
    stands : (n,) bool
    """
    if not len(boxes):
        return np.zeros(0, np.bool_)
    low, high = boxes[:, 0], boxes[:, 1]
    start = low[:, :2].min(0)
    cell = max(_CELL, float((high[:, :2].max(0) - start).max()) / _MOST)
    first = ((low[:, :2] - start) / cell).astype(np.intp)
    last = ((high[:, :2] - start) / cell).astype(np.intp) + 1
    lowest = np.full(tuple(last.max(0)), np.inf)
    windows = [(slice(a, c), slice(b, d)) for (a, b), (c, d) in zip(first, last)]
    for window, z in zip(windows, low[:, 2]):
        np.minimum(lowest[window], z, out=lowest[window])
    return np.array([lowest[w].min() > z - 1.0 for w, z in zip(windows, low[:, 2])], np.bool_)
