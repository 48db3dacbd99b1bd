"""
The share of a disc in the sky, such as the sun, that points see: exact against straight edges.

On the plane that touches the unit sphere in the disc's middle faces are polygons with straight
sides, and the disc is a circle. Most discs are seen whole, or one face covers them: usually that
which covered the last one, or that which a ray to the middle meets. Joined faces cover a disc where
no edge of one face alone crosses it. Of the others the area is measured (``disc_area.py``). Any
faces will do, as in the sweep of the sky. Where a thicket of faces covers a disc, it is judged by
many rays.
"""

import math

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, dot, find_lowest, inlined, kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.disc_area import find_disc_side, integrate_disc
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.hidden import get, is_hidden
from umbra.rays.lanes import meet_cone

__all__ = ["find_free_disc"]

_CORNERS = 6
_FACES = 512  # most that cover one disc in part; of more it is judged by rays,
_MEASURED = 128  # or of so many that are not joined
_EDGES = 4096  # a power of 2, above twice the sides of all faces
_HEIGHTS = 8192  # most corners and crossings in a disc, likewise
_RAYS = 4096
_TINY = 1e-30
_COARSE = 2.0**-21  # of coordinates: the rounding of boxes in float32
_ASK = 4  # faces beside the disc's middle from which a ray to it is cast
_NEAR = 1e-13  # nearest depth of a corner [m]
_FAR = 4.0  # half side of the square that planes through the point are cut from [radii]


def find_free_disc(
    tree: FaceTree,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    toward: NDArray[np.float64],
    radius: float,
    threads: int = 1,
) -> NDArray[np.float64]:
    """
    Return the share of a disc that each point sees, 0 to 1.

    What lies behind the point's surface or below the horizon is not seen.

    Parameters
    ----------
    tree : FaceTree
    points : (n, 3) float64
        In the caster's frame [m]. A face whose plane holds a point covers nothing.
    normals : (n, 3) float64
        Normals of the points' surfaces; NaN for points that have none.
    toward : (m, n, 3) or (m, 1, 3) float64
        Unit directions toward the disc's middle: of each point, or of all alike.
    radius : float
        Of the disc [degrees].
    threads : int

    Returns
    -------
    shares : (m, n) float64
    """
    shares = np.zeros((len(toward), len(points)))
    use_threads(threads)
    given = tree, points, normals, toward, math.tan(math.radians(radius)), shares
    run_shared(-(-len(points) // 16), _find, *given)
    return shares


@kernel
def _find(tree, points, normals, toward, radius, shares, taken):
    n = points.shape[0]
    stack = np.zeros(DEEPEST, np.int32)
    sides = np.zeros((_FACES, _CORNERS, 2))
    sizes = np.zeros(_FACES, np.int32)
    faces = np.zeros(_FACES, np.int64)
    edges = np.zeros(_EDGES, np.int64)
    heights = np.zeros(_HEIGHTS)
    spans = np.zeros((_FACES, 6))
    while True:
        block = take_next(taken)
        if block >= (n + 15) // 16:
            return
        for i in range(block * 16, min(n, (block + 1) * 16)):
            last = np.int64(-1)  # the last face that covered the disc usually still does
            for k in range(toward.shape[0]):
                d = get(toward[k], i if toward.shape[1] > 1 else 0)
                shares[k, i], last = _find_one(
                    tree, get(points, i), get(normals, i), d, radius, last, stack, sides, sizes,
                    faces, edges, heights, spans,
                )  # fmt: skip


@borrowing
def _find_one(tree, p, n, d, radius, last, stack, sides, sizes, faces, edges, heights, spans):
    """Return the free share of one disc, and a face that may cover the next."""
    e = (1.0, 0.0, 0.0) if abs(d[0]) < abs(d[1]) else (0.0, 1.0, 0.0)
    along = dot(e, d)
    ux, uy, uz = e[0] - along * d[0], e[1] - along * d[1], e[2] - along * d[2]
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    u = (ux / length, uy / length, uz / length)
    v = (d[1] * u[2] - d[2] * u[1], d[2] * u[0] - d[0] * u[2], d[0] * u[1] - d[1] * u[0])
    count = 0
    for which in range(2):
        # The horizon's plane, and the surface's own: what is behind them is covered.
        m = (0.0, 0.0, 1.0) if which == 0 else n
        if m[0] != m[0]:
            continue
        got = _cover_behind(dot(m, d), radius * dot(m, u), radius * dot(m, v), sides, sizes, count)
        if got < 0:
            return 0.0, last
        count = got
    planes = count
    if last >= 0 and _add_face(tree, last, p, d, u, v, radius, sides, sizes, count) < 0:
        return 0.0, last
    middle = np.int64(-2)  # the face that hides the disc's middle, -1 for none, -2: not asked
    if last >= 0 and planes == 0:
        middle = is_hidden(p, n, d, tree, stack, last)
        if middle >= 0 and _add_face(tree, middle, p, d, u, v, radius, sides, sizes, count) < 0:
            return 0.0, middle
    places, inverses, exits = _make_cone(p, d, radius)
    stack[0] = 0
    size = 1
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
            if count == _FACES:
                return _sample(tree, p, n, d, u, v, radius, stack), last
            got = _add_face(tree, ~child, p, d, u, v, radius, sides, sizes, count)
            if got < 0:
                return 0.0, ~child
            if got > count:
                faces[count] = ~child
            count = got
            if count == _ASK and planes == 0 and middle == -2:
                middle = is_hidden(p, n, d, tree, stack[size:], last)
                if middle >= 0 and (
                    _add_face(tree, middle, p, d, u, v, radius, sides, sizes, count) < 0
                ):
                    return 0.0, middle
    if count == 0:
        return 1.0, np.int64(-1)
    if middle >= 0 and _are_joined(tree, p, sides, faces, sizes, count, edges):
        return 0.0, middle
    share = -1.0
    if count <= _MEASURED:
        share = integrate_disc(sides, sizes, count, heights, spans)
    if share < 0.0:
        share = _sample(tree, p, n, d, u, v, radius, stack)
    return share, max(middle, np.int64(-1))


@borrowing
def _are_joined(tree, p, sides, faces, sizes, count, edges):
    """
    Return whether every side that crosses the disc joins two faces, which hide it both.

    Then each place of the disc is behind as many faces as its middle. ``edges`` is a table of the
    faces' sides: the first and last vertex, and whether the point is in front of the face.
    """
    for k in range(edges.size):
        edges[k] = -1
    for i in range(count):
        if sizes[i] != 3:
            return False  # cut at the viewer's plane: its sides are no edges
        ids, front = get(tree.ids, faces[i]), _is_front(tree, faces[i], p)
        for k in range(3):
            key = _make_key(ids[k], ids[(k + 1) % 3], front)
            at = _look_up(edges, key)
            if edges[at] >= 0:
                return False
            edges[at] = key
    for i in range(count):
        ids, front = get(tree.ids, faces[i]), _is_front(tree, faces[i], p)
        for k in range(3):
            x, y, dx, dy, _ = find_disc_side(sides[i], k, 3)
            if (x * dy - y * dx) ** 2 > dx * dx + dy * dy:
                continue
            if edges[_look_up(edges, _make_key(ids[(k + 1) % 3], ids[k], front))] < 0:
                return False
    return True


@inlined
def _make_key(a, b, front):
    return (np.int64(a) << 32) | (np.int64(b) << 1) | np.int64(front)


@inlined
def _look_up(edges, key):
    """Return the place of a key in a table, or where it would be."""
    at = ((key * 0x9E3779B97F4A7C1) >> 20) & (edges.size - 1)
    while edges[at] >= 0 and edges[at] != key:
        at = (at + 1) & (edges.size - 1)
    return at


@inlined
def _is_front(tree, f, p):
    """Return whether a point is above a face's plane."""
    m = tree.normals
    c = tree.corners
    return (
        m[f, 0] * (p[0] - c[f, 0]) + m[f, 1] * (p[1] - c[f, 1]) + m[f, 2] * (p[2] - c[f, 2]) > 0.0
    )


@borrowing
def _sample(tree, p, n, d, u, v, radius, stack):
    """Return the free share of one disc by rays."""
    free, last = 0, np.int64(-1)
    for k in range(_RAYS):
        away, turn = radius * math.sqrt((k + 0.5) / _RAYS), k * 2.399963229728653
        x, y = away * math.cos(turn), away * math.sin(turn)
        w = (d[0] + x * u[0] + y * v[0], d[1] + x * u[1] + y * v[1], d[2] + x * u[2] + y * v[2])
        length = math.sqrt(dot(w, w))
        w = (w[0] / length, w[1] / length, w[2] / length)
        if w[2] <= 0.0 or dot(n, w) <= 0.0:
            continue
        last = is_hidden(p, n, w, tree, stack, last)
        free += last < 0
    return free / _RAYS


@inlined
def _make_cone(p, d, radius):
    """
    Return the disc's cone for ``meet_cone``.

    At a distance t along the axis it reaches t (d - r) to t (d + r) from the point, on each
    axis, so that lo - p <= t (d + r) and hi - p >= t (d - r) for a box that it meets.
    """
    r = 1.0001 * radius + 1e-7
    x, y, z = _COARSE * abs(p[0]) + 1e-9, _COARSE * abs(p[1]) + 1e-9, _COARSE * abs(p[2]) + 1e-9
    places = (
        np.float32(p[0] + x), np.float32(p[1] + y), np.float32(p[2] + z),
        np.float32(p[0] - x), np.float32(p[1] - y), np.float32(p[2] - z),
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


@borrowing
def _cover_behind(a, b, c, sides, sizes, count):
    """
    Add the part of the disc where a + b x + c y < 0; return the number, -1 where that is all.

    The part is a square cut by the line.
    """
    length = math.sqrt(b * b + c * c)
    if a >= length:
        return count
    if a <= -length:
        return -1
    n = 0
    x0, y0 = _FAR, _FAR
    for k in range(4):
        x1 = -_FAR if k in (0, 1) else _FAR
        y1 = -_FAR if k in (1, 2) else _FAR
        one, two = a + b * x0 + c * y0, a + b * x1 + c * y1
        if one < 0.0:
            sides[count, n, 0], sides[count, n, 1] = x0, y0
            n += 1
        if (one < 0.0) != (two < 0.0):
            share = one / (one - two)
            sides[count, n, 0] = x0 + share * (x1 - x0)
            sides[count, n, 1] = y0 + share * (y1 - y0)
            n += 1
        x0, y0 = x1, y1
    sizes[count] = n
    return count + 1


@borrowing
def _add_face(tree, f, p, d, u, v, radius, sides, sizes, count):
    """Add a face as it covers the disc; return the number, -1 where it covers all of it."""
    m, c = get(tree.normals, f), get(tree.corners, f)
    height = m[0] * (p[0] - c[0]) + m[1] * (p[1] - c[1]) + m[2] * (p[2] - c[2])
    if abs(height) <= tree.normals[f, 3]:
        return count
    n = 0
    for k in range(3):
        j = 3 * k
        a = (
            tree.corners[f, j] - p[0],
            tree.corners[f, j + 1] - p[1],
            tree.corners[f, j + 2] - p[2],
        )
        j = 3 * ((k + 1) % 3)
        b = (
            tree.corners[f, j] - p[0],
            tree.corners[f, j + 1] - p[1],
            tree.corners[f, j + 2] - p[2],
        )
        one, two = dot(a, d), dot(b, d)
        if one > _NEAR:
            sides[count, n, 0] = dot(a, u) / (one * radius)
            sides[count, n, 1] = dot(a, v) / (one * radius)
            n += 1
        if (one > _NEAR) != (two > _NEAR):
            share = (_NEAR - one) / (two - one)
            w = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]),
                 a[2] + share * (b[2] - a[2]))  # fmt: skip
            sides[count, n, 0] = dot(w, u) / (_NEAR * radius)
            sides[count, n, 1] = dot(w, v) / (_NEAR * radius)
            n += 1
    if n < 3:
        return count
    # All of the disc before one side: outside. Behind all sides: it is covered whole.
    sign = -1.0 if height > 0.0 else 1.0  # wound as in the tree, or seen from behind
    inside = True
    for k in range(n):
        x, y, dx, dy, turn = find_disc_side(sides[count], k, n)
        away, length = sign * turn * (x * dy - y * dx), math.hypot(dx, dy)
        if away <= -length:
            return count
        inside = inside and away >= length
    if inside:
        return -1
    sizes[count] = n
    return count + 1
