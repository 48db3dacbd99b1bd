"""Bounding volume hierarchy over casting faces, for rays of any origin."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.volume.adjacency import Caster

__all__ = ["DEEPEST", "FaceTree", "make_face_tree"]

DEEPEST = 128
"""Nodes that a search keeps waiting, at most."""
TOUCH = 2.0**-46
"""
Of the largest coordinate: within so much of a plane a point lies on it. A sample of a face is
off its plane by some 2^-50 of it.
"""
_LEAF = 4
_BINS = 16
_BALANCED = 48  # below this depth nodes are halved, so that no search keeps more waiting


@dataclass(frozen=True, eq=False)
class FaceTree:
    """
    Bounding volume hierarchy over casting faces, for rays of any origin.

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
    normals : (n_faces, 4) float64
        Unit normals, and how near a face's plane a point lies on it, for all that float64
        tells at these coordinates [m].
    """

    boxes: NDArray[np.float64]
    links: NDArray[np.int32]
    corners: NDArray[np.float64]
    ids: NDArray[np.int32]
    normals: NDArray[np.float64]


def make_face_tree(caster: Caster, farthest: float = 0.0) -> FaceTree:
    """
    Build the tree of a caster's faces; those without area are left out, nothing hides behind them.

    ``farthest`` is the largest coordinate of the model's own frame [m], in which points are
    given: they are as coarse as that.
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
    most = np.abs(corners).max(initial=0.0)
    margin = 1e-9 * (1.0 + most)
    touch = np.full((len(kept), 1), TOUCH * max(most, farthest))
    boxes = boxes[:nodes] + margin * np.array([-1, -1, -1, 1, 1, 1])
    return FaceTree(
        boxes,
        links[:nodes].copy(),
        corners[order].reshape(-1, 9),
        np.ascontiguousarray(ids[order]),
        np.hstack([(planes[kept] / length[kept, None])[order], touch]),
    )


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
