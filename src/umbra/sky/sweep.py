"""
The free sky of a point as pieces between meridians: the sweep.

Between two neighbouring events the edges that can bound the free sky keep their order, so the faces
on one meridian there, as intervals of altitude, tell which edges bound what is free in the whole
slice. A piece is what lies between a lower and an upper edge in one slice. Intervals are united as
they lie, so coincident walls, T-junctions and faces wound in any way are no cases of their own, and
rounding can only move an edge by itself, never lose a piece.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, copy_numbers, copy_rows, kernel
from umbra.sky.gather import HORIZON, PLANE
from umbra.sky.meridians import ZENITH, cut_edge, cut_face, cut_plane, find_slope
from umbra.sky.skyline import GAP, find_cover_along, find_turn
from umbra.sky.tensors import add_arc

__all__ = ["COVER", "Pieces", "find_pieces", "integrate", "is_on_cover", "place_bound"]

COVER = -4
"""The bound of what is known to be covered, on which no face went on: see ``is_on_cover``."""

_LEADS = 32  # faces that are tried first


class Pieces(NamedTuple):
    """
    Pieces of the free sky, each between two meridians.

    Parameters
    ----------
    slice : (n,) int32
        Number of the slice: between events k and k + 1.
    below, above : (n, 4) float64
        Horizontal and vertical part of the unit vectors of the edge below, and above, at the first
        and at the second meridian.
    under, over : (n,) int32
        What bounds it: ``face << 3 | edge`` of the seen faces, ``HORIZON``, ``PLANE``, ``ZENITH``,
        ``COVER``.
    events : (n_events, 2) float64
        Unit vectors of the azimuths, counter-clockwise from -x round to -x.
    """

    slice: NDArray[np.int32]
    below: NDArray[np.float64]
    above: NDArray[np.float64]
    under: NDArray[np.int32]
    over: NDArray[np.int32]
    events: NDArray[np.float64]


@borrowing
def place_bound(seen, code, normal, dx, dy):
    """Return the unit vector (along, up) of a bound on a meridian."""
    if code in (HORIZON, COVER):
        return 1.0, 0.0
    if code == ZENITH:
        return 0.0, 1.0
    if code == PLANE:
        return cut_plane(normal, dx, dy)
    i, k = code >> 3, code & 7
    after = k + 1 if k + 1 < seen.size[i] else 0
    return cut_edge(seen.corners[i, k], seen.corners[i, after], dx, dy)


@kernel
def find_pieces(seen, normal, events, spans, owner, cover):
    """
    Find the pieces of the free upper sky before a plane.

    ``seen`` is a ``SeenFaces``, ``events`` from ``find_events``, ``spans`` and ``owner`` from
    ``find_spans``, ``cover`` (BINS, 6) what is known to be covered.
    """
    n_faces = seen.size.size
    room = 2 * events.shape[0] + 16
    which = np.empty(room, np.int32)
    below, above = np.empty((room, 4)), np.empty((room, 4))
    under, over = np.empty(room, np.int32), np.empty(room, np.int32)
    count = 0
    n_spans = owner.size
    active, cut = np.empty(n_spans + 1, np.int32), np.empty(n_spans + 2, np.int32)
    wide = n_faces + 1  # of several faces; n_faces is the plane
    low, high = np.empty(n_faces + 2), np.empty(n_faces + 2)
    low_code, high_code = np.empty(n_faces + 2, np.int32), np.empty(n_faces + 2, np.int32)
    stamp = np.full(n_faces + 1, -1, np.int64)
    low_code[n_faces] = high_code[n_faces] = PLANE
    lead, now = np.empty(_LEADS, np.int32), np.empty(_LEADS, np.int32)
    n_active = n_lead = waiting = 0
    for s in range(events.shape[0] - 1):
        ax, ay, bx, by = events[s, 0], events[s, 1], events[s + 1, 0], events[s + 1, 1]
        dx, dy = ax + bx, ay + by
        length = math.hypot(dx, dy)
        dx, dy = dx / length, dy / length
        place = find_turn(dx, dy)
        while waiting < n_spans and spans[waiting, 0] <= place:
            active[n_active] = waiting
            n_active += 1
            waiting += 1
        top, low[wide], high[wide] = find_cover_along(cover, dx, dy)
        low_code[wide] = high_code[wide] = COVER
        top, code = max(top, 0.0), COVER if top > 0.0 else HORIZON
        # Of each face its interval of this meridian. Those that go on from what is covered raise it
        # at once, those that meet the first other interval widen it, and the rest is sorted by
        # where it starts. Faces that did so in the last slice come first, as what they cover needs
        # no look then.
        n_left = n_cut = n_now = 0
        for q in range(n_lead + n_active):
            if q < n_lead:
                i = lead[q]
            else:
                span = active[q - n_lead]
                if spans[span, 1] < place:
                    continue
                active[n_left] = span
                n_left += 1
                i = owner[span]
            if seen.bounds[i, 1] <= top or stamp[i] == s:
                continue
            if seen.bounds[i, 1] <= high[wide] and seen.bounds[i, 0] >= low[wide]:
                continue
            stamp[i] = s
            lower, upper, p, r = cut_face(seen.corners[i], seen.size[i], dx, dy)
            if upper <= top:
                continue
            low[i], high[i] = lower, upper
            low_code[i], high_code[i] = i << 3 | p, (i << 3 | r if r >= 0 else ZENITH)
            if lower - top <= GAP * (1.0 + lower * top):
                top, code = upper, high_code[i]
            elif low[wide] == math.inf or (lower <= high[wide] and upper >= low[wide]):
                if lower >= low[wide] and upper <= high[wide]:
                    continue
                if lower < low[wide]:
                    low[wide], low_code[wide] = lower, low_code[i]
                if upper > high[wide]:
                    high[wide], high_code[wide] = upper, high_code[i]
            else:
                n_cut = _insert(cut, n_cut, low, i)
                continue
            if n_now < _LEADS:
                now[n_now] = i
                n_now += 1
        lead, now, n_lead = now, lead, n_now
        if low[wide] < math.inf:
            n_cut = _insert(cut, n_cut, low, wide)
        n_active = n_left
        low[n_faces], high[n_faces] = find_slope(normal, dx, dy)
        has_plane = low[n_faces] < math.inf
        q = 0
        while top < math.inf:
            i = cut[q] if q < n_cut else -1
            if has_plane and (i < 0 or low[n_faces] <= low[i]):
                i = n_faces
                has_plane = False
            elif i >= 0:
                q += 1
            start = low[i] if i >= 0 else math.inf
            bound = low_code[i] if i >= 0 else ZENITH
            if start == math.inf or start - top > GAP * (1.0 + start * top):
                if count == which.size:
                    which, below, above, under, over = _grow(which, below, above, under, over)
                which[count], under[count], over[count] = s, code, bound
                below[count, 0], below[count, 1] = place_bound(seen, code, normal, ax, ay)
                below[count, 2], below[count, 3] = place_bound(seen, code, normal, bx, by)
                above[count, 0], above[count, 1] = place_bound(seen, bound, normal, ax, ay)
                above[count, 2], above[count, 3] = place_bound(seen, bound, normal, bx, by)
                count += 1
            if i < 0:
                break
            if high[i] > top:
                top, code = high[i], high_code[i]
    return Pieces(which[:count], below[:count], above[:count], under[:count], over[:count], events)


@kernel
def is_on_cover(pieces):
    """
    Return whether what is known to be covered bounds a piece, so that the pieces are wrong.

    What is covered ends within the face that covers it, which bounds what is free. Where rounding
    moved it beyond the face, nothing does.
    """
    for i in range(pieces.slice.size):
        if pieces.under[i] == COVER or pieces.over[i] == COVER:
            return True
    return False


@borrowing
def _insert(cut, n, low, i):
    """Insert an interval into those sorted by where they start; return their number."""
    at = n
    while at > 0 and low[cut[at - 1]] > low[i]:
        cut[at] = cut[at - 1]
        at -= 1
    cut[at] = i
    return n + 1


@kernel
def _grow(which, below, above, under, over):
    n = which.size
    more = np.empty(2 * n, np.int32)
    lower, upper = np.empty((2 * n, 4)), np.empty((2 * n, 4))
    codes, others = np.empty(2 * n, np.int32), np.empty(2 * n, np.int32)
    copy_numbers(which, more)
    copy_rows(below, lower)
    copy_rows(above, upper)
    copy_numbers(under, codes)
    copy_numbers(over, others)
    return more, lower, upper, codes, others


@kernel
def integrate(pieces, moments):
    """Add the moments (7,) of pieces, see ``add_arc``."""
    events = pieces.events
    for i in range(pieces.slice.size):
        s = pieces.slice[i]
        ax, ay, bx, by = events[s, 0], events[s, 1], events[s + 1, 0], events[s + 1, 1]
        b, a = pieces.below[i], pieces.above[i]
        add_arc(b[0], b[1], b[2], b[3], ax, ay, bx, by, 1.0, moments)
        if pieces.over[i] != ZENITH:
            add_arc(a[0], a[1], a[2], a[3], ax, ay, bx, by, -1.0, moments)
