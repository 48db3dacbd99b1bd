"""
What lies between single points and the sun, for receivers that no raster can serve.

Each ray is tried in float64, face by face, through a hierarchy of boxes. A point is meant as
the limit from the side that its surface shows: a face on which it lies is between it
and the sun only if the sun is on the other side. Every edge is asked in one direction,
from its lower vertex to its higher, so that two faces which share it never both miss a
ray. Where rounding could tell either way (the point on a fold or a plane, the ray through an
edge or a corner), the whole ray is tried again from a hair above and beside the point, to the
east and north as cells of a plan are: faces of parts that touch then tell one story. With the
sun as light any face between hides it, so the answer is whether the shadow count is not 0.
"""

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.machine import use_threads
from umbra.rays.face_tree import DEEPEST, FaceTree

__all__ = ["find_hidden", "find_hidden_from", "is_hidden"]

_ASIDE = 2.0**-24
"""How far beside its point a ray starts where rounding could tell either way [m], ..."""
_ABOVE = 2.0**-28
"""... and how far above its surface: less, so that a ray which grazes an edge passes beside it."""
_LIFT = 16.0 * _ASIDE
"""Above a face on which its point lies it starts higher: there the surface's side decides."""
_STEEP = 0.125  # cosine; faces that are steeper to a surface are not left by going above it
_ROUNDING = 2.0**-48  # of a product of two lengths
_TINY = 1e-200
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
    t = tree
    _find(
        points, normals, np.ascontiguousarray(suns), t.boxes, t.links, t.corners, t.ids,
        t.normals, attached, masks,
    )  # fmt: skip
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
    t = tree
    _find_from(
        points, normals, np.ascontiguousarray(lights), t.boxes, t.links, t.corners, t.ids,
        t.normals, masks,
    )  # fmt: skip
    return masks


@njit(cache=True, nogil=True)
def is_hidden(p, n, d, boxes, links, corners, ids, normals, last, light=None):
    """
    Find a face between a point and the light, in the tree's order; -1 where there is none.

    ``p`` is the point, ``n`` its surface's normal toward the viewer, ``d`` the direction toward the
    light, ``last`` a face to try first (negative for none); ``light``, if any, a lamp (4,) with
    w = 1, beyond which nothing hides. The rest are arrays of a ``FaceTree``.
    """
    if last >= 0 and _hides(last, p, n, d, corners, ids, normals, light) == _YES:
        return last
    face, is_sure = _search(p, n, d, boxes, links, corners, ids, normals, light)
    if is_sure:
        return face
    scale = max(1.0, 2.0 * normals[0, 3] / _ABOVE)
    q = np.empty(3)
    _step_aside(p, n, scale, q)
    face, _ = _search(q, n, d, boxes, links, corners, ids, normals, light, p, scale)
    return face


@njit(cache=True, nogil=True)
def _step_aside(p, n, scale, q):
    """Find the place a hair above a surface and beside the point, to the east and north."""
    is_free = not n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0.0
    along = 0.0 if is_free else n[0] + 0.618 * n[1] + 0.382 * n[2]
    for k, east in ((0, 1.0), (1, 0.618), (2, 0.382)):
        up = 0.0 if is_free else n[k]
        q[k] = p[k] + scale * (_ABOVE * up + _ASIDE * (east - along * up))


@njit(cache=True, nogil=True)
def _search(p, n, d, boxes, links, corners, ids, normals, light, point=None, scale=0.0):
    """
    Find a face that hides the sun; tell whether the answer is sure.

    ``p`` is where the ray starts: the point, or ``scale`` hairs beside ``point``.
    """
    inverse = (_invert(d[0]), _invert(d[1]), _invert(d[2]))
    stack = np.empty(DEEPEST, np.int32)
    stack[0] = 0
    size = 1 if ids.shape[0] > 0 else 0
    is_sure = True
    while size > 0:
        size -= 1
        node = stack[size]
        near = 0.0
        far = np.inf
        for k in range(3):
            a = (boxes[node, k] - p[k]) * inverse[k]
            b = (boxes[node, k + 3] - p[k]) * inverse[k]
            near = max(near, min(a, b))
            far = min(far, max(a, b))
        if near > far * (1.0 + 1e-12):
            continue
        first = links[node, 0]
        count = links[node, 1]
        if count < 0:
            stack[size] = first
            stack[size + 1] = first + 1
            size += 2
            continue
        for f in range(first, first + count):
            answer = _hides(f, p, n, d, corners, ids, normals, light, point, scale)
            if answer == _YES:
                return f, True
            if answer == _UNSURE:
                is_sure = False
    return -1, is_sure


@njit(cache=True, nogil=True)
def _invert(x):
    """Return 1 / x, or a finite number as large for 0, which no box's corner makes NaN."""
    if abs(x) < _TINY:
        return 1.0 / _TINY if x >= 0.0 else -1.0 / _TINY
    return 1.0 / x


@njit(cache=True, nogil=True)
def _hides(f, p, n, d, corners, ids, normals, light=None, point=None, scale=0.0):
    """Tell whether a face lies between a point and the sun, or that rounding would decide."""
    c = corners[f]
    m = normals[f]
    touch = m[3]
    if light is None:
        at_light = m[0] * d[0] + m[1] * d[1] + m[2] * d[2]
    else:
        at_light = _height(light[0], light[1], light[2], c, m)
    x, y, z = p[0], p[1], p[2]
    if point is not None and abs(_height(point[0], point[1], point[2], c, m)) <= touch:
        up = scale * _LIFT
        if n[0] == n[0]:  # not NaN: the point has a surface
            x, y, z = x + up * n[0], y + up * n[1], z + up * n[2]
    height = _height(x, y, z, c, m)
    is_on = point is None and abs(height) <= touch
    if is_on:
        above = m[0] * n[0] + m[1] * n[1] + m[2] * n[2]
        if above * at_light > 0.0 and abs(above) > _STEEP:
            return _NO  # the surface itself, or one that goes on from it
    elif not height * at_light < 0.0:
        return _NO
    ax, ay, az = c[0] - x, c[1] - y, c[2] - z
    bx, by, bz = c[3] - x, c[4] - y, c[5] - z
    ex, ey, ez = c[6] - x, c[7] - y, c[8] - z
    i, j, k = ids[f, 0], ids[f, 1], ids[f, 2]
    ab, ab_error = _side(ax, ay, az, bx, by, bz, d, i < j, touch)
    bc, bc_error = _side(bx, by, bz, ex, ey, ez, d, j < k, touch)
    ca, ca_error = _side(ex, ey, ez, ax, ay, az, d, k < i, touch)
    if point is not None:
        left = (ab >= 0.0) == (i < j)
        is_inside = left == ((bc >= 0.0) == (j < k)) and left == ((ca >= 0.0) == (k < i))
        return _YES if is_inside else _NO
    ab, bc, ca = _turn(ab, i < j), _turn(bc, j < k), _turn(ca, k < i)
    if (
        min(ab + ab_error, bc + bc_error, ca + ca_error) < 0.0
        and max(ab - ab_error, bc - bc_error, ca - ca_error) > 0.0
    ):
        return _NO  # outside of one edge, whatever the others say
    if is_on or abs(ab) <= ab_error or abs(bc) <= bc_error or abs(ca) <= ca_error:
        return _UNSURE
    return _YES


@njit(cache=True, nogil=True)
def _height(x, y, z, c, m):
    """Return how high a place lies above a face's plane [m]."""
    return m[0] * (x - c[0]) + m[1] * (y - c[1]) + m[2] * (z - c[2])


@njit(cache=True, nogil=True)
def _turn(side, forward):
    return side if forward else -side


@njit(cache=True, nogil=True)
def _side(ux, uy, uz, vx, vy, vz, d, forward, touch):
    """Tell on which side of the edge u to v a ray passes, from its lower vertex, and its error."""
    if not forward:
        ux, uy, uz, vx, vy, vz = vx, vy, vz, ux, uy, uz
    side = d[0] * (uy * vz - uz * vy) + d[1] * (uz * vx - ux * vz) + d[2] * (ux * vy - uy * vx)
    u, v = abs(ux) + abs(uy) + abs(uz), abs(vx) + abs(vy) + abs(vz)
    return side, touch * (u + v) + _ROUNDING * u * v


@njit(cache=True, nogil=True, parallel=True)
def _find(points, normals, suns, boxes, links, corners, ids, face_normals, attached, masks):
    n = points.shape[0]
    for block in prange((n + _BLOCK - 1) // _BLOCK):
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            p = points[i]
            m = normals[i]
            last = -1  # what hid the sun before mostly still does
            for s in range(suns.shape[0]):
                d = suns[s]
                if m[0] * d[0] + m[1] * d[1] + m[2] * d[2] <= 0.0:
                    masks[s, i] = attached
                    continue
                face = is_hidden(p, m, d, boxes, links, corners, ids, face_normals, last)
                if face >= 0:
                    masks[s, i] = 1
                    last = face


@njit(cache=True, nogil=True, parallel=True)
def _find_from(points, normals, lights, boxes, links, corners, ids, face_normals, masks):
    n = points.shape[0]
    for block in prange((n + _BLOCK - 1) // _BLOCK):
        d = np.empty(3)
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            p = points[i]
            m = normals[i]
            last = -1
            for s in range(lights.shape[0]):
                light = lights[s]
                length = 0.0
                for k in range(3):
                    d[k] = light[k] - light[3] * p[k]
                    length += d[k] * d[k]
                if length == 0.0:
                    continue
                for k in range(3):
                    d[k] /= np.sqrt(length)
                if m[0] * d[0] + m[1] * d[1] + m[2] * d[2] <= 0.0:
                    masks[s, i] = 1
                    continue
                if light[3] == 0.0:
                    face = is_hidden(p, m, d, boxes, links, corners, ids, face_normals, last)
                else:
                    face = is_hidden(p, m, d, boxes, links, corners, ids, face_normals, last, light)
                if face >= 0:
                    masks[s, i] = 1
                    last = face
