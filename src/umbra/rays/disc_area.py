"""
The area of the unit disc that polygons leave free, in closed form.

The disc is cut into slabs at all corners and crossings of sides: in each the free part of every
level line is bounded by the same sides and arcs, whose areas have closed forms.
"""

import math

from umbra.kernels import borrowing, inlined

__all__ = ["find_disc_side", "integrate_disc"]

_IN = 1.0 + 1e-9  # square of the radius within which places count


@borrowing
def integrate_disc(sides, sizes, count, heights, spans):
    """Return the share of the unit disc that no polygon covers; below 0 with too many crossings."""
    n = _list_heights(sides, sizes, count, heights)
    if n == heights.size:
        return -1.0
    for i in range(count):
        spans[i, 4], spans[i, 5] = math.inf, -math.inf
        for k in range(sizes[i]):
            spans[i, 4] = min(spans[i, 4], sides[i, k, 1])
            spans[i, 5] = max(spans[i, 5], sides[i, k, 1])
    free = 0.0
    for q in range(n - 1):
        low, high = heights[q], heights[q + 1]
        if not high > low:
            continue
        y = 0.5 * (low + high)
        round_ = _measure_arc(high) - _measure_arc(low)
        half = math.sqrt(max(1.0 - y * y, 0.0))
        m = 0
        for i in range(count):
            if spans[i, 4] > y or spans[i, 5] < y:
                continue
            left, right = _cross(sides[i], sizes[i], y)
            left_round, right_round = left <= -half, right >= half
            if left >= right or right <= -half or left >= half:
                continue
            spans[m, 0] = -half if left_round else left
            spans[m, 1] = half if right_round else right
            spans[m, 2] = -round_ if left_round else left * (high - low)
            spans[m, 3] = round_ if right_round else right * (high - low)
            at = m
            while at > 0 and spans[at - 1, 0] > spans[at, 0]:
                for c in range(4):
                    spans[at - 1, c], spans[at, c] = spans[at, c], spans[at - 1, c]
                at -= 1
            m += 1
        reached, area = -half, -round_
        for i in range(m):
            if spans[i, 0] > reached:
                free += spans[i, 2] - area
            if spans[i, 1] > reached:
                reached, area = spans[i, 1], spans[i, 3]
        if reached < half:
            free += round_ - area
    return min(max(free / math.pi, 0.0), 1.0)


@inlined
def find_disc_side(corners, k, n):
    """
    Return a polygon's side from its nearer end: x, y, dx, dy, and -1 if that is its second end.

    The farther may be so far that differences from it have no digit left.
    """
    j = k + 1 if k + 1 < n else 0
    x0, y0, x1, y1 = corners[k, 0], corners[k, 1], corners[j, 0], corners[j, 1]
    if x0 * x0 + y0 * y0 <= x1 * x1 + y1 * y1:
        return x0, y0, x1 - x0, y1 - y0, 1.0
    return x1, y1, x0 - x1, y0 - y1, -1.0


@borrowing
def _measure_arc(y):
    """Return the integral of sqrt(1 - y^2) from 0 on."""
    y = min(max(y, -1.0), 1.0)
    return 0.5 * (y * math.sqrt(1.0 - y * y) + math.asin(y))


@borrowing
def _cross(corners, n, y):
    """Return from where to where a polygon covers the line at a height."""
    left, right = math.inf, -math.inf
    for k in range(n):
        j = k + 1 if k + 1 < n else 0
        y0, y1 = corners[k, 1], corners[j, 1]
        if (y0 > y) != (y1 > y):
            x0, y0, dx, dy, _ = find_disc_side(corners, k, n)
            x = x0 + (y - y0) / dy * dx
            left, right = min(left, x), max(right, x)
    return left, right


@borrowing
def _list_heights(sides, sizes, count, heights):
    """
    List the heights of all corners and crossings in the disc, rising; return their number.

    That of the array, if there is no room for more.
    """
    heights[0], heights[1] = -1.0, 1.0
    n = 2
    for i in range(count):
        for k in range(sizes[i]):
            n = _add_height(heights, n, sides[i, k, 0], sides[i, k, 1])
            x, y, dx, dy, _ = find_disc_side(sides[i], k, sizes[i])
            # Where the side passes the circle.
            a, b, c = dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - 1.0
            root = b * b - a * c
            if root <= 0.0 or a == 0.0:
                continue
            for sign in (-1.0, 1.0):
                t = (-b + sign * math.sqrt(root)) / a
                if 0.0 < t < 1.0:
                    n = _add_height(heights, n, 0.0, y + t * dy)
            for other in range(i):
                for q in range(sizes[other]):
                    ox, oy, ex, ey, _ = find_disc_side(sides[other], q, sizes[other])
                    ox, oy = ox - x, oy - y
                    turn = dx * ey - dy * ex
                    if turn == 0.0:
                        continue
                    t, w = (ox * ey - oy * ex) / turn, (ox * dy - oy * dx) / turn
                    if 0.0 < t < 1.0 and 0.0 < w < 1.0:
                        n = _add_height(heights, n, x + t * dx, y + t * dy)
    _sort(heights, n)
    return n


@borrowing
def _add_height(heights, n, x, y):
    """Add the height of a place in the disc, if there is room; return the number."""
    if n < heights.size and x * x + y * y < _IN:
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
