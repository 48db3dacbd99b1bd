"""
Bounding volume hierarchy over casters, to find those in a light's range with visible shadows.

Boxes are sorted along a space-filling curve, eight to a node and eight nodes to a parent. Moving
casters only refit the nodes; the order is recomputed when the nodes have grown too large. Tests run
on nodes first, since a node's shadow contains the shadows of its boxes.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.volume.adjacency import sort_along_curve
from umbra.volume.bounds import is_beyond_any, is_seen

__all__ = ["BoxTree"]

_WIDTH = 8  # boxes or child nodes per node
_MOST = 2.0  # growth of the lowest nodes' total size that triggers a new order
_NOWHERE = np.zeros((0, 4))


@dataclass(eq=False)
class BoxTree:
    """
    Bounding volume hierarchy over boxes (n, 2, 3).

    Parameters
    ----------
    bounds : (n, 2, 3) float64
        Lowest and highest corner of each [m].
    """

    bounds: NDArray[np.float64]
    _order: NDArray[np.intp] = field(init=False)
    _starts: NDArray[np.intp] = field(init=False)
    _nodes: NDArray[np.float64] = field(init=False)
    _size: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        self._order = sort_along_curve(self.bounds.mean(1))
        counts = [-(-len(self.bounds) // _WIDTH)]
        while counts[-1] > 1:
            counts.append(-(-counts[-1] // _WIDTH))
        self._starts = np.append(0, np.cumsum(counts))
        self._nodes = np.zeros((self._starts[-1], 2, 3))
        self._size = _fit(self.bounds, self._order, self._starts, self._nodes)

    def fit(self, bounds: NDArray[np.float64]) -> "BoxTree":
        """Return the tree of moved boxes, (n, 2, 3) [m], in this one's order while that serves."""
        fitted = copy(self)
        fitted.bounds, fitted._nodes = bounds, np.zeros_like(self._nodes)
        size = _fit(bounds, self._order, self._starts, fitted._nodes)
        return BoxTree(bounds) if size > _MOST * self._size else fitted

    def find_seen(
        self,
        lights: NDArray[np.float64],
        views: NDArray[np.float64],
        *,
        floor: float | None = None,
        reaches: NDArray[np.float64] | None = None,
        cones: Sequence[NDArray[np.float64] | None] = (),
    ) -> NDArray[np.bool_]:
        """
        Find the boxes in each light's range and cone whose shadow volumes may be in view.

        Parameters
        ----------
        lights : (n_lights, 4) float64
        views : (n_lights, k, 4) float64
            Inward planes of what each light shows; all 0 where that is nothing.
        floor : float, optional
            Volumes are cut at this z, below all receivers [m].
        reaches : (n_lights,) float64, optional
            Ranges of the lights [m].
        cones : sequence of (k, 4) float64 or None
            Inward planes around each light's cone.

        Returns
        -------
        is_seen : (n_lights, n) bool
        """
        is_seen = np.zeros((len(lights), len(self.bounds)), np.bool_)
        around = [_NOWHERE if cone is None else cone for cone in cones] or [_NOWHERE] * len(lights)
        starts = np.append(0, np.cumsum([len(cone) for cone in around], dtype=np.int64))
        _find_seen(
            self.bounds, self._order, self._starts, self._nodes, lights, views,
            np.nan if floor is None else float(floor),
            np.full(len(lights), np.inf) if reaches is None else reaches,
            np.concatenate([_NOWHERE, *around]), starts, is_seen,
        )  # fmt: skip
        return is_seen

    def find_holding(
        self, places: NDArray[np.float64], margin: float = 0.0
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """
        Find the boxes within a margin [m] of points (n, 3).

        Returns the point and the box of each pair found, in order.
        """
        is_holding = np.zeros((len(places), len(self.bounds)), np.bool_)
        _find_holding(
            self.bounds, self._order, self._starts, self._nodes, places, margin, is_holding
        )
        points, boxes = is_holding.nonzero()
        return points, boxes


@kernel
def _fit(bounds, order, starts, nodes):
    """Write the boxes of all nodes; return the total size of the lowest nodes."""
    size = 0.0
    for level in range(starts.size - 1):
        below = order.size if level == 0 else starts[level] - starts[level - 1]
        for node in range(starts[level + 1] - starts[level]):
            box = nodes[starts[level] + node]
            for axis in range(3):
                box[0, axis], box[1, axis] = np.inf, -np.inf
            for child in range(node * _WIDTH, min((node + 1) * _WIDTH, below)):
                own = bounds[order[child]] if level == 0 else nodes[starts[level - 1] + child]
                for axis in range(3):
                    box[0, axis] = min(box[0, axis], own[0, axis])
                    box[1, axis] = max(box[1, axis], own[1, axis])
            if level == 0:
                size += box[1, 0] - box[0, 0] + (box[1, 1] - box[0, 1]) + (box[1, 2] - box[0, 2])
    return size


@kernel
def _is_within_all(planes, box):
    """Return whether a box lies wholly within all planes."""
    for k in range(planes.shape[0]):
        lowest = planes[k, 3]
        for axis in range(3):
            lowest += min(planes[k, axis] * box[0, axis], planes[k, axis] * box[1, axis])
        if lowest < 0.0:
            return False
    return True


@kernel
def _find_seen(
    bounds, order, starts, nodes, lights, views, floor, reaches, cones, cone_starts, seen
):
    """Mark the boxes of ``find_seen``, from the root down."""
    points = np.zeros((16, 4))
    stack = np.zeros((_WIDTH * starts.size, 2), np.int64)
    for k in range(lights.shape[0]):
        light, planes, reach = lights[k], views[k], reaches[k]
        cone = cones[cone_starts[k] : cone_starts[k + 1]]
        stack[0, 0], stack[0, 1] = starts.size - 2, 0  # level and node; the root is the highest
        depth = 0
        for plane in range(planes.shape[0] if order.size else 0):
            for axis in range(4):
                depth = 1 if planes[plane, axis] != 0.0 else depth
        while depth:
            depth -= 1
            level, node = stack[depth, 0], stack[depth, 1]
            below = order.size if level == 0 else starts[level] - starts[level - 1]
            for child in range(node * _WIDTH, min((node + 1) * _WIDTH, below)):
                box = bounds[order[child]] if level == 0 else nodes[starts[level - 1] + child]
                if is_beyond_any(cone, box):
                    continue
                if not is_seen(box, light, planes, floor, reach, points):
                    continue
                if level == 0:
                    seen[k, order[child]] = True
                elif not cone.size and reach == np.inf and _is_within_all(planes, box):
                    leaves = _WIDTH**level
                    for leaf in range(child * leaves, min((child + 1) * leaves, order.size)):
                        seen[k, order[leaf]] = True
                else:
                    stack[depth, 0], stack[depth, 1] = level - 1, child
                    depth += 1


@kernel
def _find_holding(bounds, order, starts, nodes, places, margin, is_holding):
    """Mark the boxes of ``find_holding``, from the root down."""
    stack = np.zeros((_WIDTH * starts.size, 2), np.int64)
    for k in range(places.shape[0]):
        point = places[k]
        stack[0, 0], stack[0, 1] = starts.size - 2, 0
        depth = 1 if order.size else 0
        while depth:
            depth -= 1
            level, node = stack[depth, 0], stack[depth, 1]
            below = order.size if level == 0 else starts[level] - starts[level - 1]
            for child in range(node * _WIDTH, min((node + 1) * _WIDTH, below)):
                box = bounds[order[child]] if level == 0 else nodes[starts[level - 1] + child]
                holds = True
                for axis in range(3):
                    holds &= point[axis] >= box[0, axis] - margin
                    holds &= point[axis] <= box[1, axis] + margin
                if not holds:
                    continue
                if level == 0:
                    is_holding[k, order[child]] = True
                else:
                    stack[depth, 0], stack[depth, 1] = level - 1, child
                    depth += 1
