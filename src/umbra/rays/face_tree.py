"""Bounding volume hierarchy over casting faces, for rays of any origin."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, kernel
from umbra.rays.lanes import LANES
from umbra.volume.adjacency import Caster

__all__ = ["DEEPEST", "FaceTree", "halve_boxes", "make_face_tree"]

DEEPEST = 1024
"""Size of a search's stack of nodes."""
TOUCH = 2.0**-46
"""
Distance within which a point lies on a plane, relative to the largest coordinate. A sample of a
face is off its plane by some 2^-50.
"""
_NEEDLE = 2.0**-50  # of length^3 / twice the area: how far rounding tilts a face's plane,
_MOST_TILTED = 2.0**-30  # at most [m]
_BINS = 16
_BALANCED = 48  # below this depth nodes are halved, to bound the stack of a search


class FaceTree(NamedTuple):
    """
    Bounding volume hierarchy over casting faces, for rays of any origin.

    Parameters
    ----------
    boxes : (n_nodes, 6, LANES) float32
        Bounds of a node's children: lowest x, y, z and highest x, y, z, slightly enlarged; no ray
        meets the box of an empty slot.
    links : (n_nodes, LANES) int32
        The children: a node, or a face's complement (``~face``, below 0).
    corners : (n_faces, 9) float64
        Corners of the faces, in the tree's order.
    ids : (n_faces, 3) int32
        Welded vertices.
    source : (n_faces,) int64
        Their index in the caster.
    normals : (n_faces, 4) float64
        Unit normals, and the distance within which a point lies on the face's plane, by rounding of
        float64 at these coordinates, more for needles [m].
    tolerance : float
        The same, but for needles [m].
    """

    boxes: NDArray[np.float32]
    links: NDArray[np.int32]
    corners: NDArray[np.float64]
    ids: NDArray[np.int32]
    source: NDArray[np.intp]
    normals: NDArray[np.float64]
    tolerance: float


def make_face_tree(caster: Caster, farthest: float = 0.0) -> FaceTree:
    """
    Build the tree of a caster's faces; faces without area hide nothing and are left out.

    ``farthest`` is the largest coordinate of the model's own frame [m], which limits the precision
    of points given in it.
    """
    planes = caster.planes[:3, :-1].T
    length = np.linalg.norm(planes, axis=1)
    faces = np.flatnonzero(length > 0)
    ids = caster.faces[faces]
    corners = caster.vertices[ids]
    low, high = corners.min(1), corners.max(1)
    order, halves, children = halve_boxes(low, high)
    most = np.abs(corners).max(initial=0.0)
    tolerance = TOUCH * max(most, farthest)
    longest = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(1, initial=0.0)
    tilted = np.minimum(_NEEDLE * longest**3 / length[faces], _MOST_TILTED)
    # A repeated ray starts above the faces on which its point lies: see ``hidden``.
    margin = 1e-9 * (1.0 + most) + max(2.0**-19, 2.0**10 * tolerance)
    boxes, links = _join(halves, children, margin)
    return FaceTree(
        boxes,
        links,
        corners[order].reshape(-1, 9),
        np.ascontiguousarray(ids[order]),
        faces[order],
        np.hstack([planes[faces] / length[faces, None], np.maximum(tolerance, tilted)[:, None]])[
            order
        ],
        float(tolerance),
    )


def halve_boxes(
    low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.int32]]:
    """
    Split boxes, given by their corners (n, 3), recursively in two, down to single boxes.

    Returns their order; the boxes of nodes (2 n, 6); and for each node the first of its two
    children, or the complement of an index in that order.
    """
    order = np.arange(len(low))
    halves = np.zeros((max(2 * len(low), 1), 6))
    children = np.zeros(len(halves), np.int32)
    _halve(low, high, (low + high) / 2, order, halves, children)
    return order, halves, children


@borrowing
def _area(box):
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return x * y + y * z + z * x


@borrowing
def _widen(box, low, high):
    for k in range(3):
        box[k] = min(box[k], low[k])
        box[k + 3] = max(box[k + 3], high[k])


@borrowing
def _clear(box):
    box[:3] = np.inf
    box[3:] = -np.inf


@kernel
def _halve(low, high, middle, order, boxes, children):
    """
    Split faces recursively by the binned surface area heuristic; reorder ``order``.

    Writes each node's box and the first of its two children, or the complement of its face.
    """
    n = order.size
    if n == 0:
        return
    bins = np.empty((_BINS, 6))
    filled = np.empty(_BINS, np.int64)
    right = np.empty(_BINS)
    box = np.empty(6)
    spread = np.empty(6)
    work = np.empty((DEEPEST, 4), np.int64)  # node, first, end, depth
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
        if end - first == 1:
            children[node] = ~first
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
            cut = (first + end) // 2  # all middles coincide
        children[node] = nodes
        for child in range(2):
            work[waiting + child, 0] = nodes + child
            work[waiting + child, 1] = cut if child else first
            work[waiting + child, 2] = end if child else cut
            work[waiting + child, 3] = depth + 1
        waiting += 2
        nodes += 2


@kernel
def _join(halves, children, margin):
    """Collapse levels so that each node has up to LANES children, largest boxes first."""
    members = np.zeros(LANES, np.int64)
    source = np.zeros(1 + halves.shape[0] // 2, np.int64)
    boxes = np.zeros((0, 6, LANES), np.float32)
    links = np.zeros((0, LANES), np.int32)
    for write in range(2):
        nodes, at = 1, 0
        while at < nodes:
            n = 1
            members[0] = source[at]
            while n < LANES:
                largest, best = -1.0, -1
                for q in range(n):
                    if children[members[q]] > 0 and _area(halves[members[q]]) > largest:
                        largest, best = _area(halves[members[q]]), q
                if best < 0:
                    break
                members[n] = children[members[best]] + 1
                members[best] = children[members[best]]
                n += 1
            for q in range(n):
                child = children[members[q]]
                if child > 0:
                    source[nodes] = members[q]
                    child = nodes
                    nodes += 1
                if write and child != 0:
                    links[at, q] = child
                    for k in range(3):
                        boxes[at, k, q] = _round(halves[members[q], k] - margin, -np.inf)
                        boxes[at, 3 + k, q] = _round(halves[members[q], 3 + k] + margin, np.inf)
            at += 1
        if not write:
            boxes = np.zeros((nodes, 6, LANES), np.float32)
            boxes[:, :3] = np.inf
            boxes[:, 3:] = -np.inf
            links = np.zeros((nodes, LANES), np.int32)
    return boxes, links


@borrowing
def _round(x, toward):
    """Round to float32, toward -inf or inf."""
    y = np.float32(x)
    return np.nextafter(y, np.float32(toward)) if (y - x) * toward < 0.0 else y
