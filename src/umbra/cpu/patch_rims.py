"""
Rims of shadows on a patch: where they cross its columns, and what that tells of samples.

Going up a column, the count changes by a rim's multiplicity where the column crosses it;
along the lowest row, where the rim passes under it. Both are decided by the same numbers,
so that rounding leaves no streak.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

__all__ = [
    "MEETS",
    "MISSES",
    "Crossings",
    "add_rim",
    "clear",
    "covers",
    "find_runs",
    "meets",
]

MISSES, BESIDE, MEETS = 0, 1, 2
_MANY = 24  # crossings of a column that are sooner added up row by row than sorted


class Crossings(NamedTuple):
    """
    Where rims cross the columns of a patch.

    Parameters
    ----------
    steps : (columns + 1,) int32
        Change of the count along the lowest row.
    number : (columns + 1,) int32
        Crossings of each column.
    row, change : (columns, most) int32
        First row above each, and how the count changes.
    doubts : (n,) int64
        Squares so near to a rim that rounding could tell either way.
    runs : (n_samples, 3) int64
        Stretches of samples with one count: first, end, count.
    level : (rows + 1,) int32
        Changes at each row of a column that is crossed often; 0 between uses.
    """

    steps: np.ndarray
    number: np.ndarray
    row: np.ndarray
    change: np.ndarray
    doubts: np.ndarray
    runs: np.ndarray
    level: np.ndarray


@njit(cache=True, nogil=True, inline="always")
def _ceil(x, most):
    return np.int64(np.ceil(min(max(x, 0.0), most)))


@njit(cache=True, nogil=True)
def _doubt(c, low, high, rows, doubts, n):
    """Note the squares of a column between two heights; give the new number."""
    for r in range(
        _ceil(low, rows * 1.0), np.int64(np.floor(min(max(high, -1.0), rows - 1.0))) + 1
    ):
        if n < doubts.size:
            doubts[n] = c * rows + r
        n += 1
    return n


@njit(cache=True, nogil=True)
def add_rim(u0, v0, u1, v1, m, bu, bv, cols, rows, crossings, n):
    """
    Add the rim of a shadow.

    Parameters
    ----------
    u0, v0, u1, v1 : float
        From here to there [squares].
    m : int
        How much more is to its left.
    bu, bv : float
        How far it can be off [squares].
    cols, rows : int
    crossings : Crossings
        Written to.
    n : int
        Doubts so far.

    Returns
    -------
    changes : int
        Whether the count changes anywhere; -1 if a column has too many crossings.
    n : int
        Doubts by now; more than there is room for are only counted.
    """
    w, h = cols - 1.0, rows - 1.0
    if (v0 > h + bv and v1 > h + bv) or (v0 < -bv and v1 < -bv):
        return 0, n
    if u0 > u1:
        u0, u1, v0, v1, m = u1, u0, v1, v0, -m
    if u1 < -bu or u0 > w + bu:
        return 0, n
    width = u1 - u0
    rise = (v1 - v0) / width if width > 0.0 else 0.0
    if width > 0.0 and u0 <= 0.0 and u1 >= w:  # above or below all of it?
        a = v0 - u0 * rise
        b = a + w * rise
        slack = 2.0 * bv + (2.0 * bu + 1e-9) * (1.0 + abs(rise))
        if max(a, b) < -slack or min(a, b) > h + slack:
            return 0, n
    steps, number = crossings.steps, crossings.number
    c0, c1 = _ceil(u0, cols * 1.0), _ceil(u1, cols * 1.0)
    band = bv + bu * abs(rise)
    changes = 0
    was_under = v0 <= 0.0
    for c in range(c0, c1):
        y = v0 + (c - u0) * rise
        is_under = y <= 0.0
        if is_under != was_under:
            if c > 0:
                steps[c] += m if is_under else -m
                changes = 1
            was_under = is_under
        r = np.ceil(y)
        if r >= 1.0 and r < h + 1.0:
            changes = 1
            k = number[c]
            if k == crossings.row.shape[1]:
                return -1, n
            number[c] = k + 1
            crossings.row[c, k] = np.int32(r)
            crossings.change[c, k] = m
        over = r - y
        if over < band or over > 1.0 - band:
            n = _doubt(c, y - band, y + band, rows, crossings.doubts, n)
    if 0 < c1 < cols and (v1 <= 0.0) != was_under:
        steps[c1] += m if v1 <= 0.0 else -m
        changes = 1
    # Columns just beside its ends.
    low, high = min(v0, v1) - bv, max(v0, v1) + bv
    is_steep = width <= 2.0 * bu
    c = np.rint(u0)
    if abs(c - u0) <= bu and 0.0 <= c < cols:
        a = low if is_steep else max(low, v0 - band)
        b = high if is_steep else min(high, v0 + band)
        n = _doubt(np.int64(c), a, b, rows, crossings.doubts, n)
    c = np.rint(u1)
    if abs(c - u1) <= bu and 0.0 <= c < cols:
        a, b = max(low, v1 - band), min(high, v1 + band)
        n = _doubt(np.int64(c), a, b, rows, crossings.doubts, n)
    return changes, n


@njit(cache=True, nogil=True)
def clear(cols, crossings):
    """Forget all crossings."""
    crossings.steps[: cols + 1] = 0
    crossings.number[: cols + 1] = 0


@njit(cache=True, nogil=True)
def _sort(row, change, n, rows, level):
    """Put the crossings of a column in order; give their number, less where rows are merged."""
    if n > _MANY:
        for q in range(n):
            level[row[q]] += change[q]
        n = 0
        for r in range(rows):
            if level[r] != 0:
                row[n], change[n] = r, level[r]
                level[r] = 0
                n += 1
        return n
    for q in range(1, n):
        r, m = row[q], change[q]
        p = q - 1
        while p >= 0 and row[p] > r:
            row[p + 1], change[p + 1] = row[p], change[p]
            p -= 1
        row[p + 1], change[p + 1] = r, m
    return n


@njit(cache=True, nogil=True)
def find_runs(cols, rows, before, crossings):
    """
    List the stretches of samples with one count, up to a constant; forget the crossings.

    Parameters
    ----------
    cols, rows : int
    before : (cols * rows + 1,) int32
        Samples before each square.
    crossings : Crossings
        Its ``runs`` are written.

    Returns
    -------
    n : int
    """
    runs = crossings.runs
    n = 0
    base = 0
    for c in range(cols):
        base += crossings.steps[c]
        crossings.steps[c] = 0
        k = crossings.number[c]
        crossings.number[c] = 0
        row = crossings.row[c]
        change = crossings.change[c]
        k = _sort(row, change, k, rows, crossings.level)
        count = base
        first = before[c * rows]
        for q in range(k + 1):
            end = before[c * rows + row[q]] if q < k else before[(c + 1) * rows]
            if end > first:
                if n > 0 and runs[n - 1, 2] == count:
                    runs[n - 1, 1] = end  # goes on from the column before
                else:
                    runs[n, 0], runs[n, 1], runs[n, 2] = first, end, count
                    n += 1
                first = end
            if q < k:
                count += change[q]
    crossings.steps[cols] = 0
    return n


@njit(cache=True, nogil=True, inline="always")
def meets(u0, v0, u1, v1, bu, bv, w, h, hull):
    """Tell whether a rim misses the rectangle, lies beside the samples in it, or may meet them."""
    if (
        (v0 > h + bv and v1 > h + bv) or (v0 < -bv and v1 < -bv)
        or (u0 > w + bu and u1 > w + bu) or (u0 < -bu and u1 < -bu)
    ):  # fmt: skip
        return MISSES
    du, dv = u1 - u0, v1 - v0
    a, b = 0.5 * w + bu, 0.5 * h + bv
    slack = 1e-9 * (abs(du) + abs(dv)) * (1.0 + w + h)
    across = dv * (0.5 * (u0 + u1) - 0.5 * w) - du * (0.5 * (v0 + v1) - 0.5 * h)
    if abs(across) > abs(dv) * a + abs(du) * b + slack:
        return MISSES
    b = bu + bv + 1e-6
    if max(u0 + v0, u1 + v1) < hull[0] - b or min(u0 + v0, u1 + v1) > hull[1] + b:
        return BESIDE
    if max(u0 - v0, u1 - v1) < hull[2] - b or min(u0 - v0, u1 - v1) > hull[3] + b:
        return BESIDE
    least, most = np.inf, -np.inf
    for q in range(4, 20, 2):
        side = dv * (hull[q] - u0) - du * (hull[q + 1] - v0)
        least, most = min(least, side), max(most, side)
    far = hull[20] * (abs(du) + abs(dv)) + abs(dv) * bu + abs(du) * bv
    return BESIDE if least > far or most < -far else MEETS


@njit(cache=True, nogil=True)
def covers(face, f, su, sv, w, h, tau, bu, bv):
    """
    Tell whether the shadow of a face holds the whole rectangle of a patch.

    Parameters
    ----------
    face : (9,) float64
        Its corners.
    f : (12,) float64
        The patch's frame.
    su, sv : float
        How far a point's shadow moves for each metre of height [squares].
    w, h, tau, bu, bv : float
    """
    turn = 1.0
    u, v = np.zeros(3), np.zeros(3)
    for k in range(3):
        x, y, z = face[3 * k], face[3 * k + 1], face[3 * k + 2]
        a = f[8] * x + f[9] * y + f[10] * z + f[11]
        if a <= 3.0 * tau:
            return False
        u[k] = f[0] * x + f[1] * y + f[2] * z + f[3] - a * su
        v[k] = f[4] * x + f[5] * y + f[6] * z + f[7] - a * sv
    if (u[1] - u[0]) * (v[2] - v[0]) <= (v[1] - v[0]) * (u[2] - u[0]):
        turn = -1.0
    for k in range(3):
        j = (k + 1) % 3
        eu, ev = turn * (u[j] - u[k]), turn * (v[j] - v[k])
        x = w + bu if ev > 0.0 else -bu  # the corner farthest out
        y = -bv if eu > 0.0 else h + bv
        if eu * (y - v[k]) - ev * (x - u[k]) <= 0.0:
            return False
    return True
