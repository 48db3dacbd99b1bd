"""
What is known to be covered around a point, which tells what cannot bound the free sky.

The turn is cut into bins. Of each, two intervals of altitude are known to be covered in the whole
bin: one from the horizon on, and one above it, such as of houses on a hill, which seem to float as
their ground is no part of the model. What lies within one of them in all its bins is left out of
the sweep, which starts with both.

Altitudes are given by their tangents. An edge, an arc of a great circle in the plane n . w = 0, has
-(n_x d_x + n_y d_y) / n_z toward the level unit vector d, which is A cos(azimuth - B): concave
above the horizon, and two of them differ by a sinusoid, too. So what holds at both sides of a bin,
by one arc each, holds between them; and an arc is lowest at one of them.
"""

import math

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, inlined, kernel

__all__ = [
    "BINS", "BOXES", "CLEAR", "CURVED", "FACES", "GAP", "MEET", "NARROW", "STRIPS", "add_interval",
    "find_bin", "find_cover_along", "find_layer", "find_near_boxes", "find_outline", "find_turn",
    "is_box_hidden", "is_box_out", "is_covered", "look_along", "make_cover", "make_covers",
]  # fmt: skip

BINS = 1024
"""Bins of the turn."""
CLEAR = 1e-9
"""What is hidden lies this far within what covers it, as a share and as a tangent, for rounding."""
CURVED = 1.00001
"""How far an arc rises above its ends within a bin."""
GAP = 1e-12
"""Free gaps between faces up to this angle are rounding [radians]."""
MEET = 1e-7
"""How near to a side of a bin is at it, and where two strips meet [bins]."""
NARROW = 1e-6
"""Sine of the angle of an edge whose arc is known to within ``CLEAR``."""
FACES, STRIPS, BOXES = 8, 4, 8
"""Faces, and strips of walls, that one box bounds; and boxes that one box of boxes does."""
_QUARTER = BINS // 4
_LEAST = 1e-3  # size of an interval above that is kept


@inlined
def find_bin(x, y):
    """Return the place of a direction in the turn, 0 to ``BINS``: monotonic, without an angle."""
    size = abs(x) + abs(y)
    if size == 0.0:
        return 0.0
    share = x / size
    return _QUARTER * (1.0 - share if y >= 0.0 else 3.0 + share)


def _find_sides() -> NDArray[np.float64]:
    """Return the unit directions of the bins' first sides, (BINS, 2), see ``find_bin``."""
    share = np.arange(BINS) % _QUARTER / _QUARTER
    x, y = (1.0 - share) / np.hypot(1.0 - share, share), share / np.hypot(1.0 - share, share)
    quarter = np.arange(BINS) // _QUARTER
    return np.column_stack([np.choose(quarter, [x, -y, -x, y]), np.choose(quarter, [y, x, -y, -x])])


_SIDES = _find_sides()


@inlined
def find_turn(x, y):
    """Return the place of a direction in the turn from azimuth -pi to pi, 0 to ``BINS``."""
    return find_bin(-x, -y)


@inlined
def look_along(column):
    """Return the unit direction of a bin's first side; columns go on round the turn."""
    b = column & (BINS - 1)
    return _SIDES[b, 0], _SIDES[b, 1]


@kernel
def make_cover():
    """
    Return that nothing is known to be covered, (BINS, 6).

    Tangents at both sides of each bin: up to where it is covered from the horizon on; and from
    where, and up to where, by the interval above; the latter is infinite where there is none.
    """
    return make_covers(1)[0]


@kernel
def make_covers(n):
    """Return n covers, (n, BINS, 6), see ``make_cover``."""
    covers = np.zeros((n, BINS, 6))
    for k in range(n):
        for b in range(BINS):
            covers[k, b, 2] = covers[k, b, 3] = math.inf
            covers[k, b, 4] = covers[k, b, 5] = -math.inf
    return covers


@inlined
def is_covered(cover, start, end, low, high):
    """Return whether all bins between two places hide what lies between two tangents."""
    for column in range(math.floor(start - MEET), math.floor(end + MEET) + 1):
        row = cover[column & (BINS - 1)]
        if high < min(row[0], row[1]) * (1.0 - CLEAR) - CLEAR:
            continue
        if high >= min(row[4], row[5]) * (1.0 - CLEAR) - CLEAR:
            return False
        if low <= max(row[2], row[3]) * (CURVED + CLEAR) + CLEAR:
            return False
    return True


@inlined
def find_cover_along(cover, x, y):
    """
    Return what a cover (BINS, 6) surely hides on the meridian toward (x, y).

    Tangents: up to one from the horizon on, and from another to a third.
    """
    b = int(find_bin(x, y)) & (BINS - 1)
    row = cover[b]
    ax, ay = look_along(b)
    bx, by = look_along(b + 1)
    turn = ax * by - ay * bx
    first, second = (x * by - y * bx) / turn, (ax * y - ay * x) / turn
    top = (first * row[0] + second * row[1]) * (1.0 - CLEAR) - CLEAR
    if row[2] == math.inf:
        return top, math.inf, -math.inf
    low = (first * row[2] + second * row[3]) * (1.0 + CLEAR) + CLEAR
    high = (first * row[4] + second * row[5]) * (1.0 - CLEAR) - CLEAR
    return (top, low, high) if low < high else (top, math.inf, -math.inf)


@inlined
def add_interval(row, low, next_low, high, next_high, replaces):
    """
    Add an interval of altitude to what covers a bin (6,), given by arcs at both of its sides.

    It is united with one that it touches. Of two that it cannot be, the larger stays if this
    ``replaces`` the other, else the first: nothing may have been left out for what goes.
    """
    if not (high >= low and next_high >= next_low):
        return
    if _touches(low, row[0]) and _touches(next_low, row[1]):
        _raise_top(row, high, next_high)
    elif row[2] == math.inf:
        if _find_size(low, high) > _LEAST:
            row[2], row[3], row[4], row[5] = low, next_low, high, next_high
    elif (
        _touches(low, row[4])
        and _touches(next_low, row[5])
        and _touches(row[2], high)
        and _touches(row[3], next_high)
    ):
        if low <= row[2] and next_low <= row[3]:
            row[2], row[3] = low, next_low
        if high >= row[4] and next_high >= row[5]:
            row[4], row[5] = high, next_high
    elif replaces and _find_size(low, high) > _find_size(row[2], row[4]):
        row[2], row[3], row[4], row[5] = low, next_low, high, next_high
    if row[2] <= row[0] and row[3] <= row[1]:
        _raise_top(row, row[4], row[5])
        if row[4] <= row[0] and row[5] <= row[1]:
            row[2] = row[3] = math.inf
            row[4] = row[5] = -math.inf


@inlined
def _find_size(low, high):
    """Return a measure of what is between two tangents, of 1 in all."""
    return high / (1.0 + high) - low / (1.0 + low)


@inlined
def _touches(low, high):
    """Return whether an interval from a tangent on begins in or at one that ends at another."""
    return low <= high + GAP * (1.0 + high * high)


@inlined
def _raise_top(row, high, next_high):
    """Raise what is covered from the horizon on, where it is lowest and in all."""
    if min(high, next_high) >= min(row[0], row[1]) and high + next_high > row[0] + row[1]:
        row[0], row[1] = high, next_high


@inlined
def find_outline(corners, n):
    """
    Bound a convex polygon as seen from the origin, given by ``n`` corners above the horizon.

    Returns tangents that no altitude is below, and above, and the places in the turn where it
    starts and ends, 0 to 3 ``BINS``. The highest is infinite where nothing is known.
    """
    low, high = math.inf, 0.0
    middle = find_bin(corners[0, 0], corners[0, 1])
    least = most = 0.0
    for k in range(n):
        x, y = corners[k, 0], corners[k, 1]
        along = math.sqrt(x * x + y * y)
        if along == 0.0:
            return 0.0, math.inf, 0.0, 0.0
        slope = corners[k, 2] / along
        low, high = min(low, slope), max(high, slope)
        turn = find_bin(x, y) - middle
        if turn > BINS / 2:
            turn -= BINS
        elif turn < -BINS / 2:
            turn += BINS
        least, most = min(least, turn), max(most, turn)
    if most - least > _QUARTER:
        return 0.0, math.inf, 0.0, 0.0
    # An arc rises above its ends by no more than the cosine of half its angle; a bin has at most
    # 8 / BINS, and a cosine is no less than the first two terms of its series.
    half = (most - least) * (4.0 / BINS)
    high *= (1.0 + CLEAR) / (1.0 - half * half / 2.0)
    return low * (1.0 - CLEAR), high, middle + least + BINS, middle + most + BINS


@borrowing
def find_layer(reaches, near):
    """Return the layer of covers by what is nearer than a distance; -1 for none."""
    layer = reaches.size - 1
    while layer >= 0 and reaches[layer] > near:
        layer -= 1
    return layer


@borrowing
def is_box_hidden(covers, reaches, box, p):
    """Return whether a box (6,) lies within what is known to be covered by what is nearer."""
    low_x, low_y, high_x, high_y = box[0] - p[0], box[1] - p[1], box[3] - p[0], box[4] - p[1]
    near_x, near_y = max(low_x, -high_x, 0.0), max(low_y, -high_y, 0.0)
    near = math.sqrt(near_x * near_x + near_y * near_y)
    layer = find_layer(reaches, near)
    if near == 0.0 or layer < 0:
        return False
    # The corners at both ends, as seen from the point, by the sides of the box where it lies.
    first_x = last_x = low_x if low_x > 0.0 else high_x
    first_y = last_y = low_y if low_y > 0.0 else high_y
    if low_y > 0.0:
        first_x, last_x = high_x, low_x
    elif high_y < 0.0:
        first_x, last_x = low_x, high_x
    if low_x > 0.0:
        first_y, last_y = low_y, high_y
    elif high_x < 0.0:
        first_y, last_y = high_y, low_y
    start, end = find_bin(first_x, first_y), find_bin(last_x, last_y)
    if end < start:
        end += BINS
    if end - start > _QUARTER:
        return False
    far_x, far_y = max(-low_x, high_x), max(-low_y, high_y)
    far = math.sqrt(far_x * far_x + far_y * far_y)
    low, high = (box[2] - p[2]) / far, (box[5] - p[2]) / near
    return is_covered(covers[layer], start, end, low, high)


@inlined
def is_box_out(box, p, normal):
    """Return whether a box (6,) lies below a point's horizon or behind its plane."""
    if box[5] <= p[2]:
        return True
    most = 0.0
    for k in range(3):
        most += normal[k] * ((box[k + 3] if normal[k] > 0.0 else box[k]) - p[k])
    return most <= 0.0


@kernel
def find_near_boxes(boxes, p, normal):
    """Find the boxes (n, 6) above a point's horizon and before its plane, near ones first."""
    near, which = np.empty(boxes.shape[0]), np.empty(boxes.shape[0], np.int32)
    n = 0
    for k in range(boxes.shape[0]):
        box = boxes[k]
        if not is_box_out(box, p, normal):
            x = max(box[0] - p[0], p[0] - box[3], 0.0)
            y = max(box[1] - p[1], p[1] - box[4], 0.0)
            near[n], which[n] = x * x + y * y, k
            n += 1
    return which[np.argsort(near[:n])]
