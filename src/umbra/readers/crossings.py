"""How often the edges of a polygon cross, as far as that decides what is done with it."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["is_tangled"]

TESTS = 500  # pairs of edges for each edge that are looked at


def is_tangled(points: NDArray[np.float64], following: NDArray[np.int64]) -> bool:
    """
    Tell whether edges cross or touch more than half as often as there are corners.

    Parameters
    ----------
    points : (n, 2) float64
        Corners of all rings.
    following : (n,) int64
        The next corner in each corner's ring.

    Returns
    -------
    is_tangled : bool
        Also true where too many pairs of edges are near each other to tell.
    """
    ends = np.stack([points, points[following]])
    low, high = ends.min(0), ends.max(0)
    # Along the axis on which edges overlap less.
    axis = int((high - low).sum(0).argmin())
    order = np.argsort(low[:, axis], kind="stable")
    return bool(_count(points, following, low, high, order, axis, len(points) // 2 + 20))


@njit(cache=True)
def _count(points, following, low, high, order, axis, most):
    n = len(order)
    crossings = tests = 0
    for i in range(n):
        a = order[i]
        b = following[a]
        for j in range(i + 1, n):
            c = order[j]
            if low[c, axis] > high[a, axis]:
                break
            tests += 1
            if tests > TESTS * n:
                return True
            if low[c, 1 - axis] > high[a, 1 - axis] or high[c, 1 - axis] < low[a, 1 - axis]:
                continue
            d = following[c]
            if c in (a, b) or d in (a, b):
                continue
            one = _side(points, a, b, c) * _side(points, a, b, d)
            other = _side(points, c, d, a) * _side(points, c, d, b)
            if one <= 0 and other <= 0:
                crossings += 1
                if crossings > most:
                    return True
    return False


@njit(cache=True)
def _side(points, a, b, c):
    turn = (points[b, 0] - points[a, 0]) * (points[c, 1] - points[a, 1]) - (
        points[b, 1] - points[a, 1]
    ) * (points[c, 0] - points[a, 0])
    return np.sign(turn)
