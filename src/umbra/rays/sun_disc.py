"""
The share of a disc in the sky, such as the sun, that points see: exact against straight edges.

Points that lie together ask once which faces they may meet within the disc's cone. Most meet none,
or one face covers the disc: usually that which covered the last one, or that which a ray to the
middle meets. Of the others the area is measured (``disc_area.py``) that the faces' sides leave
(``disc_sides.py``). Any faces will do, as in the sweep of the sky. Where a thicket of faces covers
a disc, it is judged by many rays.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, dot, find_lowest, inlined, kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.disc_area import integrate_disc
from umbra.rays.disc_sides import (
    NO_LAND,
    LandEdge,
    add_face,
    add_land_edge,
    add_plane,
    clear_sides,
    make_frame,
    make_sides,
)
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.hidden import get, is_hidden
from umbra.rays.lanes import meet_cone

__all__ = [
    "MOST_FACES", "KnownDiscs", "covers_disc", "find_free_disc", "gather_disc_faces",
    "measure_disc",
]  # fmt: skip

MOST_FACES = 512
"""Most faces that meet a disc's cone; of more it is judged by rays."""
_RAYS = 4096
_TINY = 1e-30
_COARSE = 2.0**-21  # of coordinates: the rounding of boxes in float32
_BLOCK, _GROUP = 64, 8  # points that are asked together
_FEW = 12  # faces for which fewer points are not asked
_LEVEL = (0.0, 0.0, 1.0)
_OPEN = -1.0
_POINT = 1e-7  # radius of a ray to the land [radians]


class KnownDiscs(NamedTuple):
    """
    Which discs are known to be wholly free, or wholly hidden.

    Parameters
    ----------
    cut : (m, n) bool
        Which are not, and have to be measured.
    hidden : (m, n) uint8
        Which of the others are hidden.
    """

    cut: NDArray[np.bool_]
    hidden: NDArray[np.uint8]


def find_free_disc(
    tree: FaceTree,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    toward: NDArray[np.float64],
    radius: float,
    threads: int = 1,
    land: LandEdge = NO_LAND,
    known: KnownDiscs | None = None,
) -> NDArray[np.float64]:
    """
    Return the share of a disc that each point sees, 0 to 1.

    What lies behind the point's surface, the land or the horizon is not seen.

    Parameters
    ----------
    tree : FaceTree
    points : (n, 3) float64
        In the caster's frame [m]. A face whose plane holds a point covers nothing.
    normals : (n, 3) float64
        Normals of the points' surfaces; NaN for points that have none.
    toward : (m, 3) float64
        Unit directions toward the disc's middle.
    radius : float
        Of the disc [degrees].
    threads : int
    land : LandEdge
        None by default.
    known : KnownDiscs, optional
        None by default: all are measured.

    Returns
    -------
    shares : (m, n) float64
    """
    shares = np.zeros((len(toward), len(points)))
    use_threads(threads)
    slope = math.tan(math.radians(radius))
    blocks = -(-len(points) // _BLOCK)
    known = known or KnownDiscs(np.zeros((0, 0), np.bool_), np.zeros((0, 0), np.uint8))
    run_shared(blocks, _find, tree, points, normals, toward, slope, land, known, shares)
    return shares


@kernel
def _find(tree, points, normals, toward, radius, land, known, shares, taken):
    n = points.shape[0]
    stack = np.zeros(DEEPEST, np.int32)
    sides = make_sides()
    faces = np.zeros(MOST_FACES, np.int64)
    lasts = np.zeros(_BLOCK, np.int64)
    while True:
        block = take_next(taken)
        if block >= (n + _BLOCK - 1) // _BLOCK:
            return
        first, end = block * _BLOCK, min(n, (block + 1) * _BLOCK)
        for i in range(_BLOCK):
            lasts[i] = -1  # the last face that covered a disc usually still does
        for k in range(toward.shape[0]):
            frame = make_frame(get(toward, k), radius)
            if not _open(known, k, shares[k], first, end):
                continue
            _hide(
                tree, points, normals, frame, known, k, first, end, lasts, stack, sides, shares[k]
            )
            _find_block(
                tree, points, normals, frame, land, first, end, lasts, stack, sides, faces,
                shares[k],
            )  # fmt: skip


@borrowing
def _open(known, k, shares, first, end):
    """Set the shares of a block that are known, and open the others; return their number."""
    number = 0
    for i in range(first, end):
        if known.cut.size == 0 or known.cut[k, i]:
            shares[i] = _OPEN
            number += 1
        else:
            shares[i] = 0.0 if known.hidden[k, i] else 1.0
    return number


@borrowing
def _hide(tree, points, normals, frame, known, k, first, end, lasts, stack, sides, shares):
    """Close the open points of a block of whose disc the face before its middle hides all."""
    recent = np.int64(-1)
    for i in range(first, end):
        if shares[i] != _OPEN or (known.cut.size and not known.hidden[k, i]):
            continue
        p = get(points, i)
        if recent < 0 or not covers_disc(tree, recent, p, frame, sides):
            recent = is_hidden(p, get(normals, i), frame.d, tree, stack, lasts[i - first])
            if recent < 0 or not covers_disc(tree, recent, p, frame, sides):
                continue
        shares[i], lasts[i - first] = 0.0, recent


@borrowing
def _find_block(
    tree, points, normals, frame, land, first, end, lasts, stack, sides, faces, shares
):  # fmt: skip
    """Find the free share of one disc for the open points of a block."""
    count = add_plane(sides, 0, frame, _LEVEL)
    if count >= 0:
        count = add_land_edge(sides, count, frame, land)
    for i in range(first, end):
        if shares[i] != _OPEN:
            continue
        last = lasts[i - first]
        n = get(normals, i)
        if (
            count < 0
            or (n[0] == n[0] and add_plane(sides, 0, frame, n) < 0)
            or (last >= 0 and covers_disc(tree, last, get(points, i), frame, sides))
        ):
            shares[i] = 0.0
    if count < 0:
        return
    whole = _gather_open(tree, points, shares, first, end, frame, stack, faces)
    for start in range(first, end, _GROUP):
        stop = min(start + _GROUP, end)
        listed = whole
        if whole > _FEW:
            listed = _gather_open(tree, points, shares, start, stop, frame, stack, faces)
        recent = np.int64(-1)
        for i in range(start, stop):
            if shares[i] != _OPEN:
                continue
            p, n = get(points, i), get(normals, i)
            if recent >= 0 and covers_disc(tree, recent, p, frame, sides):
                shares[i], lasts[i - first] = 0.0, recent
                continue
            used = listed
            if listed > _FEW:
                used = gather_disc_faces(tree, p, p, frame, stack, faces)
            shares[i], recent = measure_disc(
                tree, p, n, frame, land, faces, used, stack, sides, 2.0
            )  # fmt: skip
            lasts[i - first] = recent


@inlined
def covers_disc(tree, f, p, frame, sides):
    """Return whether a face covers all of a disc."""
    count = add_face(sides, 0, frame, tree, f, p)
    clear_sides(sides, count)
    return count < 0


@borrowing
def _gather_open(tree, points, shares, first, end, frame, stack, faces):
    """List the faces that the open ones of some points may meet; return their number."""
    low, high = (math.inf, math.inf, math.inf), (-math.inf, -math.inf, -math.inf)
    for i in range(first, end):
        if shares[i] == _OPEN:
            p = get(points, i)
            low = (min(low[0], p[0]), min(low[1], p[1]), min(low[2], p[2]))
            high = (max(high[0], p[0]), max(high[1], p[1]), max(high[2], p[2]))
    if low[0] > high[0]:
        return 0
    return gather_disc_faces(tree, low, high, frame, stack, faces)


@borrowing
def gather_disc_faces(tree, low, high, frame, stack, faces):
    """
    List the faces whose boxes a disc's cones from some places meet; return their number.

    Parameters
    ----------
    tree : FaceTree
    low, high : (3,) float64
        Bounds of the places [m].
    frame : DiscFrame
    stack : (DEEPEST,) int32
        Scratch.
    faces : (n,) int64
        Written to; where there are more, n + 1 is returned.
    """
    places, inverses, exits = _make_cone(low, high, frame.d, frame.radius)
    stack[0] = 0
    size, count = 1, 0
    while size > 0:
        size -= 1
        node = np.int64(stack[size])
        met = meet_cone(tree.boxes, node, places, inverses, exits)
        while met != 0:
            child = np.int64(tree.links[node, find_lowest(met)])
            met &= met - 1
            if child >= 0:
                stack[size] = child
                size += 1
                continue
            if count == faces.size:
                return count + 1
            faces[count] = ~child
            count += 1
    return count


@borrowing
def measure_disc(tree, p, n, frame, land, faces, number, stack, sides, enough):
    """
    Return the free share of a point's disc, and a face that alone covers all of it, else -1.

    Parameters
    ----------
    tree : FaceTree
    p, n : (3,) float64
        The point, and its surface's normal, or NaN.
    frame : DiscFrame
    land : LandEdge
    faces : (k,) int64
        What ``gather_disc_faces`` listed for places among which the point is.
    number : int64
        Its number.
    stack, sides
        Scratch.
    enough : float64
        Share of which no more is asked than that the disc has it; above 1: all of it.
    """
    if number > faces.size:
        return _sample(tree, p, n, frame, land, stack, sides), np.int64(-1)
    count = add_plane(sides, 0, frame, _LEVEL)
    if count >= 0 and n[0] == n[0]:
        count = add_plane(sides, count, frame, n)
    if count >= 0:
        count = add_land_edge(sides, count, frame, land)
    if count < 0:
        return 0.0, np.int64(-1)
    for k in range(number):
        got = add_face(sides, count, frame, tree, faces[k], p)
        if got < 0:
            clear_sides(sides, count)
            return 0.0, faces[k]
        count = got
    if count == 0:
        return 1.0, np.int64(-1)
    share = integrate_disc(sides, count, enough)
    clear_sides(sides, count)
    if share < 0.0:
        share = _sample(tree, p, n, frame, land, stack, sides)
    return share, np.int64(-1)


@borrowing
def _sample(tree, p, n, frame, land, stack, sides):
    """Return the free share of one disc by rays."""
    free, last = 0, np.int64(-1)
    d, u, v, radius = frame
    for k in range(_RAYS):
        away, turn = radius * math.sqrt((k + 0.5) / _RAYS), k * 2.399963229728653
        x, y = away * math.cos(turn), away * math.sin(turn)
        w = (d[0] + x * u[0] + y * v[0], d[1] + x * u[1] + y * v[1], d[2] + x * u[2] + y * v[2])
        length = math.sqrt(dot(w, w))
        w = (w[0] / length, w[1] / length, w[2] / length)
        if w[2] <= 0.0 or dot(n, w) <= 0.0:
            continue
        if land.azimuths.size and add_land_edge(sides, 0, make_frame(w, _POINT), land) < 0:
            continue
        last = is_hidden(p, n, w, tree, stack, last)
        free += last < 0
    return free / _RAYS


@inlined
def _make_cone(low, high, d, radius):
    """
    Return the cones of a disc from all places of a box, for ``meet_cone``.

    At a distance t along the axis one reaches t (d - r) to t (d + r) from its point p, on each
    axis, so that lo - p <= t (d + r) and hi - p >= t (d - r) for a box that it meets.
    """
    r = 1.0001 * radius + 1e-7
    x = _COARSE * max(abs(low[0]), abs(high[0])) + 1e-9
    y = _COARSE * max(abs(low[1]), abs(high[1])) + 1e-9
    z = _COARSE * max(abs(low[2]), abs(high[2])) + 1e-9
    places = (
        np.float32(high[0] + x), np.float32(high[1] + y), np.float32(high[2] + z),
        np.float32(low[0] - x), np.float32(low[1] - y), np.float32(low[2] - z),
    )  # fmt: skip
    inverses = (
        _invert(d[0] + r), _invert(d[1] + r), _invert(d[2] + r),
        _invert(d[0] - r), _invert(d[1] - r), _invert(d[2] - r),
    )  # fmt: skip
    exits = (
        d[0] + r <= 0.0, d[1] + r <= 0.0, d[2] + r <= 0.0,
        d[0] - r > 0.0, d[1] - r > 0.0, d[2] - r > 0.0,
    )  # fmt: skip
    return places, inverses, exits


@inlined
def _invert(x):
    """Return 1 / x in float32, or a large finite number for 0, so that no box makes NaN."""
    return np.float32(1.0 / x if abs(x) > _TINY else math.copysign(1.0 / _TINY, x))
