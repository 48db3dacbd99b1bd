"""
What lies between single points and the sun, for receivers that no raster can serve.

A tree of boxes over the casting faces, each way tried in float64. A point is meant as
the limit from the side that its surface shows: a face on which it lies is between it
and the sun only if the sun is on the other side. Every edge is asked in one direction,
from its lower vertex to its higher, so that two faces which share it never both miss a
way. With the sun as light any face between hides it, so the answer is whether the
shadow count is not 0.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.cpu.threads import use_threads
from umbra.volume.adjacency import Caster

__all__ = ["TOUCH", "FaceTree", "find_hidden", "is_hidden", "make_face_tree"]

TOUCH = 1e-6
"""Within this distance of a face's plane a point lies on it [m]."""
_LEAF = 4
_BINS = 16
_DEEPEST = 128
_BALANCED = 48  # below this depth nodes are halved, so that no tree is deeper than the stack
_BLOCK = 64  # points that a thread takes at a time


@dataclass(frozen=True, eq=False)
class FaceTree:
    """
    Casting faces in a tree of boxes, for ways that start anywhere.

    Parameters
    ----------
    boxes : (n_nodes, 6) float64
        Lowest and highest corner, a little enlarged.
    links : (n_nodes, 2) int32
        First child (the second follows it) and -1, or first face and number of faces.
    corners : (n_faces, 9) float64
        In the tree's order.
    ids : (n_faces, 3) int32
        Welded vertices.
    normals : (n_faces, 3) float64
        Unit normals.
    """

    boxes: NDArray[np.float64]
    links: NDArray[np.int32]
    corners: NDArray[np.float64]
    ids: NDArray[np.int32]
    normals: NDArray[np.float64]


def make_face_tree(caster: Caster) -> FaceTree:
    """
    Build the tree of a caster's faces.

    Parameters
    ----------
    caster : Caster
        Faces without area are left out: nothing hides behind them.
    """
    planes = caster.planes[:3, :-1].T
    length = np.linalg.norm(planes, axis=1)
    kept = np.flatnonzero(length > 0)
    ids = caster.faces[kept]
    corners = caster.vertices[ids]
    low, high = corners.min(1), corners.max(1)
    order = np.arange(len(kept))
    boxes = np.zeros((max(2 * len(kept), 1), 6))
    links = np.zeros((max(2 * len(kept), 1), 2), np.int32)
    nodes = _build(low, high, (low + high) / 2, order, boxes, links)
    margin = 1e-9 * (1.0 + np.abs(corners).max(initial=0.0))
    boxes = boxes[:nodes] + margin * np.array([-1, -1, -1, 1, 1, 1])
    return FaceTree(
        boxes,
        links[:nodes].copy(),
        corners[order].reshape(-1, 9),
        np.ascontiguousarray(ids[order]),
        np.ascontiguousarray((planes[kept] / length[kept, None])[order]),
    )


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
    stack = np.empty(_DEEPEST, np.int32)
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


@njit(cache=True, nogil=True)
def _area(box):
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return x * y + y * z + z * x


@njit(cache=True, nogil=True)
def _widen(box, low, high):
    for k in range(3):
        box[k] = min(box[k], low[k])
        box[k + 3] = max(box[k + 3], high[k])


@njit(cache=True, nogil=True)
def _clear(box):
    box[:3] = np.inf
    box[3:] = -np.inf


@njit(cache=True, nogil=True)
def _build(low, high, middle, order, boxes, links):
    """Split by the surface area heuristic over bins; reorder ``order``; give the nodes."""
    n = order.size
    if n == 0:
        return 1
    bins = np.empty((_BINS, 6))
    filled = np.empty(_BINS, np.int64)
    right = np.empty(_BINS)
    box = np.empty(6)
    spread = np.empty(6)
    work = np.empty((2 * n, 4), np.int64)  # node, first, end, depth
    work[0, 0], work[0, 1], work[0, 2], work[0, 3] = 0, 0, n, 0
    waiting = 1
    nodes = 1
    while waiting > 0:
        waiting -= 1
        node, first, end, depth = work[waiting]
        _clear(boxes[node])
        _clear(spread)
        for i in range(first, end):
            _widen(boxes[node], low[order[i]], high[order[i]])
            _widen(spread, middle[order[i]], middle[order[i]])
        axis = 0
        for k in range(1, 3):
            if spread[k + 3] - spread[k] > spread[axis + 3] - spread[axis]:
                axis = k
        width = spread[axis + 3] - spread[axis]
        if end - first <= _LEAF:
            links[node, 0], links[node, 1] = first, end - first
            continue
        cut = first
        if width > 0.0 and depth < _BALANCED:
            scale = _BINS * (1.0 - 1e-12) / width
            for b in range(_BINS):
                _clear(bins[b])
                filled[b] = 0
            for i in range(first, end):
                b = np.int64((middle[order[i], axis] - spread[axis]) * scale)
                filled[b] += 1
                _widen(bins[b], low[order[i]], high[order[i]])
            _clear(box)
            count = 0
            for b in range(_BINS - 1, 0, -1):
                count += filled[b]
                _widen(box, bins[b, :3], bins[b, 3:])
                right[b] = count * _area(box) if count > 0 else 0.0
            _clear(box)
            count = 0
            best = np.inf
            at = 1
            for b in range(1, _BINS):
                count += filled[b - 1]
                _widen(box, bins[b - 1, :3], bins[b - 1, 3:])
                cost = (count * _area(box) if count > 0 else 0.0) + right[b]
                if cost < best and 0 < count < end - first:
                    best = cost
                    at = b
            for i in range(first, end):
                if np.int64((middle[order[i], axis] - spread[axis]) * scale) < at:
                    order[i], order[cut] = order[cut], order[i]
                    cut += 1
        if cut in (first, end):
            cut = (first + end) // 2  # all in one place
        links[node, 0], links[node, 1] = nodes, -1
        for child in range(2):
            work[waiting + child, 0] = nodes + child
            work[waiting + child, 1] = cut if child else first
            work[waiting + child, 2] = end if child else cut
            work[waiting + child, 3] = depth + 1
        waiting += 2
        nodes += 2
    return nodes
