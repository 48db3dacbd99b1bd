"""
The area of the unit disc that polygons leave free, in closed form.

The disc is cut into slabs at all corners and crossings of sides: in each the free part of every
level line is bounded by the same sides and arcs, whose areas have closed forms. A place is free
where no polygon runs around it.
"""

import math

from umbra.kernels import borrowing, inlined

__all__ = ["integrate_disc"]

_IN = 1.0 + 1e-9  # square of the radius within which places count
_CROSSING = 384  # most sides that cross the disc


@borrowing
def integrate_disc(sides, count, enough):
    """
    Return the share of the unit disc that no polygon covers; below 0 with too many crossings.

    Of more than ``enough`` no more than that is certain.
    """
    lines, spans, heights = sides.lines, sides.crossings, sides.heights
    bounds = _keep_bounds(lines, count)
    n = _list_heights(lines, bounds, heights)
    if n == 2:  # no side crosses the disc: it is covered like its middle
        around = 0.0
        for i in range(bounds):
            if (lines[i, 1] > 0.0) != (lines[i, 4] > 0.0) and _cross(lines, i, 0.0) < 0.0:
                around += lines[i, 5]
        return 1.0 if around == 0.0 else 0.0
    if n == heights.size:
        return -1.0
    free = 0.0
    for q in range(n - 1):
        if free > enough * math.pi:
            break
        low, high = heights[q], heights[q + 1]
        if not high > low:
            continue
        y = 0.5 * (low + high)
        round_ = _measure_arc(high) - _measure_arc(low)
        half = math.sqrt(max(1.0 - y * y, 0.0))
        m, around = 0, 0.0
        for i in range(bounds):
            if (lines[i, 1] > y) == (lines[i, 4] > y):
                continue
            x = _cross(lines, i, y)
            if x >= half:
                continue
            if x <= -half:
                around += lines[i, 5]
                continue
            at = m
            while at > 0 and spans[at - 1, 0] > x:
                for c in range(3):
                    spans[at, c] = spans[at - 1, c]
                at -= 1
            spans[at, 0], spans[at, 1], spans[at, 2] = x, x * (high - low), lines[i, 5]
            m += 1
        area = -round_
        for i in range(m):
            if around == 0.0:
                free += spans[i, 1] - area
            around += spans[i, 2]
            area = spans[i, 1]
        if around == 0.0:
            free += round_ - area
    return min(max(free / math.pi, 0.0), 1.0)


@borrowing
def _keep_bounds(lines, count):
    """Move the sides that bound something to the front; return their number."""
    bounds = 0
    for i in range(count):
        if lines[i, 5] == 0.0:
            continue
        if bounds < i:
            for c in range(6):
                lines[bounds, c] = lines[i, c]
        bounds += 1
    return bounds


@borrowing
def _measure_arc(y):
    """Return the integral of sqrt(1 - y^2) from 0 on."""
    y = min(max(y, -1.0), 1.0)
    return 0.5 * (y * math.sqrt(1.0 - y * y) + math.asin(y))


@inlined
def _cross(lines, i, y):
    """Return where a side crosses the line at a height."""
    return lines[i, 0] + (y - lines[i, 1]) / lines[i, 3] * lines[i, 2]


@borrowing
def _list_heights(lines, count, heights):
    """
    List the heights of all corners and crossings in the disc, rising; return their number.

    That of the array, if there is no room for more. Sides that do not cross the disc are moved
    behind the others.
    """
    heights[0], heights[1] = -1.0, 1.0
    n, inside = 2, 0
    for i in range(count):
        x, y, dx, dy = lines[i, 0], lines[i, 1], lines[i, 2], lines[i, 3]
        # Where the side passes the circle.
        a, b, c = dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - 1.0
        root = b * b - a * c
        if root <= 0.0 or a == 0.0:
            continue
        root = math.sqrt(root)
        enter, leave = (-b - root) / a, (-b + root) / a
        if leave <= 0.0 or enter >= 1.0:
            continue
        if enter > 0.0:
            n = _add_height(heights, n, y + enter * dy)
        elif x * x + y * y < _IN:
            n = _add_height(heights, n, y)
        if leave < 1.0:
            n = _add_height(heights, n, y + leave * dy)
        else:
            n = _add_height(heights, n, lines[i, 4])
        for k in range(6):
            lines[i, k], lines[inside, k] = lines[inside, k], lines[i, k]
        x, y, dx, dy = lines[inside, 0], lines[inside, 1], lines[inside, 2], lines[inside, 3]
        for k in range(inside):
            ox, oy, ex, ey = lines[k, 0] - x, lines[k, 1] - y, lines[k, 2], lines[k, 3]
            turn = dx * ey - dy * ex
            if turn == 0.0:
                continue
            t, w = (ox * ey - oy * ex) / turn, (ox * dy - oy * dx) / turn
            if 0.0 < t < 1.0 and 0.0 < w < 1.0:
                px, py = x + t * dx, y + t * dy
                if px * px + py * py < _IN:
                    n = _add_height(heights, n, py)
        inside += 1
        if inside == _CROSSING:
            return heights.size
    if n > 2:
        _sort(heights, n)
    return n


@borrowing
def _add_height(heights, n, y):
    """Add a height, if there is room; return the number."""
    if n < heights.size:
        heights[n] = min(max(y, -1.0), 1.0)
        n += 1
    return n


@borrowing
def _sort(values, n):
    """Sort the first n values (Shell 1959)."""
    gap = n // 2
    while gap > 0:
        for i in range(gap, n):
            value, at = values[i], i
            while at >= gap and values[at - gap] > value:
                values[at] = values[at - gap]
                at -= gap
            values[at] = value
        gap //= 2
