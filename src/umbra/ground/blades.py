"""
Blades of ground: long, thin triangles that stand up between near corners of different heights.

A surface through feet alone runs from two corners that are near each other, one high and one low,
straight to the next building, however far that is.
"""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["find_breaks", "find_mean_heights"]

_JUMP = 1.0  # height of a corner over the opposite edge, and the same in widths
_LONG = 10.0  # [m]
_CLEAR = 2.5  # distance of a new corner to a foot [m]
_APART = 1.0  # distance of new corners [m]
_MEAN = 256  # corners of feet of which the height between them is the mean


class Triangulated(Protocol):
    """Triangulated bases, as ``_Bases`` of `umbra.ground.surface`."""

    @property
    def plan(self) -> NDArray[np.float64]:
        """Corners (n, 3), those of feet first."""

    @property
    def triangles(self) -> NDArray[np.int32]:
        """Corners of each triangle, (t, 3)."""

    @property
    def neighbours(self) -> NDArray[np.int32]:
        """Triangle opposite to each corner, (t, 3); -1 beyond the hull."""

    @property
    def label(self) -> NDArray[np.int32]:
        """Base face that holds each triangle, (t,); -1 between the buildings."""

    @property
    def own(self) -> int:
        """Number of corners of feet."""


def find_mean_heights(
    tree: Any, plan: NDArray[np.float64], places: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the mean height (n,) of the feet near places (n, 2), by the square of distance."""
    away, near = tree.query(places, range(1, min(_MEAN, tree.n) + 1))
    weight = 1.0 / np.maximum(away, 1e-6) ** 2
    return np.asarray((weight * plan[near, 2]).sum(1) / weight.sum(1), np.float64)


def find_breaks(
    base: Triangulated, heights: NDArray[np.float64], known: NDArray[np.float64]
) -> NDArray[np.float64]:
    """
    Find places at which the blades of a surface are cut, with the mean height of the feet nearby.

    A blade is a triangle between buildings, more than 10 m long, of which one corner lies more
    than 1 m above or below the opposite edge and nearer to it than that. It is cut in the middle of
    its longest edge, or at both quarters where a foot is near.

    Parameters
    ----------
    base : Triangulated
    heights : (t, 3) float64
        Of each triangle's corners [m].
    known : (k, 3) float64
        Corners that were added before.

    Returns
    -------
    corners : (n, 3) float64
        [m]
    """
    from scipy.spatial import cKDTree  # noqa: PLC0415 - comes with pvlib; 0.2 s

    plan, triangles = base.plan, base.triangles
    places = plan[triangles, :2]
    sides = np.roll(places, -2, 1) - np.roll(places, -1, 1)  # opposite to each corner
    length = np.linalg.norm(sides, axis=2)
    k, row = length.argmax(1), np.arange(len(triangles))
    i, j = (k + 1) % 3, (k + 2) % 3
    start, along, whole = places[row, i], sides[row, k], np.maximum(length[row, k], 1e-9)
    aside = places[row, k] - start
    share = np.einsum("ij,ij->i", aside, along) / whole**2
    width = np.abs(aside[:, 0] * along[:, 1] - aside[:, 1] * along[:, 0]) / whole
    low, high, top = heights[row, i], heights[row, j], heights[row, k]
    jump = np.abs(top - (low + share * (high - low)))
    beyond = base.neighbours[row, k]
    is_open = (base.label < 0) & (beyond >= 0) & (base.label[beyond] < 0)
    blades = np.flatnonzero(is_open & (whole > _LONG) & (jump > _JUMP) & (jump > width))
    tree = cKDTree(plan[: base.own, :2])
    middle = start[blades] + 0.5 * along[blades]
    is_near = tree.query(middle)[0] < _CLEAR
    crowded = blades[is_near]
    quarters = [start[crowded] + share * along[crowded] for share in (0.25, 0.75)]
    found = np.concatenate([middle[~is_near], *quarters])
    found = found[tree.query(found)[0] >= _CLEAR]
    if len(known):
        found = found[cKDTree(known[:, :2]).query(found)[0] >= _APART]
    _, first = np.unique(np.rint(found / _APART), axis=0, return_index=True)
    found = found[first]
    return np.column_stack([found, find_mean_heights(tree, plan, found)])
