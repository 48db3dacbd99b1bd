"""When a disc in the sky appears or goes: the times between which the share of it is solved."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, dot, inlined, kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.disc_sides import NO_LAND, LandEdge, make_frame, make_sides
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.hidden import get
from umbra.rays.sun_disc import MOST_FACES, covers_disc, gather_disc_faces, measure_disc

__all__ = ["SEEN", "DiscTrack", "find_contacts"]

SEEN = 1e-9
"""Least share that is seen: above the rounding of areas, 1e-4 s after contact."""
_PLENTY = 1e-3  # share that is surely seen
_BLOCK = 16
_WIDEST = 0.5  # angle of a cone that holds the disc's way [radians]
_SLACK = 1e-4  # by which its ends are not its farthest [radians]
_FEW = 16  # faces that are not asked again for a shorter way


class DiscTrack(NamedTuple):
    """
    The disc's way in some intervals of time.

    Parameters
    ----------
    starts, steps : (n,) int64
        First time of each interval, and between its directions [us].
    first : (n + 1,) int64
        Of its directions.
    toward : (m, 3) float64
        Unit directions; between two they lie on a line.
    """

    starts: NDArray[np.int64]
    steps: NDArray[np.int64]
    first: NDArray[np.int64]
    toward: NDArray[np.float64]


def find_contacts(
    tree: FaceTree,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    track: DiscTrack,
    which: NDArray[np.int64],
    between: NDArray[np.int64],
    radius: float,
    close: int,
    threads: int = 1,
    land: LandEdge = NO_LAND,
) -> NDArray[np.int64]:
    """
    Return when a disc appears or goes at each point, (n,) int64 [us].

    Parameters
    ----------
    tree, points, normals, threads, land
        As of ``find_free_disc``.
    track : DiscTrack
    which : (n,) int64
        Interval of the track of each point.
    between : (2, n) int64
        Times at which no part of the disc is seen, and one is, in any order.
    radius : float
        Of the disc [degrees].
    close : int
        How near to the contact the times are that are found: at these a part is seen [us].
    """
    times = np.zeros(len(points), np.int64)
    use_threads(threads)
    slope = math.tan(math.radians(radius))
    blocks = -(-len(points) // _BLOCK)
    run_shared(
        blocks, _solve, tree, points, normals, track, which, between, slope, close, land, times
    )
    return times


@kernel
def _solve(tree, points, normals, track, which, between, radius, close, land, times, taken):
    n = points.shape[0]
    stack = np.zeros(DEEPEST, np.int32)
    sides = make_sides()
    faces = np.zeros(MOST_FACES, np.int64)
    while True:
        block = take_next(taken)
        if block >= (n + _BLOCK - 1) // _BLOCK:
            return
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            times[i] = _solve_one(
                tree, get(points, i), get(normals, i), track, which[i],
                (between[0, i], between[1, i]), radius, close, land, faces, stack, sides,
            )  # fmt: skip


@borrowing
def _solve_one(tree, p, n, track, k, between, radius, close, land, faces, stack, sides):
    """Return when the disc appears or goes at a point."""
    dark, lit = between
    number, gap = _gather_way(tree, p, track, k, dark, lit, radius, stack, faces), abs(lit - dark)
    recent = np.int64(-1)  # the last face that covered the disc usually still does
    while abs(lit - dark) > close:
        middle = (dark + lit) // 2
        frame = make_frame(_find_direction(track, k, middle), radius)
        if recent >= 0 and covers_disc(tree, recent, p, frame, sides):
            dark = middle
            continue
        if number > _FEW and abs(lit - dark) < gap // 3:
            number = _gather_way(tree, p, track, k, dark, lit, radius, stack, faces)
            gap = abs(lit - dark)
        listed = number
        if number > faces.size:
            listed = gather_disc_faces(tree, p, p, frame, stack, faces)
        share, recent = measure_disc(
            tree, p, n, frame, land, faces, listed, stack, sides, _PLENTY
        )  # fmt: skip
        if share > SEEN:
            lit = middle
        else:
            dark = middle
    return lit


@inlined
def _find_direction(track, k, time):
    """Return the direction at a time of an interval."""
    at = (time - track.starts[k]) / track.steps[k]
    most = track.first[k + 1] - track.first[k] - 2
    part = min(max(np.int64(at), 0), most)
    row = track.first[k] + part
    a, b, t = get(track.toward, row), get(track.toward, row + 1), at - part
    d = (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]))
    length = math.sqrt(dot(d, d))
    return d[0] / length, d[1] / length, d[2] / length


@borrowing
def _gather_way(tree, p, track, k, dark, lit, radius, stack, faces):
    """List the faces that the disc may meet on its way; return their number, or one too many."""
    middle = _find_direction(track, k, (dark + lit) // 2)
    nearest = min(
        dot(middle, _find_direction(track, k, dark)), dot(middle, _find_direction(track, k, lit))
    )
    wide = math.acos(min(max(nearest, -1.0), 1.0)) + math.atan(radius) + _SLACK
    if wide > _WIDEST:
        return faces.size + 1
    return gather_disc_faces(tree, p, p, make_frame(middle, math.tan(wide)), stack, faces)
