"""
Crossings of silhouette edges with the columns of a plane's raster, and their sums.

Edges in the plane itself, where clipping cut the casters, cross at the same places under every
sun; only their multiplicities change, and from one sun to the next only a few do. Their crossings
are kept from sun to sun, and the changes are added to them.
"""

import numpy as np
from numba import get_thread_id, njit, prange

from umbra.cpu.sweep import bound_counts

__all__ = ["count_winding", "sweep"]

_LARGE = 500_000  # edges whose ends fit into no cache
_AHEAD = 64  # edges whose ends are read at once: waits for memory overlap
_WRAPPED = 255  # largest count for which a wrapped 8-bit sum is 0 only for 0
_CLEAR = 2.0**-10  # distance from the raster [cells], and share of coordinates, that
_ROUNDING = 2.0**-44  # is far above rounding


@njit(cache=True, nogil=True, boundscheck=False, error_model="numpy")
def _add_clipped(x0, y0, x1, y1, c0, c1, m, corner, diff, south):
    """
    Add a multiplicity where an edge crosses columns c0 to c1, of which some may miss the raster.

    South of it, where low suns have most crossings, they add up in ``south`` as a difference along
    the row; north of it they change no cell. Returns what tells whether one may have overflowed.
    """
    row, col = corner
    low, top = np.float64(row), np.float64(row + diff.shape[0] - 1)
    rise = (y1 - y0) / (x1 - x0)
    clear = _CLEAR + _ROUNDING * (abs(y0) + abs(y1) + (abs(x0) + abs(x1)) * abs(rise))
    # Where the edge crosses those rows; a quotient of 0 by 0 keeps all columns inside.
    begin = np.ceil(x0 + (low - clear - y0) / rise)
    end = np.ceil(x0 + (top - 1.0 + clear - y0) / rise)
    first = c0 if not begin > c0 else np.int64(min(begin, np.float64(c1)))
    last = c1 if not end < c1 else np.int64(max(end, np.float64(c0)))
    if rise < 0.0:
        first, last = (
            c0 if not end > c0 else np.int64(min(end, np.float64(c1))),
            c1 if not begin < c1 else np.int64(max(begin, np.float64(c0))),
        )
        south[last - col] += m
        south[c1 - col] -= m
    else:
        south[c0 - col] += m
        south[first - col] -= m
    half = np.int64(1) << (8 * diff.itemsize - 1)
    spill = np.int64(0)
    for c in range(first, last):
        r = np.int64(np.ceil(min(max(y0 + (c - x0) * rise, low), top))) - row
        held = diff[r, c - col] + m
        diff[r, c - col] = held
        spill |= held + half
    return spill


@njit(cache=True, nogil=True, boundscheck=False, error_model="numpy")
def _scatter(ends, weight, codes, fixed, slope_x, slope_y, corner, diff, south, loads, states):
    """
    Add each edge's multiplicity where it crosses columns, as ``_add_clipped`` does.

    From ``fixed`` on edges lie in the plane: their multiplicities are written to ``states``, 0 of
    edges in no silhouette. Returns the least and greatest row, the sum of all multiplicities, and
    whether a single crossing may have overflowed.
    """
    row, col = corner
    cols = diff.shape[1]
    end = col + cols
    is_large = ends.shape[0] > _LARGE
    flat = diff.reshape(-1)  # unsigned indices need no test of their sign
    origin = row * cols + col
    low = np.float64(row)
    top = np.float64(row + diff.shape[0] - 1)
    lowest, highest = top, low
    deepest = 0
    half = np.int64(1) << (8 * diff.itemsize - 1)
    spill = np.int64(0)
    states[:] = 0
    touched = 0.0  # never NaN; it keeps the compiler from leaving the reading out
    for ahead in range(0, codes.size, _AHEAD):
        stop = min(codes.size, ahead + _AHEAD)
        if is_large:
            for q in range(ahead, stop):
                e = np.uint64(codes[q] >> 2)
                touched += ends[e, 0] + ends[e, 5]
        for q in range(ahead, stop):
            code = codes[q]
            e = np.uint64(code >> 2)
            m = np.int64(weight[e]) >> ((code >> 1) & 1)
            if code & 1 == 0:
                m = -m
            if code >> 2 >= fixed:
                states[(code >> 2) - fixed] = m
                deepest += abs(m)
                continue
            x0 = ends[e, 0] - ends[e, 2] * slope_x
            y0 = ends[e, 1] - ends[e, 2] * slope_y
            x1 = ends[e, 3] - ends[e, 5] * slope_x
            y1 = ends[e, 4] - ends[e, 5] * slope_y
            if x0 > x1:
                x0, x1 = x1, x0
                y0, y1 = y1, y0
                m = -m
            c0 = np.int64(min(max(np.ceil(x0), np.float64(col)), np.float64(end)))
            c1 = np.int64(min(max(np.ceil(x1), np.float64(col)), np.float64(end)))
            if c0 >= c1:
                continue
            # Most edges lie within the raster and need no clipping.
            if min(y0, y1) >= low and max(y0, y1) <= top - 1.0:
                rise = (y1 - y0) / (x1 - x0)
                for c in range(c0, c1):
                    place = np.uint64(np.int64(np.ceil(y0 + (c - x0) * rise)) * cols + c - origin)
                    held = flat[place] + m
                    flat[place] = held
                    spill |= held + half
            else:
                spill |= _add_clipped(x0, y0, x1, y1, c0, c1, m, corner, diff, south)
            lowest = min(lowest, y0, y1)
            highest = max(highest, y0, y1)
            loads[np.uint64(c0 - col)] += abs(m)
            loads[np.uint64(c1 - col)] -= abs(m)
            deepest += abs(m)
    return lowest, highest, deepest, spill < 0 or spill >= 2 * half or np.isnan(touched)


@njit(cache=True, nogil=True, boundscheck=False)
def _renew(ends, states, held, corner, base, south, loads):
    """
    Change kept crossings of edges in the plane from the multiplicities ``held`` to ``states``.

    Returns whether a single crossing may have overflowed.
    """
    col = corner[1]
    west, east = np.float64(col), np.float64(col + base.shape[1])
    half = np.int64(1) << (8 * base.itemsize - 1)
    spill = np.int64(0)
    for e in range(states.size):
        if states[e] == held[e]:
            continue
        x0, y0, x1, y1 = ends[e, 0], ends[e, 1], ends[e, 3], ends[e, 4]
        m = np.int64(states[e]) - held[e]
        load = abs(np.int64(states[e])) - abs(np.int64(held[e]))
        held[e] = states[e]
        if x0 > x1:
            x0, x1 = x1, x0
            y0, y1 = y1, y0
            m = -m
        c0 = np.int64(min(max(np.ceil(x0), west), east))
        c1 = np.int64(min(max(np.ceil(x1), west), east))
        if c0 >= c1:
            continue
        spill |= _add_clipped(x0, y0, x1, y1, c0, c1, m, corner, base, south)
        loads[c0 - col] += load
        loads[c1 - col] -= load
    return spill < 0 or spill >= 2 * half


@njit(cache=True, nogil=True, boundscheck=False)
def _sum_steps(diff, first, last, level, out):
    """
    Sum columns over a range of rows; add 1 to every cell in shadow; reset ``diff`` to 0.

    Sums may wrap around: only 0 must differ from the rest.
    """
    for r in range(first, last):
        d = diff[r]
        o = out[r]
        for c in range(o.size):
            level[c] += d[c]
            d[c] = 0
            o[c] += level[c] != 0


@njit(cache=True, nogil=True, boundscheck=False)
def _sum_both(diff, base, first, last, level, out):
    """Sum columns of ``diff`` and ``base`` as ``_sum_steps`` does; ``base`` stays."""
    for r in range(first, last):
        d = diff[r]
        b = base[r]
        o = out[r]
        for c in range(o.size):
            level[c] += d[c] + b[c]
            d[c] = 0
            o[c] += level[c] != 0


@njit(cache=True, nogil=True, boundscheck=False)
def _sum_counts(diff, first, last, level, out):
    """Sum columns over a range of rows into ``out``, which is 0; reset ``diff`` to 0."""
    for r in range(first, last):
        d = diff[r]
        o = out[r]
        for c in range(o.size):
            level[c] += d[c]
            d[c] = 0
            o[c] = level[c]


@njit(cache=True, nogil=True)
def _find_rows(lowest, highest, corner, diff):
    """Return the first row that may hold a crossing, and the end row."""
    low, top = np.float64(corner[0]), np.float64(corner[0] + diff.shape[0] - 1)
    # One row more on each side, for rounding.
    first = np.int64(max(lowest - 1.0, low)) - corner[0]
    return first, np.int64(min(highest + 2.0, top)) - corner[0]


@njit(cache=True, nogil=True)
def count_winding(ends, weight, corner, diff, counts):
    """Count how often edges in the plane go around each cell, from ``diff`` of 0."""
    south, loads = np.zeros((2, diff.shape[1] + 1), np.int64)
    codes = (np.arange(ends.shape[0]) << 2 | 1).astype(np.int32)
    nothing = np.zeros(0, np.int8)
    lowest, highest, _, _ = _scatter(
        ends, weight, codes, codes.size, 0.0, 0.0, corner, diff, south, loads, nothing
    )
    first, last = _find_rows(lowest, highest, corner, diff)
    level = np.cumsum(south[:-1]).astype(np.int32)
    _sum_counts(diff, first, last, level, counts)


@njit(cache=True, nogil=True, parallel=True, boundscheck=False)
def sweep(
    ends, weight, codes, starts, slope, which, level, corner, diff, kept, out, counts, too_deep
):
    """
    Count ``which`` suns, in each thread's buffers.

    Steps in shadow are added to ``out[thread]``; if there are as many ``counts`` as suns, counts
    are written there instead. ``level`` holds the first of the edges in the plane, and their least
    and greatest row. ``kept`` holds by thread: their crossings; the loads of columns and what
    crosses them south of the raster; the multiplicities that these hold, and a sun's; whether a
    crossing ever overflowed.
    """
    keep = counts.shape[0] == slope.shape[0]
    fixed, lowest_fixed, highest_fixed = level
    base, sums, states, wrapped = kept
    has_fixed = fixed < ends.shape[0]
    for q in prange(which.size):
        t = get_thread_id()
        s = which[q]
        mine = codes[starts[s] : starts[s + 1]]
        cols = diff.shape[2]
        own = np.zeros((2, cols + 1), np.int64)
        lowest, highest, deepest, has_spilled = _scatter(
            ends, weight, mine, fixed, slope[s, 0], slope[s, 1], corner, diff[t], own[1], own[0],
            states[t, 1],
        )  # fmt: skip
        if has_fixed:
            wrapped[t] |= _renew(
                ends[fixed:], states[t, 1], states[t, 0], corner, base[t], sums[t, 1], sums[t, 0]
            )
            has_spilled |= wrapped[t]
            lowest, highest = min(lowest, lowest_fixed), max(highest, highest_fixed)
            own = own + sums[t]
        first, last = _find_rows(lowest, highest, corner, diff[t])
        # Crossings of a closed chain in a column sum to 0: half of them count up.
        depth = bound_counts(own[0], deepest, 2 * _WRAPPED) // 2
        is_narrow = depth <= _WRAPPED
        level = np.cumsum(own[1, :cols]).astype(np.int32)
        narrow = level.astype(np.int8)
        if has_spilled and (keep or not is_narrow):
            too_deep[s] = True
            diff[t, :, :] = 0
        elif keep:
            _sum_counts(diff[t], first, last, level, counts[s])
        elif has_fixed and is_narrow:
            _sum_both(diff[t], base[t], first, last, narrow, out[t])
        elif has_fixed:
            _sum_both(diff[t], base[t], first, last, level, out[t])
        elif is_narrow:
            _sum_steps(diff[t], first, last, narrow, out[t])
        else:
            _sum_steps(diff[t], first, last, level, out[t])
