"""
Crossings of silhouette edges with the columns of a plane's raster, and their sums.

Edges in the plane itself, where clipping cut the casters, cross at the same places under every
sun; only their multiplicities change, and from one sun to the next only a few do. Their crossings
are kept from sun to sun, and the changes are added to them.
"""

from functools import partial

import numpy as np

from umbra.cpu.raster_sweep import bound_counts
from umbra.cpu.simd_loops import FEW_LANES, write_crossings
from umbra.kernels import borrowing, inner, kernel, take_next

__all__ = ["sweep"]

_BLOCK = 64  # edges projected at once
_WRAPPED = 255  # largest count for which a wrapped 8-bit sum is 0 only for 0
_CLEAR = 2.0**-10  # distance from the raster [cells], and share of coordinates, that
_ROUNDING = 2.0**-44  # is far above rounding


@partial(borrowing, boundscheck=False, error_model="numpy")
def _clip(x, y, rise, clear, rows, first, after, more, south):
    """
    Return the first column and the end of those where a line may cross a raster's rows.

    South of them, where low suns have most crossings, the multiplicity is added to ``south`` as a
    difference along the row; north of them crossings change no cell.
    """
    # Where the line crosses those rows; a quotient of 0 by 0 keeps all columns.
    begin = np.ceil(x + (rows[0] - clear - y) / rise)
    end = np.ceil(x + (rows[1] - 1.0 + clear - y) / rise)
    if rise < 0.0:
        begin, end = end, begin
    start = min(begin, after) if begin > first else first
    stop = max(end, first) if end < after else after
    low, high = (stop, after) if rise < 0.0 else (first, start)
    south[np.int64(low)] += more
    south[np.int64(high)] -= more
    return start, stop


@partial(inner, boundscheck=False, error_model="numpy")
def _cross(ends, weight, codes, slope_x, slope_y, corner, diff, south, loads):
    """
    Add each edge's multiplicity where it crosses columns, south of the raster as ``_clip`` does.

    Returns the first row with a crossing and the last, and whether one may have overflowed.
    """
    row, col = corner
    cols = diff.shape[1]
    flat = diff.reshape(-1)  # unsigned indices need no test of their sign
    rows = np.float64(row), np.float64(row + diff.shape[0] - 1)
    west, east = np.float64(col), np.float64(col + cols)
    origin = np.float64(row * cols + col)
    # One array: the compiler makes no vectors of a loop over many that might overlap.
    work = np.empty((10, _BLOCK))
    x0, y0, x1, y1, m = work[0], work[1], work[2], work[3], work[4]
    x, y, rise, begin, end = work[5], work[6], work[7], work[8], work[9]
    places = np.empty(_BLOCK * cols + FEW_LANES, np.int32)
    adds = np.empty(places.size, np.int8)
    lowest, highest = flat.size, 0
    half = np.int64(1) << (8 * diff.itemsize - 1)
    spill = np.int64(0)
    for block in range(0, codes.size, _BLOCK):
        n = min(codes.size - block, _BLOCK)
        for i in range(n):
            code = codes[block + i]
            e = np.uint64(code >> 2)
            once = np.int32(weight[e]) >> ((code >> 1) & 1)
            m[i] = once if code & 1 else -once
            x0[i] = ends[e, 0] - ends[e, 2] * slope_x
            y0[i] = ends[e, 1] - ends[e, 2] * slope_y
            x1[i] = ends[e, 3] - ends[e, 5] * slope_x
            y1[i] = ends[e, 4] - ends[e, 5] * slope_y
        for i in range(_BLOCK):
            a, b, more = (x0[i], y0[i]), (x1[i], y1[i]), m[i]
            turned = a[0] > b[0]
            left, right = (b, a) if turned else (a, b)
            x[i], y[i] = left
            m[i] = -more if turned else more
            rise[i] = (right[1] - left[1]) / (right[0] - left[0])
            begin[i] = min(max(np.ceil(left[0]), west), east)
            end[i] = min(max(np.ceil(right[0]), west), east)
        written = np.uint64(0)
        for i in range(n):
            first, after, more = begin[i] - west, end[i] - west, np.int64(m[i])
            loads[np.uint64(first)] += abs(more)
            loads[np.uint64(after)] -= abs(more)
            least, most = min(y0[i], y1[i]), max(y0[i], y1[i])
            # Most edges lie within the raster.
            if (least < rows[0] or most > rows[1] - 1.0) and first < after:
                wide = (abs(x0[i]) + abs(x1[i])) * abs(rise[i])
                clear = _CLEAR + _ROUNDING * (abs(least) + abs(most) + wide)
                first, after = _clip(
                    x[i] - west, y[i], rise[i], clear, rows, first, after, more, south
                )
                lowest = 0 if least < rows[0] else lowest
                highest = flat.size - 1 if most > rows[1] - 1.0 else highest
            for t in range(0, max(np.int64(after - first), 1), FEW_LANES):
                line = west + first + t, x[i], y[i], rise[i]
                write_crossings(
                    places, adds, written + np.uint64(t), line, rows, np.float64(cols), origin, more
                )
            written += np.uint64(after - first)
        for i in range(written):
            cell = places[i]
            held = flat[np.uint64(cell)] + np.int64(adds[i])
            flat[np.uint64(cell)] = held
            spill |= held + half
            lowest, highest = min(lowest, cell), max(highest, cell)
    return lowest // cols, highest // cols, spill < 0 or spill >= 2 * half


@partial(borrowing, boundscheck=False)
def _find_turned(planes, is_open, sun, states, held, codes):
    """
    List the edges in the plane whose multiplicity changes; return their number.

    A closed face adds 1 if it is lit; an open one adds -1, too, if it is not. The changes are
    codes as in ``Silhouettes``, for a weight of 2.
    """
    for e in range(held.size):
        side = planes[0, e] * sun[0] + planes[1, e] * sun[1] + planes[2, e] * sun[2]
        states[e] = np.int8(side > 0.0) - np.int8(is_open[e] & (side < 0.0))
    n = 0
    for e in range(held.size):
        change = np.int32(states[e]) - held[e]
        codes[n] = np.int32(e) << 2 | (change & 1) << 1 | np.int32(change > 0)
        held[e] = states[e]
        n += change != 0
    return n


@partial(borrowing, boundscheck=False)
def _sum_up(diff, base, first, last, level, counts):
    """Write the sums of columns of ``diff`` and ``base`` over some rows; reset ``diff`` to 0."""
    for r in range(first, last):
        d = diff[r]
        b = base[r]
        o = counts[r]
        for c in range(o.size):
            level[c] += d[c] + b[c]
            d[c] = 0
            o[c] = level[c]
    diff[last] = 0


@partial(borrowing, boundscheck=False)
def _add_up(diff, base, first, last, level, weights, sums):
    """
    Add a sun's ``weights`` (k,) to the ``sums`` (k, rows, cols) of every cell in shadow.

    Columns are summed as in ``_sum_up``, but may wrap around: only 0 must differ from the rest.
    """
    nothing = weights[0] - weights[0]
    for r in range(first, last):
        d = diff[r]
        b = base[r]
        o = sums[0, r]
        w = weights[0]
        for c in range(o.size):
            level[c] += d[c] + b[c]
            d[c] = 0
            o[c] += w if level[c] != 0 else nothing
        for k in range(1, weights.size):
            o = sums[k, r]
            w = weights[k]
            for c in range(o.size):
                o[c] += w if level[c] != 0 else nothing
    diff[last] = 0


@inner
def _sum_along(south, level, narrow):
    """Add up a row from the west. In ``sweep`` itself the loop makes all else a third slower."""
    deep = 0
    for c in range(level.size):
        deep += south[c]
        level[c], narrow[c] = deep, deep


@partial(kernel, boundscheck=False)
def sweep(
    sides, codes, starts, suns, which, rims, corner, buffers, weights, out, counts, too_deep, taken
):
    """
    Count ``which`` suns until all are taken, in this thread's buffers.

    Where a sun leaves cells in shadow, its ``weights`` (suns, k) are added to ``out[thread]`` (k,
    rows, cols); if there are as many ``counts`` as suns, counts are written there instead. ``suns``
    are directions, and their slopes in cells. ``sides`` are ends and weights of edges; ``rims``,
    edges in the plane: ends, weights of 2, planes of their faces, whether these are open, loads of
    columns, first row and end row. ``buffers`` holds by thread: a sun's crossings; those of the
    rims, and south of the raster; multiplicities of the rims, and a sun's; which of them it
    changes; whether a crossing of the rims ever overflowed.
    """
    keep = counts.shape[0] == suns.shape[0]
    rim_ends, rim_weight, planes, is_open, rim_loads, first_rim, last_rim = rims
    diff, base, below, states, turned, wrapped = buffers
    t = take_next(taken[1:])
    while True:
        q = take_next(taken)
        if q >= which.size:
            return
        s = which[q]
        n = _find_turned(planes, is_open, suns[s], states[t, 1], states[t, 0], turned[t])
        south, loads = np.zeros(rim_loads.size, np.int64), np.zeros(rim_loads.size, np.int64)
        _, _, has_spilled = _cross(
            rim_ends, rim_weight, turned[t, :n], 0.0, 0.0, corner, base[t], below[t], loads
        )
        wrapped[t] |= has_spilled
        for c in range(loads.size):
            loads[c] = rim_loads[c]
            south[c] = below[t, c]
        first, last, has_spilled = _cross(
            *sides, codes[starts[s] : starts[s + 1]], suns[s, 3], suns[s, 4], corner, diff[t],
            south, loads,
        )  # fmt: skip
        has_spilled |= wrapped[t]
        first, last = min(first, first_rim), max(last, last_rim)
        # Crossings of a closed chain in a column sum to 0: half of them count up.
        is_narrow = bound_counts(loads) // 2 <= _WRAPPED
        level, narrow = np.zeros(diff.shape[2], np.int32), np.zeros(diff.shape[2], np.int8)
        _sum_along(south, level, narrow)
        if has_spilled and (keep or not is_narrow):
            too_deep[s] = True
            diff[t, :, :] = 0
        elif keep:
            _sum_up(diff[t], base[t], first, last, level, counts[s])
        elif is_narrow:
            _add_up(diff[t], base[t], first, last, narrow, weights[s], out[t])
        else:
            _add_up(diff[t], base[t], first, last, level, weights[s], out[t])
