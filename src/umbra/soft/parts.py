"""
What part of a light an edge takes: Q over the light's area, in closed form.

Q is the light's area within the angle a o b and beyond the line ab, where o = 0 is the
middle of the light and (a, b) the edge on its plane (`umbra.soft.coverage`).
"""

import numpy as np
from numba import njit

__all__ = ["find_disc_part", "find_square_part"]


@njit(cache=True, nogil=True)
def find_disc_part(ax, ay, bx, by):
    """
    Find Q / area for a disc.

    Where the line ab runs inside the disc, between the angles t0 and t1 from its foot
    at the distance d: Q = (atan t1/d - atan t0/d) / 2 - d (t1 - t0) / 2.

    Parameters
    ----------
    ax, ay, bx, by : float
        The edge, in radii about the disc's middle.

    Returns
    -------
    part : float
        From 0 to 1/2.
    """
    wx, wy = bx - ax, by - ay
    length = np.sqrt(wx * wx + wy * wy)
    if length == 0.0:
        return 0.0
    wx /= length
    wy /= length
    d = abs(ax * wy - ay * wx)
    if d >= 1.0:
        return 0.0
    half = np.sqrt(1.0 - d * d)
    t0 = max(ax * wx + ay * wy, -half)
    t1 = min(bx * wx + by * wy, half)
    if t0 >= t1:
        return 0.0
    return 0.5 * (np.arctan2(t1, d) - np.arctan2(t0, d) - d * (t1 - t0)) / np.pi


@njit(cache=True, nogil=True)
def _clip(corners, n, fx, fy, f0, out):
    """Keep the part of a convex polygon where fx x + fy y + f0 >= 0; give its corners."""
    kept = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        here = fx * corners[i, 0] + fy * corners[i, 1] + f0
        there = fx * corners[j, 0] + fy * corners[j, 1] + f0
        if here >= 0.0:
            out[kept, 0] = corners[i, 0]
            out[kept, 1] = corners[i, 1]
            kept += 1
        if (here >= 0.0) != (there >= 0.0):
            t = here / (here - there)
            out[kept, 0] = corners[i, 0] + t * (corners[j, 0] - corners[i, 0])
            out[kept, 1] = corners[i, 1] + t * (corners[j, 1] - corners[i, 1])
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def find_square_part(ax, ay, bx, by, one, two):
    """
    Find Q / area for the square [-1, 1]².

    Parameters
    ----------
    ax, ay, bx, by : float
        The edge, about the square's middle.
    one, two : (8, 2) float64
        Room to work in.

    Returns
    -------
    part : float
        From 0 to 1/2.
    """
    cross = ax * by - ay * bx
    if cross == 0.0:
        return 0.0
    side = 1.0 if cross > 0.0 else -1.0
    # Beyond the line: side * ((b - a) x (p - a)) <= 0.
    fx, fy, f0 = side * (by - ay), side * (ax - bx), -side * cross
    if abs(fx) + abs(fy) + f0 <= 0.0:
        return 0.0
    one[0, 0], one[0, 1] = -1.0, -1.0
    one[1, 0], one[1, 1] = 1.0, -1.0
    one[2, 0], one[2, 1] = 1.0, 1.0
    one[3, 0], one[3, 1] = -1.0, 1.0
    n = _clip(one, 4, fx, fy, f0, two)
    n = _clip(two, n, -side * ay, side * ax, 0.0, one)
    n = _clip(one, n, side * by, -side * bx, 0.0, two)
    area = 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        area += two[i, 0] * two[j, 1] - two[i, 1] * two[j, 0]
    return 0.125 * abs(area)
