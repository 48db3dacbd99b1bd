"""
What lies between single points and the sun, for receivers that no raster can serve.

Each ray is tried in float64, face by face, through a hierarchy of boxes. A point is meant as
the limit from the side that its surface shows: a face on which it lies is between it
and the sun only if the sun is on the other side. Every edge tells the same to both its
faces, so that they never both miss a ray. Where rounding could tell either way (the point on
a fold or a plane, the ray through an edge or a corner), the whole ray is tried again from a
hair above and beside the point, to the east and north as cells of a plan are: faces of parts
that touch then tell one story. With the sun as light any face between hides it, so the answer
is whether the shadow count is not 0.
"""

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.machine import use_threads
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.lanes import find_lowest, meet_boxes

__all__ = ["find_hidden", "find_hidden_from", "get", "is_hidden"]

_ASIDE = 2.0**-24
"""How far beside its point a ray starts where rounding could tell either way [m], ..."""
_ABOVE = 2.0**-28
"""... and how far above its surface: less, so that a ray which grazes an edge passes beside it."""
_LIFT = 16.0 * _ASIDE
"""Above a face on which its point lies it starts higher: there the surface's side decides."""
_STEEP = 0.125  # cosine; faces that are steeper to a surface are not left by going above it
_ROUNDING = 2.0**-48  # of a product of two lengths
_TINY = 1e-30  # of a direction: its inverse is still a float32
_COARSE = 2.0**-22  # of a coordinate: more than float32 loses of it
_NO, _YES, _UNSURE = 0, 1, 2
_BLOCK = 64  # points that a thread takes at a time


def find_hidden(
    tree: FaceTree,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    suns: NDArray[np.float64],
    threads: int = 1,
    *,
    attached: bool = True,
) -> NDArray[np.uint8]:
    """
    Tell for each sun which points are in shadow, cast or attached.

    Parameters
    ----------
    tree : FaceTree
    points : (n, 3) float64
        In the caster's frame [m].
    normals : (n, 3) float64
        Of the side that the surface shows there; NaN for a point on no surface.
    suns : (n_suns, 3) float64
        Unit directions toward the sun.
    threads : int
    attached : bool
        Whether a point that is turned from the sun is in shadow; if not, it is in none.

    Returns
    -------
    masks : (n_suns, n) uint8
        0 or 1.
    """
    masks = np.zeros((len(suns), len(points)), np.uint8)
    use_threads(threads)
    _find(points, normals, np.ascontiguousarray(suns), tree, attached, masks)
    return masks


def find_hidden_from(
    tree: FaceTree,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    lights: NDArray[np.float64],
    threads: int = 1,
) -> NDArray[np.uint8]:
    """
    Tell for each light, a lamp or a direction, which points are in shadow, cast or attached.

    Parameters
    ----------
    tree, points, normals, threads
        As in ``find_hidden``.
    lights : (m, 4) float64
        Homogeneous, in the caster's frame: a unit direction with w = 0, a place with w = 1 [m].

    Returns
    -------
    masks : (m, n) uint8
        0 or 1; a point in a lamp is in its light.
    """
    masks = np.zeros((len(lights), len(points)), np.uint8)
    use_threads(threads)
    _find_from(points, normals, np.ascontiguousarray(lights), tree, masks)
    return masks


@njit(cache=True, nogil=True, inline="always")
def get(rows, i):
    """Return three numbers of a row as a tuple, which costs less than a view."""
    return rows[i, 0], rows[i, 1], rows[i, 2]


@njit(cache=True, nogil=True)
def is_hidden(p, n, d, tree, stack, last, light=None):
    """
    Find a face between a point and the light; -1 where there is none.

    ``p`` is the point, ``n`` its surface's normal toward the viewer, ``d`` the direction toward the
    light (tuples of three), ``tree`` a ``FaceTree``, ``stack`` room for DEEPEST int32, ``last`` a
    face to try first (negative for none); ``light``, if any, a lamp's place, beyond which nothing
    hides.
    """
    if last >= 0 and _hides(last, p, n, d, tree, light) == _YES:
        return last
    face, is_sure = _search(p, n, d, tree, stack, light)
    if is_sure:
        return face
    scale = max(1.0, 2.0 * tree.normals[0, 3] / _ABOVE)
    face, _ = _search(_step_aside(p, n, scale), n, d, tree, stack, light, p, scale)
    return face


@njit(cache=True, nogil=True)
def _step_aside(p, n, scale):
    """Find the place a hair above a surface and beside the point, to the east and north."""
    x, y, z = n
    if not x * x + y * y + z * z > 0.0:  # NaN: the point has no surface
        x, y, z = 0.0, 0.0, 0.0
    along = x + 0.618 * y + 0.382 * z
    return (
        p[0] + scale * (_ABOVE * x + _ASIDE * (1.0 - along * x)),
        p[1] + scale * (_ABOVE * y + _ASIDE * (0.618 - along * y)),
        p[2] + scale * (_ABOVE * z + _ASIDE * (0.382 - along * z)),
    )


@njit(cache=True, nogil=True)
def _search(p, n, d, tree, stack, light, point=None, scale=0.0):
    """
    Find a face that hides the sun; tell whether the answer is sure.

    ``p`` is where the ray starts: the point, or ``scale`` hairs beside ``point``.
    """
    inverse = (_invert(d[0]), _invert(d[1]), _invert(d[2]))
    sides = (
        0 if inverse[0] > 0.0 else 3,
        1 if inverse[1] > 0.0 else 4,
        2 if inverse[2] > 0.0 else 5,
    )
    # Boxes are asked in float32: the ray starts a little early, and ends a little late.
    x = np.copysign(_COARSE * p[0], d[0])
    y = np.copysign(_COARSE * p[1], d[1])
    z = np.copysign(_COARSE * p[2], d[2])
    start = (np.float32(p[0] + x), np.float32(p[1] + y), np.float32(p[2] + z))
    end = (np.float32(p[0] - x), np.float32(p[1] - y), np.float32(p[2] - z))
    stack[0] = 0
    size = 1
    is_sure = True
    while size > 0:
        size -= 1
        node = np.int64(stack[size])
        met = meet_boxes(tree.boxes, node, sides, start, end, inverse)
        while met != 0:
            child = np.int64(tree.links[node, find_lowest(met)])
            met &= met - 1
            if child >= 0:
                stack[size] = child
                size += 1
                continue
            if point is None:
                answer = _hides(~child, p, n, d, tree, light)
            else:
                answer = _hides_beside(~child, p, n, d, tree, light, point, scale)
            if answer == _YES:
                return ~child, True
            if answer == _UNSURE:
                is_sure = False
    return np.int64(-1), is_sure


@njit(cache=True, nogil=True, inline="always")
def _invert(x):
    """Return 1 / x in float32, or a finite number as large for 0, which no box makes NaN."""
    return np.float32(1.0 / x if abs(x) > _TINY else np.copysign(1.0 / _TINY, x))


@njit(cache=True, nogil=True, inline="always")
def _hides(f, p, n, d, tree, light):
    """Tell whether a face lies between a point and the sun, or that rounding would decide."""
    m, touch, c = get(tree.normals, f), tree.normals[f, 3], get(tree.corners, f)
    at_light = _dot(m, d) if light is None else _height(light, c, m)
    height = _height(p, c, m)
    is_on = abs(height) <= touch
    if is_on:
        above = _dot(m, n)
        if above * at_light > 0.0 and abs(above) > _STEEP:
            return _NO  # the surface itself, or one that goes on from it
    elif not height * at_light < 0.0:
        return _NO
    a, b, e = _see(p, f, tree)
    # These come out the same, but for the sign, whichever way an edge is followed.
    ab, bc, ca = _side(a, b, d), _side(b, e, d), _side(e, a, d)
    least, most = min(ab, bc, ca), max(ab, bc, ca)
    one, two, three = _measure(a), _measure(b), _measure(e)
    length = one + two + three
    error = touch * length + _ROUNDING * length * length  # of any edge, at most
    if least < -error and most > error:
        return _NO
    if not is_on and (least > error or most < -error):
        return _YES
    ab_error = touch * (one + two) + _ROUNDING * one * two
    bc_error = touch * (two + three) + _ROUNDING * two * three
    ca_error = touch * (three + one) + _ROUNDING * three * one
    if (
        min(ab + ab_error, bc + bc_error, ca + ca_error) < 0.0
        and max(ab - ab_error, bc - bc_error, ca - ca_error) > 0.0
    ):
        return _NO  # outside of one edge, whatever the others say
    if is_on or abs(ab) <= ab_error or abs(bc) <= bc_error or abs(ca) <= ca_error:
        return _UNSURE
    return _YES


@njit(cache=True, nogil=True)
def _hides_beside(f, q, n, d, tree, light, p, scale):
    """Tell the same of a ray that starts at ``q``, ``scale`` hairs beside its point ``p``."""
    m, touch, c = get(tree.normals, f), tree.normals[f, 3], get(tree.corners, f)
    at_light = _dot(m, d) if light is None else _height(light, c, m)
    if abs(_height(p, c, m)) <= touch and n[0] == n[0]:  # not NaN: the point has a surface
        up = scale * _LIFT
        q = (q[0] + up * n[0], q[1] + up * n[1], q[2] + up * n[2])
    if not _height(q, c, m) * at_light < 0.0:
        return _NO
    a, b, e = _see(q, f, tree)
    i, j, k = get(tree.ids, f)
    # Every edge is asked from its lower vertex, so that 0 is on one side of it for both its faces.
    ab, bc, ca = _is_left(a, b, d, i < j), _is_left(b, e, d, j < k), _is_left(e, a, d, k < i)
    return _YES if ab == bc == ca else _NO


@njit(cache=True, nogil=True, inline="always")
def _is_left(u, v, d, forward):
    """Tell on which side of the edge u to v a ray passes, asked from v to u if not forward."""
    return ((_side(u, v, d) if forward else _side(v, u, d)) >= 0.0) == forward


@njit(cache=True, nogil=True, inline="always")
def _see(p, f, tree):
    """Return where a face's corners lie from a place."""
    c = tree.corners
    return (
        (c[f, 0] - p[0], c[f, 1] - p[1], c[f, 2] - p[2]),
        (c[f, 3] - p[0], c[f, 4] - p[1], c[f, 5] - p[2]),
        (c[f, 6] - p[0], c[f, 7] - p[1], c[f, 8] - p[2]),
    )


@njit(cache=True, nogil=True, inline="always")
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True, inline="always")
def _height(p, c, m):
    """Return how high a place lies above a face's plane [m]."""
    return m[0] * (p[0] - c[0]) + m[1] * (p[1] - c[1]) + m[2] * (p[2] - c[2])


@njit(cache=True, nogil=True, inline="always")
def _side(u, v, d):
    """Tell on which side of the edge u to v a ray passes."""
    return (
        d[0] * (u[1] * v[2] - u[2] * v[1])
        + d[1] * (u[2] * v[0] - u[0] * v[2])
        + d[2] * (u[0] * v[1] - u[1] * v[0])
    )


@njit(cache=True, nogil=True, inline="always")
def _measure(u):
    return abs(u[0]) + abs(u[1]) + abs(u[2])


@njit(cache=True, nogil=True, parallel=True)
def _find(points, normals, suns, tree, attached, masks):
    count = points.shape[0]
    for block in prange((count + _BLOCK - 1) // _BLOCK):
        stack = np.zeros(DEEPEST, np.int32)
        for i in range(block * _BLOCK, min(count, (block + 1) * _BLOCK)):
            p, n = get(points, i), get(normals, i)
            last = -1  # what hid the sun before mostly still does
            for s in range(suns.shape[0]):
                d = get(suns, s)
                if _dot(n, d) <= 0.0:
                    masks[s, i] = attached
                    continue
                face = is_hidden(p, n, d, tree, stack, last)
                if face >= 0:
                    masks[s, i] = 1
                    last = face


@njit(cache=True, nogil=True, parallel=True)
def _find_from(points, normals, lights, tree, masks):
    count = points.shape[0]
    for block in prange((count + _BLOCK - 1) // _BLOCK):
        stack = np.zeros(DEEPEST, np.int32)
        for i in range(block * _BLOCK, min(count, (block + 1) * _BLOCK)):
            p, n = get(points, i), get(normals, i)
            last = -1
            for s in range(lights.shape[0]):
                light, w = get(lights, s), lights[s, 3]
                d = (light[0] - w * p[0], light[1] - w * p[1], light[2] - w * p[2])
                length = np.sqrt(_dot(d, d))
                if length == 0.0:
                    continue
                d = (d[0] / length, d[1] / length, d[2] / length)
                if _dot(n, d) <= 0.0:
                    masks[s, i] = 1
                    continue
                if w == 0.0:
                    face = is_hidden(p, n, d, tree, stack, last)
                else:
                    face = is_hidden(p, n, d, tree, stack, last, light)
                if face >= 0:
                    masks[s, i] = 1
                    last = face
