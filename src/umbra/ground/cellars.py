"""
Buildings whose base is the floor of a cellar, not the ground.

A building with neighbours on opposite sides, all of whose feet lie more than a storey higher, is
taken to have a cellar. On a slope those below it stand lower.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.ground.feet import Feet

__all__ = ["find_cellars"]

_NEAR = 10.0  # distance to a neighbour's foot [m]
_STOREY = 3.0  # by which all neighbours stand higher [m]
_OPPOSITE = -0.5  # cosine of the angle between two neighbours: 120 degrees and more
_MOST = 24  # corners of feet that are looked at from each


def find_cellars(feet: Feet) -> NDArray[np.int64]:
    """
    Find the buildings that have a cellar.

    Parameters
    ----------
    feet : Feet

    Returns
    -------
    owners : (n,) int64
        Numbers of the buildings, ascending.
    """
    from scipy.spatial import cKDTree  # noqa: PLC0415 - comes with pvlib; 0.2 s

    if not len(feet.corners):
        return np.zeros(0, np.int64)
    corners, owner = feet.corners.reshape(-1, 3), np.repeat(feet.owner, 3)
    _, first = np.unique(np.column_stack([corners[:, :2], owner]), axis=0, return_index=True)
    corners, owner = corners[first], owner[first]
    count = int(owner.max(initial=-1)) + 1
    foot = np.full(count, np.inf)
    np.minimum.at(foot, owner, corners[:, 2])
    number = np.maximum(np.bincount(owner, minlength=count), 1)
    sums = np.stack([np.bincount(owner, corners[:, k], count) for k in (0, 1)], axis=1)
    middle = sums.astype(np.float64) / number[:, None]
    reach = range(1, min(_MOST, len(corners)) + 1)
    away, near = cKDTree(corners[:, :2]).query(corners[:, :2], reach)
    one, rank = np.nonzero(away < _NEAR)
    pairs = np.stack([owner[one], owner[near[one, rank]]], axis=1)
    pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    is_lower = foot[pairs[:, 1]] > foot[pairs[:, 0]] + _STOREY
    has_equal = np.zeros(count, np.bool_)
    has_equal[pairs[~is_lower, 0]] = True
    pairs = pairs[~has_equal[pairs[:, 0]]]
    found = []
    for mine in np.unique(pairs[:, 0]).tolist():
        way = middle[pairs[pairs[:, 0] == mine, 1]] - middle[mine]
        way /= np.maximum(np.linalg.norm(way, axis=1), 1e-9)[:, None]
        if (way @ way.T).min() < _OPPOSITE:
            found.append(mine)
    return np.array(found, np.int64)
