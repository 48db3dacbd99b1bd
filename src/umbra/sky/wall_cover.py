"""What strips of vertical walls cover around a point: a first bound, found without any face."""

import math

import numpy as np

from umbra.kernels import borrowing, inlined, kernel
from umbra.sky.skyline import (
    BINS,
    BOXES,
    CURVED,
    MEET,
    NARROW,
    STRIPS,
    add_interval,
    find_bin,
    find_near_boxes,
    is_box_hidden,
    is_box_out,
    look_along,
    make_covers,
)

__all__ = ["cover_by_walls", "find_wall_covers"]

_TALLEST = 1e300  # of a part without width


@kernel
def find_wall_covers(casters, p, normal, nearest):
    """
    Find what walls nearer than some distances cover, ``nearest`` and its doubles.

    Returns the covers, (n, BINS, 6), and the distances (n,) [m].
    """
    boxes = casters.strip_box_boxes
    far = nearest
    for b in range(boxes.shape[0]):
        for k in range(2):
            far = max(far, abs(boxes[b, k] - p[k]), abs(boxes[b, 3 + k] - p[k]))
    n = 1 + math.ceil(math.log2(far / nearest))
    covers, reaches = make_covers(n), np.zeros(n)
    for k in range(n):
        reaches[k] = nearest * 2.0**k
        cover_by_walls(casters, p, normal, reaches[k], covers[k : k + 1])
    return covers, reaches


@kernel
def cover_by_walls(casters, p, normal, farthest, covers):
    """
    Add what walls cover before a plane to a cover.

    Parameters
    ----------
    casters : SkyCasters
    p, normal : (3,) float64
        The point, and its plane's normal.
    farthest : float
        Only walls within this horizontal distance, by boxes of their strips [m].
    covers : (1, BINS, 6) float64
        See ``make_covers``.
    """
    always = np.zeros(1)
    # Of each bin what covers it from its first side to a place, and from a place to its last side:
    # the place, and tangents from and to.
    parts = np.zeros((BINS, 2, 3))
    for b in range(BINS):
        parts[b, 1, 0] = 1.0
        parts[b, 0, 2] = parts[b, 1, 2] = _TALLEST
    boxes = casters.strip_boxes
    for group in find_near_boxes(casters.strip_box_boxes, p, normal):
        around = casters.strip_box_boxes[group]
        if _is_beyond(around, p, farthest):
            break
        if is_box_hidden(covers, always, around, p):
            continue
        for b in range(group * BOXES, min(boxes.shape[0], (group + 1) * BOXES)):
            if _is_far(boxes[b], p, farthest) or is_box_out(boxes[b], p, normal):
                continue
            if is_box_hidden(covers, always, boxes[b], p):
                continue
            for s in range(b * STRIPS, min(casters.strips.shape[0], (b + 1) * STRIPS)):
                _add_strip(casters.strips[s], p, covers[0], parts)


@inlined
def _is_beyond(box, p, farthest):
    """Return whether all of a box (6,) is farther from a point than a distance, horizontally."""
    x, y = max(box[0] - p[0], p[0] - box[3], 0.0), max(box[1] - p[1], p[1] - box[4], 0.0)
    return x * x + y * y > farthest * farthest


@inlined
def _is_far(box, p, farthest):
    """Return whether some of a box (6,) is farther from a point than a distance, horizontally."""
    far_x, far_y = max(p[0] - box[0], box[3] - p[0]), max(p[1] - box[1], box[4] - p[1])
    return far_x * far_x + far_y * far_y > farthest * farthest


@borrowing
def _add_strip(strip, p, cover, parts):
    """Add a strip of wall."""
    ax, ay, az = strip[0] - p[0], strip[1] - p[1], strip[2] - p[2]
    bx, by, bz = strip[3] - p[0], strip[4] - p[1], strip[5] - p[2]
    level = max(strip[6] - p[2], 0.0)
    if az <= level and bz <= level:
        return
    turn = ax * by - ay * bx
    if turn < 0.0:
        ax, ay, az, bx, by, bz, turn = bx, by, bz, ax, ay, az, -turn
    if turn <= strip[7] * math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay)):
        return
    start, end = find_bin(ax, ay), find_bin(bx, by)
    if end < start:
        end += BINS
    first, last = math.ceil(start), math.floor(end)
    if first > last:
        return
    size_a, size_b = math.sqrt(ax * ax + ay * ay), math.sqrt(bx * bx + by * by)
    if turn <= NARROW * (size_a + abs(az)) * (size_b + abs(bz)):
        return
    # The wall's distance along a direction d is turn / (d x (b - a)), its top there a sinusoid.
    top_x, top_y = (az * by - ay * bz) / turn, (ax * bz - az * bx) / turn
    low_x, low_y = level * (by - ay) / turn, level * (ax - bx) / turn
    before_top, before_low = az / size_a, level / size_a
    for column in range(first, last + 2):
        if column <= last:
            dx, dy = look_along(column)
            top, low = top_x * dx + top_y * dy, low_x * dx + low_y * dy
        else:
            top, low = bz / size_b, level / size_b
        b = (column - 1) & (BINS - 1)
        if column == first or column > last:
            from_ = start - (column - 1) if column == first else 0.0
            to = end - (column - 1) if column > last else 1.0
            lowest = max(before_low, low) * CURVED
            _cover_part(cover[b], parts[b], from_, to, lowest, min(before_top, top))
        else:
            add_interval(cover[b], before_low, low, before_top, top, True)
        before_top, before_low = top, low


@borrowing
def _cover_part(row, parts, start, end, low, high):
    """Cover a bin (6,), or its first or last part (2, 3), between two tangents."""
    if start <= MEET:
        part = parts[0]
        if end * (high - low) > part[0] * (part[2] - part[1]):
            part[0], part[1], part[2] = end, low, high
    else:
        part = parts[1]
        if (1.0 - start) * (high - low) > (1.0 - part[0]) * (part[2] - part[1]):
            part[0], part[1], part[2] = start, low, high
    if parts[0, 0] < parts[1, 0] - MEET:
        return
    low, high = max(parts[0, 1], parts[1, 1]), min(parts[0, 2], parts[1, 2]) / CURVED
    add_interval(row, low, low, high, high, True)
