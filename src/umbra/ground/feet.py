"""
Feet of a model's buildings: the faces on which each stands, in the model's own coordinates.

Buildings whose base is the floor of a cellar, not the ground.

A building with neighbours on opposite sides, all of whose feet lie more than a storey higher, is
taken to have a cellar. On a slope those below it stand lower.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.volume.half_edges import find_roots

__all__ = ["Feet", "find_base_faces", "find_cellars"]

_TILT = 0.5  # least share of a base's area in plan: steeper faces are walls
_LOW = 0.5  # height over the foot within which a base begins [m]
_FLOOR = 3.0  # the same where the file itself calls a face a building's ground [m]


@dataclass(frozen=True, eq=False)
class Feet:
    """
    Base faces of buildings.

    Parameters
    ----------
    corners : (n, 3, 3) float64
        Triangles, in the model's own coordinates [m]; without area where only an edge or a corner
        is known.
    owner : (n,) int64
        Number of the building.
    """

    corners: NDArray[np.float64]
    owner: NDArray[np.int64]

    @property
    def count(self) -> int:
        """Number of buildings."""
        return len(np.unique(self.owner))

    def without(self, owners: NDArray[np.int64]) -> "Feet":
        """Return those of other buildings."""
        is_other = ~np.isin(self.owner, owners)
        return Feet(self.corners[is_other], self.owner[is_other])

    def above(self, lowest: float) -> "Feet":
        """Return those of buildings whose lowest corner is not below a height [m]."""
        low = np.full(int(self.owner.max(initial=-1)) + 1, np.inf)
        np.minimum.at(low, self.owner, self.corners[:, :, 2].min(1))
        is_high = (low >= lowest)[self.owner]
        return Feet(self.corners[is_high], self.owner[is_high])


def find_base_faces(
    corners: NDArray[np.float64],
    group: NDArray[np.integer],
    is_floor: NDArray[np.bool_],
    foot: NDArray[np.float64],
) -> Feet:
    """
    Find the faces on which objects stand.

    These are faces that the file calls a building's ground, else those that look down; each
    patch of them that begins at the foot counts whole, so that a base may slope. Of an object
    without such a face it is the hull, in plan, of its lowest corners.

    Parameters
    ----------
    corners : (n_faces, 3, 3) float64
        Of the objects' triangles, counter-clockwise seen from outside [m].
    group : (n_faces,) int
        Object of each.
    is_floor : (n_faces,) bool
        Whether the file calls it a building's ground.
    foot : (n_objects,) float64
        Height of each object's foot [m]; not finite for objects that have none.

    Returns
    -------
    feet : Feet
        Owners are numbers of objects.
    """
    corners = np.asarray(corners, np.float64).reshape(-1, 3, 3)
    stands = np.isfinite(foot)[group]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    up = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    is_flat = np.abs(up) > _TILT * np.linalg.norm(np.cross(u, v), axis=1)
    has_floor = np.zeros(len(foot), np.bool_)
    has_floor[group[is_floor & is_flat]] = True
    candidates = np.flatnonzero(stands & is_flat & np.where(has_floor[group], is_floor, up < 0))
    patch = _find_patches(corners[candidates], group[candidates])
    lowest = np.full(int(patch.max(initial=-1)) + 1, np.inf)
    np.minimum.at(lowest, patch, corners[candidates][:, :, 2].min(1))
    owner = group[candidates]
    room = np.where(has_floor[owner], _FLOOR, _LOW)
    candidates = candidates[lowest[patch] <= foot[owner] + room]
    bases, owners = [corners[candidates]], [group[candidates].astype(np.int64)]
    known = np.zeros(len(foot), np.bool_)
    known[group[candidates]] = True
    left = np.flatnonzero(stands & ~known[group])
    for index in np.unique(group[left]).tolist():
        points = corners[left[group[left] == index]].reshape(-1, 3)
        hull = _make_fan(points[points[:, 2] <= foot[index] + _LOW])
        bases.append(hull)
        owners.append(np.full(len(hull), index, np.int64))
    return Feet(np.concatenate(bases), np.concatenate(owners))


def _find_patches(corners: NDArray[np.float64], group: NDArray[np.integer]) -> NDArray[np.intp]:
    """Return the patch of each face (n, 3, 3): faces of one object that share a corner."""
    if not len(corners):
        return np.zeros(0, np.intp)
    keys = np.column_stack([np.repeat(group, 3), corners.reshape(-1, 3)])
    _, vertex = np.unique(keys, axis=0, return_inverse=True)
    vertex = vertex.reshape(-1, 3)
    pairs = np.concatenate([vertex[:, :2], vertex[:, 1:]])
    first, second = np.ascontiguousarray(pairs.T, np.int32)
    roots = find_roots(first, second, int(vertex.max()) + 1)
    return np.asarray(roots[vertex[:, 0]], np.intp)


def _make_fan(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return triangles (n, 3, 3) of the hull of points in plan; of an edge or a point, one."""
    points = points[np.lexsort(points.T[::-1])]
    points = points[np.append(True, (np.diff(points[:, :2], axis=0) != 0).any(1))]
    rings: list[list[NDArray[np.float64]]] = [[], []]
    for ring, sequence in zip(rings, (points, points[::-1]), strict=True):
        for point in sequence:
            while len(ring) > 1 and _turn(ring[-2], ring[-1], point) <= 0:
                ring.pop()
            ring.append(point)
    hull = np.array([*rings[0][:-1], *rings[1][:-1]]) if len(points) > 1 else points
    if len(hull) < 3:
        return hull[[0, -1, -1]][None]
    return np.stack([np.broadcast_to(hull[0], hull[2:].shape), hull[1:-1], hull[2:]], axis=1)


def _turn(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


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
    if not len(feet.corners):
        return np.zeros(0, np.int64)
    corners, owner = feet.corners.reshape(-1, 3), np.repeat(feet.owner, 3)
    _, first = np.unique(np.column_stack([corners[:, :2], owner]), axis=0, return_index=True)
    corners, owner = corners[first], owner[first]
    count = int(owner.max(initial=-1)) + 1
    foot = np.full(count, np.inf)
    np.minimum.at(foot, owner, corners[:, 2])
    if not np.ptp(foot[np.isfinite(foot)]) > _STOREY:
        return np.zeros(0, np.int64)
    from scipy.spatial import cKDTree  # noqa: PLC0415 - comes with pvlib; 0.2 s

    number = np.maximum(np.bincount(owner, minlength=count), 1)
    sums = np.stack([np.bincount(owner, corners[:, k], count) for k in (0, 1)], axis=1)
    middle = sums.astype(np.float64) / number[:, None]
    reach = range(1, min(_MOST, len(corners)) + 1)
    away, near = cKDTree(corners[:, :2]).query(corners[:, :2], reach)
    row, rank = np.nonzero(away < _NEAR)
    pairs = np.stack([owner[row], owner[near[row, rank]]], axis=1)
    pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    is_lower = foot[pairs[:, 1]] > foot[pairs[:, 0]] + _STOREY
    has_equal = np.zeros(count, np.bool_)
    has_equal[pairs[~is_lower, 0]] = True
    pairs = pairs[~has_equal[pairs[:, 0]]]
    cellars = []
    for building in np.unique(pairs[:, 0]).tolist():
        way = middle[pairs[pairs[:, 0] == building, 1]] - middle[building]
        way /= np.maximum(np.linalg.norm(way, axis=1), 1e-9)[:, None]
        if (way @ way.T).min() < _OPPOSITE:
            cellars.append(building)
    return np.array(cellars, np.int64)
