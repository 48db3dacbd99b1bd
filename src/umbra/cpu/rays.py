"""
What lies between single points and the sun, for receivers that no raster can serve.

Each way is tried in float64, face by face, through a tree of boxes. A point is meant as
the limit from the side that its surface shows: a face on which it lies is between it
and the sun only if the sun is on the other side. Every edge is asked in one direction,
from its lower vertex to its higher, so that two faces which share it never both miss a
way. With the sun as light any face between hides it, so the answer is whether the
shadow count is not 0.
"""

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.cpu.face_tree import DEEPEST, FaceTree
from umbra.cpu.threads import use_threads

__all__ = ["TOUCH", "find_hidden", "is_hidden"]

TOUCH = 1e-6
"""Within this distance of a face's plane a point lies on it [m]."""
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


@njit(cache=True, nogil=True)
def is_hidden(p, n, d, boxes, links, corners, ids, normals, last):
    """
    Find a face between a point and the sun.

    Parameters
    ----------
    p, n, d : (3,) float64
        Point, its surface's normal toward the viewer, direction toward the sun.
    boxes, links, corners, ids, normals : arrays
        Of a ``FaceTree``.
    last : int
        A face to try first; negative for none.

    Returns
    -------
    face : int
        In the tree's order; -1 where there is none.
    """
    if last >= 0 and _hides(last, p, n, d, corners, ids, normals):
        return last
    inverse = (_invert(d[0]), _invert(d[1]), _invert(d[2]))
    stack = np.empty(DEEPEST, np.int32)
    stack[0] = 0
    size = 1 if ids.shape[0] > 0 else 0
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
            if _hides(f, p, n, d, corners, ids, normals):
                return f
    return -1


@njit(cache=True, nogil=True)
def _invert(x):
    """Give 1 / x, or a finite number as large for 0, which no box's corner makes NaN."""
    if abs(x) < 1e-200:
        return 1e200 if x >= 0.0 else -1e200
    return 1.0 / x


@njit(cache=True, nogil=True)
def _hides(f, p, n, d, corners, ids, normals):
    """Whether a face lies between the limit of a point from its surface's side and the sun."""
    c = corners[f]
    m = normals[f]
    at_light = m[0] * d[0] + m[1] * d[1] + m[2] * d[2]
    if at_light == 0.0:
        return False
    ax, ay, az = c[0] - p[0], c[1] - p[1], c[2] - p[2]
    height = -(m[0] * ax + m[1] * ay + m[2] * az)
    if abs(height) <= TOUCH:
        if not (m[0] * n[0] + m[1] * n[1] + m[2] * n[2]) * at_light < 0.0:
            return False
    elif not height * at_light < 0.0:
        return False
    bx, by, bz = c[3] - p[0], c[4] - p[1], c[5] - p[2]
    ex, ey, ez = c[6] - p[0], c[7] - p[1], c[8] - p[2]
    i, j, k = ids[f, 0], ids[f, 1], ids[f, 2]
    ab = _side(ax, ay, az, bx, by, bz, d, i < j)
    bc = _side(bx, by, bz, ex, ey, ez, d, j < k)
    ca = _side(ex, ey, ez, ax, ay, az, d, k < i)
    return ab == bc and bc == ca


@njit(cache=True, nogil=True)
def _side(ux, uy, uz, vx, vy, vz, d, forward):
    """Tell on which side of the edge u to v a way passes, asked from its lower vertex."""
    if not forward:
        ux, uy, uz, vx, vy, vz = vx, vy, vz, ux, uy, uz
    side = d[0] * (uy * vz - uz * vy) + d[1] * (uz * vx - ux * vz) + d[2] * (ux * vy - uy * vx)
    return (side >= 0.0) == forward


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
