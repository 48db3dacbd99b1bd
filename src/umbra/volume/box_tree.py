"""
Bounding volume hierarchy over casters, to find those in a light's range with visible shadows.

Boxes are sorted along a space-filling curve, eight to a node and eight nodes to a parent. Moving
casters only refit the nodes; the order is recomputed when the nodes have grown too large. Tests run
on nodes first, since a node's shadow contains the shadows of its boxes.
"""

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from umbra.scene.camera import Camera
from umbra.volume.adjacency import sort_along_curve
from umbra.volume.bounds import find_far_plane, is_seen
from umbra.volume.regions import find_view_planes

__all__ = ["BoxTree"]

_WIDTH = 8  # boxes or child nodes per node
_MOST = 2.0  # growth of the lowest nodes' total size that triggers a new order
_NOWHERE = np.zeros((0, 4))


@dataclass(eq=False)
class BoxTree:
    """
    Bounding volume hierarchy over boxes (n, 2, 3); ``fit`` moves them.

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

    def fit(self, bounds: NDArray[np.float64]) -> None:
        """Refit the tree to moved boxes, (n, 2, 3) [m]."""
        self.bounds = bounds
        if _fit(bounds, self._order, self._starts, self._nodes) > _MOST * self._size:
            self.__post_init__()

    def find_seen(
        self,
        light: NDArray[np.float64],
        camera: Camera,
        origin: ArrayLike = (0.0, 0.0, 0.0),
        *,
        scissor: ArrayLike | None = None,
        floor: float | None = None,
        reach: float = np.inf,
        cone: NDArray[np.float64] | None = None,
    ) -> NDArray[np.bool_]:
        """
        Find the boxes in a light's range and cone whose shadow volumes may be in view, (n,) bool.

        Parameters as in ``find_visible_parts``; ``cone`` (k, 4) are inward planes around the cone.
        """
        found = np.zeros(len(self.bounds), np.bool_)
        planes = find_view_planes(camera, origin, scissor)
        planes = np.concatenate([planes, find_far_plane(camera, planes)[None]])
        end = np.nan if floor is None else float(floor)
        _find_seen(
            self.bounds, self._order, self._starts, self._nodes, light, planes, end, float(reach),
            _NOWHERE if cone is None else cone, found,
        )  # fmt: skip
        return found

    def find_holding(self, place: NDArray[np.float64], margin: float = 0.0) -> NDArray[np.intp]:
        """Find the boxes within a margin [m] of a point (3,), ascending."""
        found = np.zeros(len(self.bounds), np.bool_)
        _find_holding(self.bounds, self._order, self._starts, self._nodes, place, margin, found)
        return np.flatnonzero(found)


@njit(cache=True, nogil=True)
def _fit(bounds, order, starts, nodes):
    """Write the boxes of all nodes; return the total size of the lowest nodes."""
    size = 0.0
    for level in range(starts.size - 1):
        below = order.size if level == 0 else starts[level] - starts[level - 1]
        for node in range(starts[level + 1] - starts[level]):
            box = nodes[starts[level] + node]
            box[0], box[1] = np.inf, -np.inf
            for child in range(node * _WIDTH, min((node + 1) * _WIDTH, below)):
                mine = bounds[order[child]] if level == 0 else nodes[starts[level - 1] + child]
                for axis in range(3):
                    box[0, axis] = min(box[0, axis], mine[0, axis])
                    box[1, axis] = max(box[1, axis], mine[1, axis])
            if level == 0:
                size += (box[1] - box[0]).sum()
    return size


@njit(cache=True, nogil=True)
def _is_beyond_any(planes, box):
    """Return whether a box lies wholly beyond any plane."""
    for k in range(planes.shape[0]):
        highest = planes[k, 3]
        for axis in range(3):
            highest += max(planes[k, axis] * box[0, axis], planes[k, axis] * box[1, axis])
        if highest < 0.0:
            return True
    return False


@njit(cache=True, nogil=True)
def _find_seen(bounds, order, starts, nodes, light, planes, floor, reach, cone, found):
    """Mark the boxes of ``find_seen``, from the root down."""
    points = np.zeros((16, 4))
    stack = np.zeros((_WIDTH * starts.size, 2), np.int64)
    stack[0, 0] = starts.size - 2  # level and node; the root is node 0 of the highest level
    depth = 1 if order.size else 0
    while depth:
        depth -= 1
        level, node = stack[depth, 0], stack[depth, 1]
        below = order.size if level == 0 else starts[level] - starts[level - 1]
        for child in range(node * _WIDTH, min((node + 1) * _WIDTH, below)):
            box = bounds[order[child]] if level == 0 else nodes[starts[level - 1] + child]
            if _is_beyond_any(cone, box):
                continue
            if not is_seen(box, light, planes, floor, reach, points):
                continue
            if level == 0:
                found[order[child]] = True
            else:
                stack[depth, 0], stack[depth, 1] = level - 1, child
                depth += 1


@njit(cache=True, nogil=True)
def _find_holding(bounds, order, starts, nodes, place, margin, found):
    """Mark the boxes of ``find_holding``, from the root down."""
    stack = np.zeros((_WIDTH * starts.size, 2), np.int64)
    stack[0, 0] = starts.size - 2
    depth = 1 if order.size else 0
    while depth:
        depth -= 1
        level, node = stack[depth, 0], stack[depth, 1]
        below = order.size if level == 0 else starts[level] - starts[level - 1]
        for child in range(node * _WIDTH, min((node + 1) * _WIDTH, below)):
            box = bounds[order[child]] if level == 0 else nodes[starts[level - 1] + child]
            holds = True
            for axis in range(3):
                holds &= place[axis] >= box[0, axis] - margin
                holds &= place[axis] <= box[1, axis] + margin
            if not holds:
                continue
            if level == 0:
                found[order[child]] = True
            else:
                stack[depth, 0], stack[depth, 1] = level - 1, child
                depth += 1
