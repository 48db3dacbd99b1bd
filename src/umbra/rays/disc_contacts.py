"""
When a disc in the sky appears or goes: the times between which the share of it is solved.

The time between is halved by looks at the disc. Where its middle is free a part is seen, and none
where the face before it covers all; the area is measured of the others alone.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, cross, dot, inlined, kernel, run_shared, take_next
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
_SURE = 1e-9  # sine of an angle above rounding
_ROUNDING = 2.0**-46  # relative to a product of two lengths


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
    recent = np.int64(-1)  # the last face that covered the disc usually still does, for neighbours
    while True:
        block = take_next(taken)
        if block >= (n + _BLOCK - 1) // _BLOCK:
            return
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            place = get(points, i), get(normals, i), which[i]
            way, light = (between[0, i], between[1, i]), (radius, close, land)
            times[i], recent = _solve_one(
                tree, place, track, way, light, faces, stack, sides, recent
            )  # fmt: skip


@borrowing
def _solve_one(tree, place, track, way, light, faces, stack, sides, recent):
    """Return when a part of the disc is seen at first, by halves of a time; and such a face."""
    (dark, lit), (p, n, k), (radius, close, land) = way, place, light
    while abs(lit - dark) > close:
        middle = (dark + lit) // 2
        frame = make_frame(_find_direction(track, k, middle), radius)
        sees, cover = _sees(tree, p, n, frame, land, faces, stack, sides, recent)
        recent = cover if cover >= 0 else recent
        dark, lit = (dark, middle) if sees else (middle, lit)
    return lit, recent


@borrowing
def _sees(tree, p, n, frame, land, faces, stack, sides, recent):
    """Return whether a part of the disc is seen, and a face that covers all of it, else -1."""
    if recent >= 0 and covers_disc(tree, recent, p, frame, sides):
        return False, recent
    number = gather_disc_faces(tree, p, p, frame, stack, faces)
    if number <= faces.size:
        hiding = _find_hiding(tree, p, frame.d, faces, number)
        if hiding >= 0 and covers_disc(tree, hiding, p, frame, sides):
            return False, hiding
        if hiding < 0 and _is_open(n, frame.d, land):
            return True, np.int64(-1)
    share, cover = measure_disc(tree, p, n, frame, land, faces, number, stack, sides, _PLENTY)
    return share > SEEN, cover


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


@inlined
def _is_open(n, d, land):
    """Return whether surely neither surface, horizon nor land hides a direction."""
    behind = dot(n, d) <= _SURE * math.sqrt(dot(n, n))
    return land.azimuths.size == 0 and d[2] > _SURE and not behind


@borrowing
def _find_hiding(tree, p, d, faces, number):
    """Return a listed face that may hide a direction; -1 if surely none does."""
    c = tree.corners
    for q in range(number):
        f = faces[q]
        m = get(tree.normals, f)
        height = m[0] * (p[0] - c[f, 0]) + m[1] * (p[1] - c[f, 1]) + m[2] * (p[2] - c[f, 2])
        if abs(height) <= tree.normals[f, 3]:
            continue
        u = (c[f, 0] - p[0], c[f, 1] - p[1], c[f, 2] - p[2])
        v = (c[f, 3] - p[0], c[f, 4] - p[1], c[f, 5] - p[2])
        w = (c[f, 6] - p[0], c[f, 7] - p[1], c[f, 8] - p[2])
        # Outside one edge by more than rounding.
        sides = dot(cross(u, v), d), dot(cross(v, w), d), dot(cross(w, u), d)
        outside = max(sides[0], sides[1], sides[2])
        if height <= 0.0:
            outside = -min(sides[0], sides[1], sides[2])
        size = math.sqrt(dot(u, u)) + math.sqrt(dot(v, v)) + math.sqrt(dot(w, w))
        if outside <= (2.0 * tree.normals[f, 3] + _ROUNDING * size) * size:
            return f
    return np.int64(-1)
