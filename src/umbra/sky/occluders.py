"""
The skyline raised by all faces, so that few are left for the sweep.

What is covered from the horizon on is kept at both sides of each bin, by the same face. A face that
spans the bin and begins no higher at either side goes on from there: along a meridian upper edges
are the lowest, and lower edges the highest, of arcs of great circles, whose tangents of altitude
differ by a sinusoid, so that what holds at both sides of a bin holds between them.
"""

import math

import numpy as np

from umbra.kernels import borrowing, kernel
from umbra.sky.gather import SeenFaces
from umbra.sky.meridians import cut_face
from umbra.sky.skyline import BINS, CLEAR, find_bin, find_highest, look_along

__all__ = ["keep_above", "raise_skyline"]

_GAP = 1e-12  # as of the sweep
_PASSES = 1
_WIDEST = BINS // 4


@kernel
def raise_skyline(seen, skyline):
    """
    Raise a skyline (BINS,) in place by the faces of a ``SeenFaces`` that go on from it.

    What is covered below it stays covered; it is only known better.
    """
    tops = np.empty((BINS, 2))
    for b in range(BINS):
        tops[b, 0] = tops[b, 1] = skyline[b]
    for _ in range(_PASSES):
        for i in range(seen.size.size):
            if seen.slope[i] < math.inf:
                _raise_by(seen.corners[i], seen.size[i], seen.slope[i], skyline, tops)


@borrowing
def _raise_by(corners, n, highest, skyline, tops):
    """Raise the bins that a face spans as a whole."""
    middle = find_bin(corners[0, 0], corners[0, 1])
    least = most = 0.0
    for k in range(1, n):
        turn = find_bin(corners[k, 0], corners[k, 1]) - middle
        turn -= BINS * round(turn / BINS)
        least, most = min(least, turn), max(most, turn)
    if most - least > _WIDEST:
        return
    first, last = math.ceil(middle + least), math.floor(middle + most)
    is_known = False
    low = high = 0.0
    for column in range(first, last):
        b = column % BINS
        if skyline[b] >= highest:
            is_known = False
            continue
        if not is_known:
            low, high = _cut(corners, n, column)
        next_low, next_high = _cut(corners, n, column + 1)
        is_known = True
        top, next_top = tops[b, 0], tops[b, 1]
        slope = min(high, next_high) * (1.0 - CLEAR)
        if (
            slope >= skyline[b] * (1.0 - CLEAR)
            and high + next_high > (top + next_top) * (1.0 + CLEAR)
            and low <= top + _GAP * (1.0 + top * top)
            and next_low <= next_top + _GAP * (1.0 + next_top * next_top)
        ):
            skyline[b] = max(skyline[b], slope)
            tops[b, 0], tops[b, 1] = high, next_high
        low, high = next_low, next_high


@borrowing
def _cut(corners, n, column):
    """Return what a face covers of the meridian at a bin's first side."""
    dx, dy = look_along(column % BINS)
    length = math.hypot(dx, dy)
    low, high, _, _ = cut_face(corners, n, dx / length, dy / length)
    return low, high


@kernel
def keep_above(seen, skyline):
    """Return the faces of a ``SeenFaces`` that come above a skyline (BINS,)."""
    above = np.empty(seen.size.size, np.int32)
    n = 0
    for i in range(seen.size.size):
        if find_highest(skyline, seen.corners[i], seen.size[i], True) >= 0.0:
            above[n] = i
            n += 1
    above = above[:n]
    return SeenFaces(
        seen.corners[above], seen.size[above], seen.edge[above], seen.face[above],
        seen.slope[above], seen.sides,
    )  # fmt: skip
