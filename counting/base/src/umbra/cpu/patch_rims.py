"""
Shadow rims on a patch: their crossings with its columns, and the counts between them.

Going up a column, the count changes by a rim's multiplicity where the column crosses it; along the
lowest row, where the rim passes under it. Both use the same numbers, so that rounding leaves no
streaks.
"""

from typing import NamedTuple

import numpy as np

from umbra.kernels import borrowing, inlined

__all__ = ["CROSSINGS", "Crossings", "add_rim", "clear", "find_rim_runs"]

CROSSINGS = 16
"""Crossings per column for which there is room, plus one per row; beyond this, rays are cast."""
_MANY = 24  # crossings of a column from which summing row by row is faster than sorting


class Crossings(NamedTuple):
    """
    Crossings of rims with the columns of a patch.

    Parameters
    ----------
    steps : (columns + 1,) int32
        Change of the count along the lowest row.
    number : (columns + 1,) int32
        Number of crossings of each column.
    cross : (columns * (rows + CROSSINGS),) int64
        First row above each crossing and change of the count, see ``_pack``, column by column.
    doubts : (n,) int64
        Squares within rounding of a rim.
    runs : (n_samples, 3) int64
        Runs of samples with one count: first, end, count.
    level : (rows + 1,) int32
        Changes at each row of a column with many crossings; 0 between uses.
    """

    steps: np.ndarray
    number: np.ndarray
    cross: np.ndarray
    doubts: np.ndarray
    runs: np.ndarray
    level: np.ndarray


@inlined
def _pack(row, change):
    """Pack a row and a change of the count into one number."""
    return row << 32 | (change + 0x80000000)


@inlined
def _unpack(crossing):
    """Unpack a row and a change of the count."""
    return crossing >> 32, (crossing & 0xFFFFFFFF) - 0x80000000


@inlined
def _ceil(x, most):
    return np.int64(np.ceil(min(max(x, 0.0), most)))


@borrowing
def _doubt(c, low, high, rows, doubts, n):
    """List the squares of a column between two heights; return the new number."""
    for r in range(
        _ceil(low, rows * 1.0), np.int64(np.floor(min(max(high, -1.0), rows - 1.0))) + 1
    ):
        if n < doubts.size:
            doubts[n] = c * rows + r
        n += 1
    return n


@inlined
def add_rim(u0, v0, u1, v1, m, bu, bv, cols, rows, crossings, n):
    """
    Add the rim of a shadow.

    Parameters
    ----------
    u0, v0, u1, v1 : float
        Ends of the rim [squares].
    m : int
        Multiplicity: count on its left minus count on its right.
    bu, bv : float
        Error bounds [squares].
    cols, rows : int
    crossings : Crossings
        Written to.
    n : int
        Number of doubtful squares so far.

    Returns
    -------
    changes : int
        Whether the count changes anywhere; -1 if a column has too many crossings.
    n : int
        New number of doubtful squares; those that do not fit are only counted.
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
    if width > 0.0 and u0 <= 0.0 and u1 >= w:  # wholly above or below?
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
            if k == rows + CROSSINGS:
                return -1, n
            number[c] = k + 1
            crossings.cross[c * (rows + CROSSINGS) + k] = _pack(np.int64(r), m)
        over = r - y
        if over < band or over > 1.0 - band:
            n = _doubt(c, y - band, y + band, rows, crossings.doubts, n)
    if 0 < c1 < cols and (v1 <= 0.0) != was_under:
        steps[c1] += m if v1 <= 0.0 else -m
        changes = 1
    # Columns next to its ends.
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


@inlined
def clear(cols, crossings):
    """Clear all crossings."""
    crossings.steps[: cols + 1] = 0
    crossings.number[: cols + 1] = 0


@inlined
def _sort(cross, at, n, rows, level):
    """Sort a column's crossings from index ``at`` on and merge equal rows; return their number."""
    if n > _MANY:
        for q in range(n):
            r, m = _unpack(cross[at + q])
            level[r] += m
        n = 0
        for r in range(rows):
            if level[r] != 0:
                cross[at + n] = _pack(r, level[r])
                level[r] = 0
                n += 1
    else:
        for q in range(1, n):
            one = cross[at + q]
            p = q - 1
            while p >= 0 and cross[at + p] > one:
                cross[at + p + 1] = cross[at + p]
                p -= 1
            cross[at + p + 1] = one
    return n


@inlined
def find_rim_runs(cols, rows, before, cell, crossings):
    """
    List the runs of samples with one count, up to a constant; clear the crossings.

    Parameters
    ----------
    cols, rows : int
    before : (entries,) int32
        Number of samples before each square, from entry ``cell`` on.
    cell : int
    crossings : Crossings
        Its ``runs`` are written.

    Returns
    -------
    n : int
    """
    runs, steps, number, cross = crossings.runs, crossings.steps, crossings.number, crossings.cross
    n = -1
    base = 0
    here = 0  # count of the current run
    first = 0
    for c in range(cols):
        base += steps[c]
        steps[c] = 0
        k = number[c]
        number[c] = 0
        if k == 0 and base == here and n >= 0:
            continue  # the run continues through the column
        at = cell + c * rows
        held = c * (rows + CROSSINGS)
        k = _sort(cross, held, k, rows, crossings.level)
        count = base
        first = before[at]
        for q in range(k + 1):
            r, m = rows, 0
            if q < k:
                r, m = _unpack(cross[held + q])
            end = before[at + r]
            if end > first and (n < 0 or count != here):
                if n >= 0:
                    runs[n, 1] = first
                n += 1
                runs[n, 0] = first
                runs[n, 2] = here = count
            first = max(first, end)
            count += m
    steps[cols] = 0
    runs[n, 1] = before[cell + cols * rows]
    return n + 1
