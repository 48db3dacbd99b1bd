"""
What faces add to what is known to be covered, and which are hidden in it.

A face's lower boundary is the highest of the arcs of its lower edges, and its upper boundary the
lowest of those of its upper edges, as it is convex. So a face that spans a bin covers it between
what these arcs are at its sides; and a face is hidden in a bin if one of its upper edges' arcs lies
below what covers it, at both sides.
"""

import math

from umbra.kernels import borrowing, inlined
from umbra.sky.skyline import BINS, CLEAR, MEET, NARROW, add_interval, is_covered, look_along

__all__ = ["is_face_hidden", "raise_cover"]

_UPRIGHT = 1e-5  # of the azimuth that an edge spans: those are at a face's ends,
_ENDS = 0.02  # this part of a bin [bins]
_CLEAR = 2.0 * CLEAR  # more than the sweep takes off
_MIDDLE = 0.5


@inlined
def _find_arcs(corners, n, arcs):
    """
    Find the arcs of a face's edges, (CORNERS, 4): -1 lower or 1 upper, x, y, room for a tangent.

    The tangent of its altitude toward d is x d_x + y d_y. Returns how many there are, or -1 if
    rounding may matter. ``corners`` are ordered as those of ``SeenFaces``.
    """
    count = 0
    for k in range(n):
        after = k + 1 if k + 1 < n else 0
        ax, ay, az = corners[k, 0], corners[k, 1], corners[k, 2]
        bx, by, bz = corners[after, 0], corners[after, 1], corners[after, 2]
        turn = ax * by - ay * bx
        size_a, size_b = abs(ax) + abs(ay), abs(bx) + abs(by)
        if abs(turn) <= _UPRIGHT * size_a * size_b:
            continue
        if abs(turn) <= NARROW * (size_a + az) * (size_b + bz):
            return -1
        arcs[count, 0] = -1.0 if turn > 0.0 else 1.0
        arcs[count, 1], arcs[count, 2] = (az * by - ay * bz) / turn, (ax * bz - az * bx) / turn
        count += 1
    return count


@inlined
def _cut(arcs, count, column):
    """Return what a face covers of the meridian at a bin's first side."""
    dx, dy = look_along(column)
    low, high = -math.inf, math.inf
    for e in range(count):
        slope = arcs[e, 1] * dx + arcs[e, 2] * dy
        if arcs[e, 0] < 0.0:
            low = max(low, slope)
        else:
            high = min(high, slope)
    return low, high


@borrowing
def raise_cover(corners, n, start, end, highest, arcs, cover):
    """
    Add a face to what is known to be covered, (BINS, 6), see ``make_cover``.

    Parameters are its corners, ordered as in ``SeenFaces``, what ``find_outline`` says of it, and
    room for its arcs, (CORNERS, 4).
    """
    if highest == math.inf:
        return
    first, last = math.ceil(start + _ENDS), math.floor(end - _ENDS)
    if first >= last:
        return
    count = _find_arcs(corners, n, arcs)
    if count < 0:
        return
    is_known = False
    low = high = 0.0
    for column in range(first, last):
        row = cover[column & (BINS - 1)]
        if min(row[0], row[1]) >= highest:
            is_known = False
            continue
        if not is_known:
            low, high = _cut(arcs, count, column)
        next_low, next_high = _cut(arcs, count, column + 1)
        is_known = True
        if high < math.inf:
            add_interval(row, low, next_low, high, next_high, False)
        low, high = next_low, next_high


@borrowing
def is_face_hidden(cover, corners, n, bounds, arcs):
    """
    Return whether a face is hidden in what is known to be covered, (BINS, 6).

    Parameters are its corners, ordered as in ``SeenFaces``, (4,) of ``find_outline``, and room for
    its arcs, (CORNERS, 4).
    """
    low, high, start, end = bounds[0], bounds[1], bounds[2], bounds[3]
    if is_covered(cover, start, end, low, high):
        return True
    if high == math.inf:
        return False
    count = _find_arcs(corners, n, arcs)
    if count <= 0:
        return False
    is_known = False
    for column in range(math.floor(start - MEET), math.floor(end + MEET) + 1):
        if is_covered(cover, column + _MIDDLE, column + _MIDDLE, low, high):
            is_known = False
            continue
        row = cover[column & (BINS - 1)]
        if not is_known:
            dx, dy = look_along(column)
            for e in range(count):
                arcs[e, 3] = arcs[e, 1] * dx + arcs[e, 2] * dy
        is_known = True
        dx, dy = look_along(column + 1)
        is_below = is_above = is_within = False
        for e in range(count):
            slope, next_slope = arcs[e, 3], arcs[e, 1] * dx + arcs[e, 2] * dy
            arcs[e, 3] = next_slope
            margin = _CLEAR * (1.0 + abs(slope)), _CLEAR * (1.0 + abs(next_slope))
            if arcs[e, 0] > 0.0:
                slope, next_slope = slope + margin[0], next_slope + margin[1]
                is_below |= slope < row[0] and next_slope < row[1]
                is_within |= slope < row[4] and next_slope < row[5]
            else:
                slope, next_slope = slope - margin[0], next_slope - margin[1]
                is_above |= slope > row[2] and next_slope > row[3]
        if not (is_below or (is_within and is_above)):
            return False
    return True
