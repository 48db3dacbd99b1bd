"""
A lower bound of a point's skyline, from vertical walls, that tells what cannot bound the free sky.

The turn is cut into bins. In each, everything up to a height (the tangent of an altitude) is known
to be covered: where strips of walls cross the bin, and where they meet in it. What lies below that
height in all its bins is left out of the sweep, which starts there instead of at the horizon.
"""

import math

import numpy as np

from umbra.kernels import borrowing, copy_numbers, inlined, kernel

__all__ = [
    "BINS", "CLEAR", "STRIPS", "find_bin", "find_highest", "find_layer", "find_skyline",
    "find_skylines", "is_box_hidden", "look_along",
]  # fmt: skip

BINS = 1024
"""Bins of the turn."""
STRIPS = 16
"""Strips that one box bounds."""
_QUARTER = BINS // 4
_CURVED = 1.00001  # how far an arc rises above its ends within a bin
_MEET = 1e-7  # of a bin: where two strips meet
CLEAR = 1e-9
"""Share of what is hidden that is left out, for rounding."""


@inlined
def find_bin(x, y):
    """Return the place of a direction in the turn, 0 to ``BINS``: monotonic, without an angle."""
    size = abs(x) + abs(y)
    if size == 0.0:
        return 0.0
    share = x / size
    return _QUARTER * (1.0 - share if y >= 0.0 else 3.0 + share)


@inlined
def look_along(column):
    """Return the direction of a bin's first side, not of unit length."""
    quarter, rest = column // _QUARTER, (column % _QUARTER) / _QUARTER
    if quarter == 0:
        return 1.0 - rest, rest
    if quarter == 1:
        return -rest, 1.0 - rest
    if quarter == 2:
        return rest - 1.0, -rest
    return rest, rest - 1.0


@borrowing
def _is_hidden(skyline, first, last, slope):
    """Return whether all bins from first to last, which may pass the turn, reach above a slope."""
    for b in range(first, last + 1):
        if skyline[b % BINS] <= slope:
            return False
    return True


@borrowing
def find_layer(reaches, near):
    """Return the layer of skylines of what is nearer than a distance; -1 for none."""
    layer = reaches.size - 1
    while layer >= 0 and reaches[layer] > near:
        layer -= 1
    return layer


@borrowing
def is_box_hidden(skylines, reaches, box, p):
    """Return whether a box (6,) lies below the skyline of what is nearer to a point."""
    low_x, low_y, high_x, high_y = box[0] - p[0], box[1] - p[1], box[3] - p[0], box[4] - p[1]
    near_x = max(low_x, -high_x, 0.0)
    near_y = max(low_y, -high_y, 0.0)
    near = math.hypot(near_x, near_y)
    layer = find_layer(reaches, near)
    if near == 0.0 or layer < 0:
        return False
    slope = (box[5] - p[2]) / near * (1.0 + CLEAR)
    middle = find_bin((low_x + high_x) / 2, (low_y + high_y) / 2)
    least = most = 0.0
    for k in range(4):
        turn = find_bin(low_x if k & 1 else high_x, low_y if k & 2 else high_y) - middle
        turn -= BINS * round(turn / BINS)
        least, most = min(least, turn), max(most, turn)
    if most - least > _QUARTER:
        return False
    first = math.floor(middle + least - _MEET) + BINS
    last = math.floor(middle + most + _MEET) + BINS
    return _is_hidden(skylines[layer], first, last, slope)


@borrowing
def find_highest(skyline, corners, n, may_hide):
    """
    Bound the tangent of the altitude of a convex polygon from above; -1 if it is hidden.

    Given by ``n`` corners relative to the point; hidden is what lies below the point's skyline,
    if it ``may_hide`` this.
    """
    slope = 0.0
    middle = find_bin(corners[0, 0], corners[0, 1])
    least = most = 0.0
    for k in range(n):
        x, y, z = corners[k, 0], corners[k, 1], corners[k, 2]
        along = math.hypot(x, y)
        if along == 0.0:
            return math.inf
        slope = max(slope, z / along)
        turn = find_bin(x, y) - middle
        turn -= BINS * round(turn / BINS)
        least, most = min(least, turn), max(most, turn)
    if most - least > _QUARTER:
        return math.inf
    # An arc rises above its ends by the cosine of half its angle, at most this:
    slope *= (1.0 + CLEAR) / math.cos((most - least) * (4.0 / BINS))
    first = math.floor(middle + least - _MEET) + BINS
    last = math.floor(middle + most + _MEET) + BINS
    return -1.0 if may_hide and _is_hidden(skyline, first, last, slope) else slope


@kernel
def find_skylines(strips, boxes, p, nearest):
    """
    Find the skylines of what is nearer than some distances, ``nearest`` and its doubles.

    Returns them, (n, BINS), and the distances (n,) [m].
    """
    far = nearest
    for b in range(boxes.shape[0]):
        for k in range(2):
            far = max(far, abs(boxes[b, k] - p[k]), abs(boxes[b, 3 + k] - p[k]))
    n = 1 + math.ceil(math.log2(far / nearest))
    skylines, reaches = np.zeros((n, BINS)), np.zeros(n)
    for k in range(n):
        reaches[k] = nearest * 2.0**k
        copy_numbers(find_skyline(strips, boxes, p, reaches[k]), skylines[k])
    return skylines, reaches


@kernel
def find_skyline(strips, boxes, p, farthest):
    """
    Find up to which slope each bin is covered from the horizon on, (BINS,), 0 where unknown.

    Parameters
    ----------
    strips : (n, 8) float64
        From ``find_strips``.
    boxes : (m, 6) float64
        Around each ``STRIPS`` of them.
    p : (3,) float64
    farthest : float
        Only strips within this horizontal distance [m].
    """
    alone, always = np.zeros((1, BINS)), np.zeros(1)
    skyline = alone[0]
    # Of each bin what covers it from its first side to a place, and from a place to its last side.
    first_part, last_part = np.zeros((BINS, 2)), np.zeros((BINS, 2))
    for b in range(BINS):
        last_part[b, 0] = 1.0
    distance = np.empty(boxes.shape[0])
    for b in range(boxes.shape[0]):
        x = max(boxes[b, 0] - p[0], p[0] - boxes[b, 3], 0.0)
        y = max(boxes[b, 1] - p[1], p[1] - boxes[b, 4], 0.0)
        distance[b] = x * x + y * y if boxes[b, 5] > p[2] else np.inf
        far_x = max(abs(boxes[b, 0] - p[0]), abs(boxes[b, 3] - p[0]))
        far_y = max(abs(boxes[b, 1] - p[1]), abs(boxes[b, 4] - p[1]))
        if math.hypot(far_x, far_y) > farthest:
            distance[b] = np.inf
    for b in np.argsort(distance):
        if distance[b] == np.inf:
            break
        if is_box_hidden(alone, always, boxes[b], p):
            continue
        for s in range(b * STRIPS, min(strips.shape[0], (b + 1) * STRIPS)):
            _add_strip(strips[s], p, skyline, first_part, last_part)
    return skyline


@borrowing
def _add_strip(strip, p, skyline, first_part, last_part):
    """Raise the skyline by a strip of wall."""
    ax, ay, az = strip[0] - p[0], strip[1] - p[1], strip[2] - p[2]
    bx, by, bz = strip[3] - p[0], strip[4] - p[1], strip[5] - p[2]
    level = max(strip[6] - p[2], 0.0)
    if az <= level and bz <= level:
        return
    turn = ax * by - ay * bx
    if abs(turn) <= strip[7] * math.hypot(bx - ax, by - ay):
        return
    if turn < 0.0:
        ax, ay, az, bx, by, bz = bx, by, bz, ax, ay, az
    start, end = find_bin(ax, ay), find_bin(bx, by)
    if end < start:
        end += BINS
    first, last = math.ceil(start), math.floor(end)
    if first > last:
        return
    before_top, before_low = az / math.hypot(ax, ay), level / math.hypot(ax, ay)
    for column in range(first, last + 2):
        if column <= last:
            dx, dy = look_along(column % BINS)
            u, v = dx * ay - dy * ax, dx * by - dy * bx
            share = min(max(u / (u - v), 0.0), 1.0) if u != v else 0.0
            along = dx * (ax + share * (bx - ax)) + dy * (ay + share * (by - ay))
            along /= math.hypot(dx, dy)
            top, low = (az + share * (bz - az)) / along, level / along
        else:
            along = math.hypot(bx, by)
            top, low = bz / along, level / along
        b = (column - 1) % BINS
        slope = min(before_top, top) * (1.0 - CLEAR)  # so that the wall itself is above it
        if slope > skyline[b] and max(before_low, low) * _CURVED <= skyline[b]:
            from_, to = 0.0, 1.0
            if column == first:
                from_ = start - (column - 1)
            if column > last:
                to = end - (column - 1)
            _cover_bin(b, from_, to, slope, skyline, first_part, last_part)
        before_top, before_low = top, low


@borrowing
def _cover_bin(b, start, end, slope, skyline, first_part, last_part):
    """Cover a bin, or its first or last part, up to a slope."""
    if start <= _MEET and end >= 1.0 - _MEET:
        skyline[b] = slope
        return
    if start <= _MEET:
        part = first_part[b]
        if end * slope > part[0] * part[1]:
            part[0], part[1] = end, slope
    else:
        part = last_part[b]
        if (1.0 - start) * slope > (1.0 - part[0]) * part[1]:
            part[0], part[1] = start, slope
    if first_part[b, 0] >= last_part[b, 0] - _MEET:
        skyline[b] = max(skyline[b], min(first_part[b, 1], last_part[b, 1]))
