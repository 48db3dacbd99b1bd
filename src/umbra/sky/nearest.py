"""
What is nearest in each direction that is not free: the sweep for the objects behind the outlines.

As for the free sky, but every edge between objects is an event, and each interval of a meridian
goes to the nearest face in it. Exact where objects do not pass through one another; where they do,
the line in which they cross is taken as straight within a slice.
"""

import math

import numpy as np

from umbra.kernels import borrowing, kernel
from umbra.sky.events import find_spans
from umbra.sky.gather import HORIZON, PLANE
from umbra.sky.meridians import ZENITH, cut_face, find_slope
from umbra.sky.skyline import GAP, find_turn
from umbra.sky.sweep import place_bound
from umbra.sky.tensors import add_arc

__all__ = ["add_shares", "find_hits"]

_FREE = -1
_BEHIND = -2


@borrowing
def find_distance(seen, casters, i, x, y, z):
    """Return the distance along a direction (x, y, z) to a seen face; inf if level to it."""
    plane = casters.planes[seen.face[i]]
    corner = seen.corners[i, 0]
    up = plane[0] * corner[0] + plane[1] * corner[1] + plane[2] * corner[2]
    toward = plane[0] * x + plane[1] * y + plane[2] * z
    return up / toward if toward != 0.0 else math.inf


@kernel
def add_shares(seen, casters, normal, events, moments, bands):
    """
    Add the moments of what each object takes, (n_objects, 7).

    Returns how many bands there are; those for which there is room are written to ``bands``
    (m, 10): the object, the slice, the lower edge at both meridians (along, up), and the upper.
    """
    spans, owner = find_spans(seen)
    n_faces, n_spans = seen.size.size, owner.size
    active, cut = np.empty(n_spans + 1, np.int32), np.empty(n_faces + 1, np.int32)
    low, high = np.empty(n_faces + 1), np.empty(n_faces + 1)
    marks = np.empty(2 * n_faces + 4)
    codes = np.empty(2 * n_faces + 4, np.int32)
    stamp = np.full(n_faces + 1, -1, np.int64)
    n_active = waiting = count = 0
    for s in range(events.shape[0] - 1):
        ax, ay, bx, by = events[s, 0], events[s, 1], events[s + 1, 0], events[s + 1, 1]
        length = math.hypot(ax + bx, ay + by)
        dx, dy = (ax + bx) / length, (ay + by) / length
        place = find_turn(dx, dy)
        while waiting < n_spans and spans[waiting, 0] <= place:
            active[n_active] = waiting
            n_active += 1
            waiting += 1
        marks[0], codes[0] = 0.0, HORIZON
        m, n_left, n_cut = 1, 0, 0
        for q in range(n_active):
            span = active[q]
            if spans[span, 1] < place:
                continue
            active[n_left] = span
            n_left += 1
            i = owner[span]
            if stamp[i] == s:
                continue
            stamp[i] = s
            lower, upper, p, r = cut_face(seen.corners[i], seen.size[i], dx, dy)
            if lower == math.inf:
                continue
            low[i], high[i] = lower, upper
            cut[n_cut] = i
            n_cut += 1
            marks[m], codes[m] = lower, _find_code(seen, i, p)
            marks[m + 1], codes[m + 1] = upper, _find_code(seen, i, r)
            m += 2
        n_active = n_left
        behind_from, behind_to = find_slope(normal, dx, dy)
        if behind_from < math.inf:
            marks[m], codes[m] = behind_from, PLANE if behind_from > 0.0 else HORIZON
            marks[m + 1], codes[m + 1] = behind_to, PLANE if behind_to < math.inf else ZENITH
            m += 2
        marks[m], codes[m] = math.inf, ZENITH
        m += 1
        order = np.argsort(marks[:m])
        # Of neighbouring intervals that one object takes only the outer edges matter.
        last, code = _BEHIND, HORIZON
        for q in range(m):
            here = order[q]
            label = _BEHIND
            if q + 1 < m:
                lower, upper = marks[here], marks[order[q + 1]]
                if not (upper - lower > GAP * (1.0 + lower * upper) or (lower < upper == math.inf)):
                    continue
                label = _find_label(
                    seen,
                    casters,
                    cut,
                    n_cut,
                    low,
                    high,
                    lower,
                    upper,
                    dx,
                    dy,
                    behind_from,
                    behind_to,
                )
            if label == last:
                continue
            bound = codes[here]
            if last >= 0:
                a0, a1 = place_bound(seen, bound, normal, ax, ay)
                b0, b1 = place_bound(seen, bound, normal, bx, by)
                c0, c1 = place_bound(seen, code, normal, ax, ay)
                d0, d1 = place_bound(seen, code, normal, bx, by)
                add_arc(c0, c1, d0, d1, ax, ay, bx, by, 1.0, moments[last])
                if bound != ZENITH:
                    add_arc(a0, a1, b0, b1, ax, ay, bx, by, -1.0, moments[last])
                if count < bands.shape[0]:
                    row = bands[count]
                    row[0], row[1] = last, s
                    row[2], row[3], row[4], row[5] = c0, c1, d0, d1
                    row[6], row[7], row[8], row[9] = a0, a1, b0, b1
                count += 1
            last, code = label, bound
    return count


@borrowing
def _find_code(seen, i, k):
    """Return the code of an edge; where a face is cut, its neighbours go on along the cut."""
    if k < 0:
        return ZENITH
    return seen.edge[i, k] if seen.edge[i, k] < 0 else i << 3 | k


@borrowing
def _find_label(seen, casters, cut, n_cut, low, high, lower, upper, dx, dy, from_, to):
    """Return the object nearest in the middle of an interval, or that nothing is there."""
    top = math.pi / 2 if upper == math.inf else math.atan(upper)
    middle = (math.atan(lower) + top) / 2
    x, y, z = dx * math.cos(middle), dy * math.cos(middle), math.sin(middle)
    slope = math.tan(middle)
    if from_ < slope < to:
        return _BEHIND
    best, nearest = -1, math.inf
    for q in range(n_cut):
        i = cut[q]
        if low[i] < slope < high[i]:
            away = find_distance(seen, casters, i, x, y, z)
            if away < nearest:
                best, nearest = i, away
    return casters.part[seen.face[best]] if best >= 0 else _FREE


@kernel
def find_hits(seen, casters, directions):
    """Return the object nearest in each direction (n, 3), or -1 where the sky is free, (n,)."""
    objects = np.full(directions.shape[0], -1, np.int32)
    away = np.full(directions.shape[0], np.inf)
    for i in range(seen.size.size):
        n = seen.size[i]
        for k in range(directions.shape[0]):
            w = directions[k]
            is_left = is_right = True
            for c in range(n):
                a, b = seen.corners[i, c], seen.corners[i, c + 1 if c + 1 < n else 0]
                side = w[0] * (a[1] * b[2] - a[2] * b[1])
                side += w[1] * (a[2] * b[0] - a[0] * b[2]) + w[2] * (a[0] * b[1] - a[1] * b[0])
                is_left &= side >= 0.0
                is_right &= side <= 0.0
                if not (is_left or is_right):
                    break
            if is_left or is_right:
                distance = find_distance(seen, casters, i, w[0], w[1], w[2])
                if 0.0 < distance < away[k]:
                    away[k], objects[k] = distance, casters.part[seen.face[i]]
    return objects
