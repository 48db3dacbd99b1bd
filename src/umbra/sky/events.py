"""
Azimuths at which the order of silhouette edges on a meridian may change.

These are the ends of the edges that can bound the free sky and their crossings, the azimuths of the
receiver's plane on the horizon, and the four quarters. Between two of them no such edge starts,
ends or crosses another.
"""

import math

import numpy as np

from umbra.kernels import borrowing, copy_numbers, copy_rows, inner, kernel
from umbra.sky.skyline import BINS, find_bin, find_outline, find_turn, is_covered

__all__ = ["find_events", "find_spans"]

_SAME = 1e-13
"""Sine of an angle between two azimuths that are one."""
_MARGIN = 1e-6  # of spans, for rounding [bins]


@borrowing
def _add_span(spans, owner, n, start, end, which):
    """Add a range of places in the turn from -pi, in two where it passes pi; return the number."""
    start, end = start - _MARGIN, end + _MARGIN
    if end - start >= BINS:
        start, end = 0.0, float(BINS)
    # Places of outlines count from azimuth 0, and may be anywhere in three turns.
    turns = BINS * math.floor((start + BINS / 2) / BINS)
    start, end = start + BINS / 2 - turns, end + BINS / 2 - turns
    spans[n, 0], spans[n, 1], owner[n] = start, min(end, BINS), which
    n += 1
    if end > BINS:
        spans[n, 0], spans[n, 1], owner[n] = 0.0, end - BINS, which
        n += 1
    return n


@kernel
def find_spans(seen):
    """
    Find where in the turn faces are, see ``find_turn``: spans (m, 2) sorted by their start.

    And the face of each (m,). A face that passes azimuth pi has two.
    """
    n = seen.size.size
    spans = np.empty((2 * n, 2))
    owner = np.empty(2 * n, np.int32)
    m = 0
    for i in range(n):
        start, end = seen.bounds[i, 2], seen.bounds[i, 3]
        if seen.bounds[i, 1] == math.inf:
            start, end = 0.0, float(BINS)
        m = _add_span(spans, owner, m, start, end, i)
    order = _order(spans[:m])
    return spans[order], owner[order]


@kernel
def find_events(seen, normal, is_asked, cover):
    """
    Return the azimuths as unit vectors (n, 2), from -pi to pi, first and last the same.

    ``is_asked`` (n_edges,) says which edges count besides the silhouette; those that ``cover``
    (BINS, 6) hides do not.
    """
    n = seen.size.size
    n_edges = 0
    for i in range(n):
        for k in range(seen.size[i]):
            n_edges += _counts(seen, is_asked, i, k)
    ends = np.empty((n_edges, 2, 3))
    turns, slopes = np.empty((n_edges, 3)), np.empty((n_edges, 2))
    spans = np.empty((2 * n_edges, 2))
    owner = np.empty(2 * n_edges, np.int32)
    events = np.empty((2 * n_edges + 64, 3))  # place in the turn, unit vector
    count = 0
    for x, y in ((1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        count = _add_event(events, count, x, y)
    if normal[0] != 0.0 or normal[1] != 0.0:
        count = _add_event(events, count, normal[1], -normal[0])
        count = _add_event(events, count, -normal[1], normal[0])
    pair = np.empty((2, 3))
    e = m = 0
    for i in range(n):
        for k in range(seen.size[i]):
            if not _counts(seen, is_asked, i, k):
                continue
            after = k + 1 if k + 1 < seen.size[i] else 0
            a, b = seen.corners[i, k], seen.corners[i, after]
            copy_numbers(a, pair[0])
            copy_numbers(b, pair[1])
            low, high, start, end = find_outline(pair, 2)
            if is_covered(cover, start, end, low, high):
                continue
            count = _add_event(events, count, a[0], a[1])
            count = _add_event(events, count, b[0], b[1])
            turn = a[0] * b[1] - a[1] * b[0]
            if turn == 0.0:
                continue
            if turn < 0.0:
                a, b = b, a
            copy_numbers(a, ends[e, 0])
            copy_numbers(b, ends[e, 1])
            turns[e, 0] = a[1] * b[2] - a[2] * b[1]
            turns[e, 1] = a[2] * b[0] - a[0] * b[2]
            turns[e, 2] = abs(turn)
            if high == math.inf:
                start, end = find_bin(a[0], a[1]), find_bin(b[0], b[1])
                end += BINS if end < start else 0
            slopes[e, 0], slopes[e, 1] = low, high
            m = _add_span(spans, owner, m, start, end, e)
            e += 1
    order = _order(spans[:m])
    active = np.empty(m, np.int32)
    n_active = 0
    for which in order:
        n_left = 0
        for q in range(n_active):
            if spans[active[q], 1] >= spans[which, 0]:
                active[n_left] = active[q]
                n_left += 1
        n_active = n_left
        for q in range(n_active):
            i, k = owner[which], owner[active[q]]
            if slopes[i, 0] > slopes[k, 1] or slopes[k, 0] > slopes[i, 1]:
                continue
            x, y = _cross(ends, turns, i, k)
            if x != 0.0 or y != 0.0:
                if count + 4 > events.shape[0]:
                    more = np.empty((2 * events.shape[0], 3))
                    copy_rows(events[:count], more)
                    events = more
                count = _add_event(events, count, x, y)
        active[n_active] = which
        n_active += 1
    return _sort(events[:count])


@borrowing
def _counts(seen, is_asked, i, k):
    key = seen.edge[i, k]
    return key >= 0 and (seen.sides[key] != 3 or is_asked[key])


@borrowing
def _add_event(events, count, x, y):
    length = math.hypot(x, y)
    if length == 0.0:
        return count
    events[count, 0] = find_turn(x, y)
    events[count, 1], events[count, 2] = x / length, y / length
    return count + 1


@borrowing
def _side(turn, point):
    return turn[0] * point[0] + turn[1] * point[1] + turn[2] * point[2]


@borrowing
def _cross(ends, turns, first, second):
    """Return the horizontal direction in which two edges cross; 0 if they do not."""
    if (_side(turns[first], ends[second, 0]) > 0.0) == (_side(turns[first], ends[second, 1]) > 0.0):
        return 0.0, 0.0
    if (_side(turns[second], ends[first, 0]) > 0.0) == (_side(turns[second], ends[first, 1]) > 0.0):
        return 0.0, 0.0
    a, b = turns[first], turns[second]
    x, y = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]
    up = a[0] * b[1] - a[1] * b[0]
    return (x, y) if up > 0.0 else (-x, -y)


@inner
def _order(rows):
    """Sort rows by their first number."""
    first = np.empty(rows.shape[0])  # not a column: sorting is compiled for each layout
    for i in range(rows.shape[0]):
        first[i] = rows[i, 0]
    return np.argsort(first)


@inner
def _sort(events):
    """Sort events, drop the same ones, and close the turn at -pi."""
    order = _order(events)
    distinct = np.empty((events.shape[0] + 2, 2))
    distinct[0, 0], distinct[0, 1] = -1.0, 0.0
    n = 1
    for which in order:
        x, y = events[which, 1], events[which, 2]
        if abs(distinct[n - 1, 0] * y - distinct[n - 1, 1] * x) > _SAME and x > -1.0:
            distinct[n, 0], distinct[n, 1] = x, y
            n += 1
    # The last may be as near to the end as those that were dropped.
    if n > 1 and abs(distinct[n - 1, 1]) <= _SAME and distinct[n - 1, 0] < 0.0:
        n -= 1
    distinct[n, 0], distinct[n, 1] = -1.0, 0.0
    return distinct[: n + 1]
