"""
Shadow rims on a patch: their crossings with its columns, and the counts between them.

Going up a column, the count changes by a rim's multiplicity where the column crosses it; along the
lowest row, where the rim passes under it. Both use the same numbers, so that rounding leaves no
streaks.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from umbra.cpu.patch_bins import clamp
from umbra.cpu.patch_cuts import cut_edge
from umbra.kernels import borrowing, inlined
from umbra.rays.hidden import get
from umbra.rays.lanes import LANES, find_lowest, meet_rectangles

__all__ = ["Crossings", "add_rim", "clear", "find_rims", "find_runs"]

_MISSES, _BESIDE, _MEETS = 0, 1, 2
_EDGE_ON = 1e-9  # sine of the sun over a face that passes through a patch
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
    cross : (columns, most) int64
        First row above each crossing and change of the count: see ``_pack``.
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


@njit(cache=True, nogil=True, inline="always")
def _pack(row, change):
    """Pack a row and a change of the count into one number."""
    return row << 32 | (change + 0x80000000)


@njit(cache=True, nogil=True, inline="always")
def _unpack(crossing):
    """Unpack a row and a change of the count."""
    return crossing >> 32, (crossing & 0xFFFFFFFF) - 0x80000000


@njit(cache=True, nogil=True, inline="always")
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
            if k == crossings.cross.shape[1]:
                return -1, n
            number[c] = k + 1
            crossings.cross[c, k] = _pack(np.int64(r), m)
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
def _sort(cross, c, n, rows, level):
    """Sort the crossings of a column and merge equal rows; return their number."""
    if n > _MANY:
        for q in range(n):
            r, m = _unpack(cross[c, q])
            level[r] += m
        n = 0
        for r in range(rows):
            if level[r] != 0:
                cross[c, n] = _pack(r, level[r])
                level[r] = 0
                n += 1
    else:
        for q in range(1, n):
            one = cross[c, q]
            p = q - 1
            while p >= 0 and cross[c, p] > one:
                cross[c, p + 1] = cross[c, p]
                p -= 1
            cross[c, p + 1] = one
    return n


@inlined
def find_runs(cols, rows, before, cell, crossings):
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
        k = _sort(cross, c, k, rows, crossings.level)
        count = base
        first = before[at]
        for q in range(k + 1):
            r, m = rows, 0
            if q < k:
                r, m = _unpack(cross[c, q])
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


@inlined
def _meets(u0, v0, u1, v1, bu, bv, w, h, hull, i):
    """Classify a rim: outside the rectangle, clear of its samples, or possibly across them."""
    if (
        (v0 > h + bv and v1 > h + bv) or (v0 < -bv and v1 < -bv)
        or (u0 > w + bu and u1 > w + bu) or (u0 < -bu and u1 < -bu)
    ):  # fmt: skip
        return _MISSES
    du, dv = u1 - u0, v1 - v0
    a, b = 0.5 * w + bu, 0.5 * h + bv
    slack = 1e-9 * (abs(du) + abs(dv)) * (1.0 + w + h)
    across = dv * (0.5 * (u0 + u1) - 0.5 * w) - du * (0.5 * (v0 + v1) - 0.5 * h)
    if abs(across) > abs(dv) * a + abs(du) * b + slack:
        return _MISSES
    b = bu + bv + 1e-6
    if max(u0 + v0, u1 + v1) < hull[i, 0] - b or min(u0 + v0, u1 + v1) > hull[i, 1] + b:
        return _BESIDE
    if max(u0 - v0, u1 - v1) < hull[i, 2] - b or min(u0 - v0, u1 - v1) > hull[i, 3] + b:
        return _BESIDE
    least, most = np.inf, -np.inf
    for q in range(4, 20, 2):
        side = dv * (hull[i, q] - u0) - du * (hull[i, q + 1] - v0)
        least, most = min(least, side), max(most, side)
    far = hull[i, 20] * (abs(du) + abs(dv)) + abs(dv) * bu + abs(du) * bv
    return _BESIDE if least > far or most < -far else _MEETS


@njit(cache=True, nogil=True, inline="always")
def _four(rows, i, k):
    """Return four values of a row, from the k-th on."""
    return rows[i, k], rows[i, k + 1], rows[i, k + 2], rows[i, k + 3]


@inlined
def find_rims(patches, bins, edges, tree, work, s, i, look, way, error, shell):
    """
    Project the edges between a patch and the sun onto it, and add its cuts by faces.

    ``way`` is the shift of a point's shadow per metre of height, ``error`` the error bounds of rims
    [squares], and ``shell`` one that hides a sample of the patch, -1 for none. Returns the number
    of rims, 0 if none of them, or none of this shell, meets the samples, or -1 if rays must be
    cast.
    """
    ends = edges.ends
    su, sv = way
    bu, bv = error
    b0, b1, b2 = bins.basis[s, 0], bins.basis[s, 1], bins.basis[s, 2]
    b3, b4, b5 = bins.basis[s, 3], bins.basis[s, 4], bins.basis[s, 5]
    b6, b7, b8 = bins.basis[s, 6], bins.basis[s, 7], bins.basis[s, 8]
    p = patches.place
    f0, f1, f2, f3 = _four(patches.frame, i, 0)
    f4, f5, f6, f7 = _four(patches.frame, i, 4)
    f8, f9, f10, f11 = _four(patches.frame, i, 8)
    tau = patches.tau[i]
    w, h = patches.size[i, 0] - 1.0, patches.size[i, 1] - 1.0
    gx, gy, scale = bins.grid[s, 0], bins.grid[s, 1], bins.grid[s, 2]
    cols, rows, begin = bins.shape[s, 0], bins.shape[s, 1], bins.shape[s, 2]
    stamp, rims = work.stamp, work.rims
    # The patch's rectangle in light space: its bins and its distance from the sun.
    xa, xb = (
        (b0 * p[i, 3] + b1 * p[i, 4] + b2 * p[i, 5]) * w,
        (b0 * p[i, 6] + b1 * p[i, 7] + b2 * p[i, 8]) * h,
    )
    ya, yb = (
        (b3 * p[i, 3] + b4 * p[i, 4] + b5 * p[i, 5]) * w,
        (b3 * p[i, 6] + b4 * p[i, 7] + b5 * p[i, 8]) * h,
    )
    za, zb = (
        (b6 * p[i, 3] + b7 * p[i, 4] + b8 * p[i, 5]) * w,
        (b6 * p[i, 6] + b7 * p[i, 7] + b8 * p[i, 8]) * h,
    )
    x = b0 * p[i, 0] + b1 * p[i, 1] + b2 * p[i, 2] - gx
    y = b3 * p[i, 0] + b4 * p[i, 1] + b5 * p[i, 2] - gy
    z = b6 * p[i, 0] + b7 * p[i, 1] + b8 * p[i, 2]
    slack = 1e-5 + (1e-6 + 4.0 * tau) * scale
    i0 = clamp((x + min(xa, 0.0) + min(xb, 0.0)) * scale - slack, cols)
    i1 = clamp((x + max(xa, 0.0) + max(xb, 0.0)) * scale + slack, cols)
    j0 = clamp((y + min(ya, 0.0) + min(yb, 0.0)) * scale - slack, rows)
    j1 = clamp((y + max(ya, 0.0) + max(yb, 0.0)) * scale + slack, rows)
    limits = (
        np.float32((x + max(xa, 0.0) + max(xb, 0.0)) * scale + slack),
        np.float32((x + min(xa, 0.0) + min(xb, 0.0)) * scale - slack),
        np.float32((y + max(ya, 0.0) + max(yb, 0.0)) * scale + slack),
        np.float32((y + min(ya, 0.0) + min(yb, 0.0)) * scale - slack),
        np.float32(z + min(za, 0.0) + min(zb, 0.0)),
    )
    n = 0
    n_meeting = 0
    n_own = 0
    for j in range(j0, j1 + 1):
        row = begin + j * cols
        end = bins.starts[row + i1 + 1]
        for at in range(bins.starts[row + i0], end, LANES):
            met = meet_rectangles(bins.table, at, limits)
            if end - at < LANES:
                met &= (1 << (end - at)) - 1
            while met != 0:
                c = at + find_lowest(met)
                met &= met - 1
                o = bins.order[c]
                if stamp[o] == look:
                    continue
                stamp[o] = look
                e = bins.edge[c]
                ha = f8 * ends[e, 0] + f9 * ends[e, 1] + f10 * ends[e, 2] + f11
                hb = f8 * ends[e, 3] + f9 * ends[e, 4] + f10 * ends[e, 5] + f11
                if ha <= tau and hb <= tau:
                    continue
                ha = 0.0 if abs(ha) <= tau else ha
                hb = 0.0 if abs(hb) <= tau else hb
                ua = f0 * ends[e, 0] + f1 * ends[e, 1] + f2 * ends[e, 2] + f3
                va = f4 * ends[e, 0] + f5 * ends[e, 1] + f6 * ends[e, 2] + f7
                ub = f0 * ends[e, 3] + f1 * ends[e, 4] + f2 * ends[e, 5] + f3
                vb = f4 * ends[e, 3] + f5 * ends[e, 4] + f6 * ends[e, 5] + f7
                if ha < 0.0:
                    ua, va = cut_edge(ua, va, ha, ub, vb, hb, True)
                    ha = 0.0
                elif hb < 0.0:
                    ub, vb = cut_edge(ua, va, ha, ub, vb, hb, True)
                    hb = 0.0
                ua, va, ub, vb = ua - ha * su, va - ha * sv, ub - hb * su, vb - hb * sv
                how = _meets(ua, va, ub, vb, bu, bv, w, h, patches.hull, i)
                if how == _MISSES:
                    continue
                if how == _MEETS:
                    n_meeting += 1
                    n_own += edges.shell[e] == shell
                rims[n, 0], rims[n, 1], rims[n, 2], rims[n, 3] = ua, va, ub, vb
                rims[n, 4] = bins.change[c]
                rims[n, 5] = edges.shell[e]
                n += 1
    for c in range(patches.cut_start[i], patches.cut_start[i + 1]):
        ua, va, ub, vb = _four(patches.cuts, c, 0)
        how = _meets(ua, va, ub, vb, bu, bv, w, h, patches.hull, i)
        if how == _MISSES:
            continue
        face = patches.cut_face[c]
        m0, m1, m2 = get(tree.normals, face)
        side = m0 * b6 + m1 * b7 + m2 * b8
        if abs(side) < _EDGE_ON:
            return -1
        if how == _MEETS:
            n_meeting += 1
            n_own += edges.face_shell[tree.source[face]] == shell
        rims[n, 5] = edges.face_shell[tree.source[face]]
        rims[n, 0], rims[n, 1], rims[n, 2], rims[n, 3] = ua, va, ub, vb
        rims[n, 4] = 1.0 if side > 0.0 else -1.0
        n += 1
    return n if n_meeting > 0 and (shell < 0 or n_own > 0) else 0
