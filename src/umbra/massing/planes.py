"""
Planes of the sun over a plot: under which height a box in a cell leaves a sun ray free.

A box reaches from the ground to its top. A ray to the sun climbs, so over a cell it is lowest where
it enters: the box leaves it free if its top is not above that point. Between two instants the ray
sweeps a surface, which over a cell is lowest on a ray at one of the instants or at a corner of the
cell: along an edge between them the ray's height is convex, and within a minute bends by at most
2.4e-6 of its length.

What rules ask of receivers: pieces of lit time, and how many of them must remain.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel, run_shared, take_next
from umbra.massing.plot import Plot

__all__ = [
    "LONGEST",
    "SPELLS",
    "SUM",
    "Needs",
    "RayCrossings",
    "SunPieces",
    "cross_cells",
    "measure_lit",
]

_WIDER = 1e-6
"""By which cells are wider for rays along their edges [m]."""
_ALONG = 1e-14  # of a unit step: below it a ray does not cross an axis


class SunPieces(NamedTuple):
    """
    Pieces of time in which a receiver is lit.

    Parameters
    ----------
    receiver : (n,) int64
    first, last : (n,) int64
        Instants of the piece, the last included: the same one, or all that lie close together
        between its start and its end.
    hours : (n,) float64
        What each counts [h].
    goes_on : (n,) bool
        Whether it begins where the piece before ends.
    """

    receiver: NDArray[np.int64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    hours: NDArray[np.float64]
    goes_on: NDArray[np.bool_]


class RayCrossings(NamedTuple):
    """
    Cells that the rays of pieces cross.

    Parameters
    ----------
    start : (n_pieces + 1,) int64
        Of the crossings of each piece.
    cell : (m,) int32
    clear : (m,) float64
        Greatest height of the top at which the whole piece stays lit [m, local frame].
    dark : (m,) float64
        Height of the top above which the cell alone hides the whole piece; infinite where it never
        does [m, local frame].
    """

    start: NDArray[np.int64]
    cell: NDArray[np.int32]
    clear: NDArray[np.float64]
    dark: NDArray[np.float64]


def cross_cells(
    plot: Plot, pieces: SunPieces, points: NDArray[np.float64], suns: NDArray[np.float64]
) -> RayCrossings:
    """
    Find the cells that pieces cross, and the heights at which they do.

    Parameters
    ----------
    plot : Plot
    pieces : Pieces
    points : (n, 3) float64
        Receivers, local frame [m].
    suns : (m, 3) float64
        Unit directions at the instants, above the horizon.
    """
    level = np.hypot(suns[:, 0], suns[:, 1])
    level = np.maximum(level, 1e-9)
    toward = np.column_stack([suns[:, 0] / level, suns[:, 1] / level, suns[:, 2] / level])
    corner = np.array([plot.x0, plot.y0, plot.cell])
    counts = np.zeros(len(pieces.hours) + 1, np.int64)
    none_cell, none = np.zeros(0, np.int32), np.zeros(0)
    where = (pieces.receiver, pieces.first, pieces.last)
    given = where, points, toward, corner, plot.index
    run_shared(len(where[0]), _cross, *given, counts, none_cell, none, none, False)
    start = np.cumsum(counts)
    cell = np.zeros(start[-1], np.int32)
    clear, dark = np.zeros((2, start[-1]))
    run_shared(len(where[0]), _cross, *given, start, cell, clear, dark, True)
    return RayCrossings(start, cell, clear, dark)


@kernel
def _cross(pieces, points, toward, corner, index, start, cell, clear, dark, fill, taken):
    """Count the crossings of each piece, one place later; or fill them in."""
    receiver, first, last = pieces
    rows, cols = index.shape
    while True:
        u = take_next(taken)
        if u >= receiver.size:
            return
        rays = last[u] - first[u] + 1
        room = 64 + rays * 3 * (rows + cols + 2)
        at = np.empty(room, np.int64)
        z = np.empty((room, 2))
        ray = np.empty(room, np.int64)
        count = 0
        p = points[receiver[u]]
        for k in range(first[u], last[u] + 1):
            count = _follow(p, toward[k], corner, index, at, z, ray, count, k)
            if k < last[u]:
                more = _sweep(p, toward[k], toward[k + 1], corner, index, at, z, ray, count)
                while more > at.size:  # of many corners: again with more room
                    wider = np.empty(2 * more, np.int64)
                    wider[:count] = at[:count]
                    high = np.empty((2 * more, 2))
                    high[:count] = z[:count]
                    which = np.empty(2 * more, np.int64)
                    which[:count] = ray[:count]
                    at, z, ray = wider, high, which
                    more = _sweep(p, toward[k], toward[k + 1], corner, index, at, z, ray, count)
                count = more
        order = np.argsort(at[:count])
        position = start[u] if fill else 0
        i = 0
        while i < count:
            here = at[order[i]]
            low, high, met = np.inf, -np.inf, 0
            while i < count and at[order[i]] == here:
                j = order[i]
                low = min(low, z[j, 0])
                if ray[j] >= 0:
                    high = max(high, z[j, 1])
                    met += 1
                i += 1
            if fill:
                cell[position] = here
                clear[position] = low
                dark[position] = high if met == rays else np.inf
            position += 1
        if not fill:
            start[u + 1] = position


@partial(kernel, inline="always")
def _span(at, step, low, high):
    """Return the distances at which a ray enters and leaves an interval of one axis."""
    if abs(step) < _ALONG:
        return (0.0, np.inf) if low <= at <= high else (np.inf, -np.inf)
    first, second = (low - at) / step, (high - at) / step
    return max(min(first, second), 0.0), max(first, second)


@kernel
def _follow(p, d, corner, index, at, z, ray, count, k):
    """List the cells under one ray, with its height where it enters each."""
    rows, cols = index.shape
    x0, y0, side = corner[0], corner[1], corner[2]
    begin, end = _span(p[0], d[0], x0 - _WIDER, x0 + cols * side + _WIDER)
    enter, leave = _span(p[1], d[1], y0 - _WIDER, y0 + rows * side + _WIDER)
    begin, end = max(begin, enter), min(end, leave)
    if begin > end:
        return count
    left, right = p[0] + begin * d[0], p[0] + end * d[0]
    low = max(int(np.floor((min(left, right) - _WIDER - x0) / side)), 0)
    high = min(int(np.floor((max(left, right) + _WIDER - x0) / side)), cols - 1)
    for col in range(low, high + 1):
        a, b = _span(p[0], d[0], x0 + col * side - _WIDER, x0 + (col + 1) * side + _WIDER)
        a, b = max(a, begin), min(b, end)
        if a > b:
            continue
        south, north = p[1] + a * d[1], p[1] + b * d[1]
        bottom = max(int(np.floor((min(south, north) - _WIDER - y0) / side)), 0)
        top = min(int(np.floor((max(south, north) + _WIDER - y0) / side)), rows - 1)
        for row in range(bottom, top + 1):
            c = index[row, col]
            if c < 0:
                continue
            f, g = _span(p[1], d[1], y0 + row * side - _WIDER, y0 + (row + 1) * side + _WIDER)
            f, g = max(f, a), min(g, b)
            if f > g:
                continue
            at[count], z[count, 0] = c, p[2] + f * d[2]
            # Whether, and where, it enters the cell itself.
            a_in, a_out = _span(p[0], d[0], x0 + col * side, x0 + (col + 1) * side)
            f, g = _span(p[1], d[1], y0 + row * side, y0 + (row + 1) * side)
            f, g = max(f, a_in), min(g, a_out)
            z[count, 1] = p[2] + f * d[2]
            ray[count] = k if f < g else -1
            count += 1
    return count


@kernel
def _sweep(p, d, e, corner, index, at, z, ray, count):
    """
    List the corners of cells between two rays, with the height of the ray through each.

    Returns the number of places that are needed, which may be more than there are.
    """
    rows, cols = index.shape
    x0, y0, side = corner[0], corner[1], corner[2]
    turn = d[0] * e[1] - d[1] * e[0]
    if abs(turn) < _ALONG:
        return count
    # Along the axis that the rays cross faster, the corners between them are an interval.
    flip = abs(d[1]) > abs(d[0])
    ahead = 1 if flip else 0
    beside = 1 - ahead
    lines, others = (rows, cols) if flip else (cols, rows)
    base, other = (y0, x0) if flip else (x0, y0)
    if d[ahead] * e[ahead] <= 0.0:
        return count
    for i in range(lines + 1):
        along = base + i * side - p[ahead]
        if along * d[ahead] <= 0.0:
            continue
        first = p[beside] + along / d[ahead] * d[beside]
        second = p[beside] + along / e[ahead] * e[beside]
        low = max(int(np.ceil((min(first, second) - other) / side)), 0)
        high = min(int(np.floor((max(first, second) - other) / side)), others)
        for j in range(low, high + 1):
            across = other + j * side - p[beside]
            x, y = (across, along) if flip else (along, across)
            length = np.hypot(x, y)
            share = (d[0] * y - d[1] * x) / (length * turn)
            share = min(max(share, 0.0), 1.0)
            height = p[2] + length * (d[2] + share * (e[2] - d[2]))
            row, col = (i, j) if flip else (j, i)
            for r in range(max(row - 1, 0), min(row + 1, rows)):
                for c in range(max(col - 1, 0), min(col + 1, cols)):
                    if index[r, c] >= 0:
                        if count < at.size:
                            at[count], z[count, 0], ray[count] = index[r, c], height, -1
                        count += 1
    return count


SUM, LONGEST, SPELLS = range(3)
"""Measures: hours in all, the longest spell, hours in spells of a least length."""
SLACK = 1e-6
"""Rounding of hours [h], and of the weights of groups."""


class Needs(NamedTuple):
    """
    Needs of receivers, in groups of which a share must be met.

    A need is a receiver's on one date of a check. A receiver that must be met by itself is a group
    of one.

    Parameters
    ----------
    crossings : Crossings
        Of the pieces, which come need by need, in time order.
    hours : (n_pieces,) float64
        What each piece counts [h].
    goes_on : (n_pieces,) bool
        Whether a piece begins where the one before ends.
    start : (n_needs + 1,) int64
        Of each need's pieces.
    measure : (n_needs,) int64
        SUM, LONGEST or SPELLS.
    least : (n_needs,) float64
        Least length of a spell [h].
    limit : (n_needs,) float64
        Hours that must remain [h].
    weight : (n_needs,) float64
        Share of its group.
    group : (n_groups + 1,) int64
        Start of each group's needs.
    wanted : (n_groups,) float64
        Weight of the needs that must be met.
    """

    crossings: RayCrossings
    hours: NDArray[np.float64]
    goes_on: NDArray[np.bool_]
    start: NDArray[np.int64]
    measure: NDArray[np.int64]
    least: NDArray[np.float64]
    limit: NDArray[np.float64]
    weight: NDArray[np.float64]
    group: NDArray[np.int64]
    wanted: NDArray[np.float64]


@kernel
def measure_lit(needs, need, is_lit):
    """Return what a need's measure is of the pieces that are lit [h]."""
    total, longest, counted, run = 0.0, 0.0, 0.0, 0.0
    for u in range(needs.start[need], needs.start[need + 1]):
        if run > 0.0 and not (needs.goes_on[u] and is_lit[u]):
            longest = max(longest, run)
            if run >= needs.least[need] - SLACK:
                counted += run
            run = 0.0
        if is_lit[u]:
            run += needs.hours[u]
            total += needs.hours[u]
    longest = max(longest, run)
    if run >= needs.least[need] - SLACK:
        counted += run
    if needs.measure[need] == SUM:
        return total
    return longest if needs.measure[need] == LONGEST else counted
