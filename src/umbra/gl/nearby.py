"""
Points near a lamp with precomputed far ends.

The far end of a point is its direction from the light, which a shader computes as a
difference of float32 numbers. A micrometre from an edge of a few metres this loses the
direction of the edge's shadow, and the rays to the edge's ends are opposite: they span no
side. So near a lamp each edge and each face is split at its point nearest to the lamp, and
the rays to that point and to nearby corners are computed in float64. Sides and caps are
cut alike, so volumes stay closed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.gl.open_components import REACH
from umbra.gl.volumes import BodyVolumes
from umbra.rays.holding import find_near_faces
from umbra.scene.mesh import transform_points

__all__ = ["Nearby", "find_nearby"]

_MOST = 2000  # faces; of a finer mesh only the nearest


@dataclass(frozen=True, eq=False)
class Nearby:
    """
    Points near a light with precomputed far ends.

    Parameters
    ----------
    points : (n, 2, 3) float64
        Position relative to the scene's origin, and unit vector from the light.
    at_corner, on_edge, on_face : dict
        One, two or three point numbers of the geometry, ascending -> index of the point
        that replaces the corner, or lies on the edge or face.
    corners : (n,) int64
        Points of the geometry at the affected faces, ascending.
    """

    points: NDArray[np.float64]
    at_corner: dict[int, int]
    on_edge: dict[tuple[int, int], int]
    on_face: dict[tuple[int, ...], int]
    corners: NDArray[np.int64]

    def refine(self, numbers: NDArray[np.uint32], first: int) -> NDArray[np.uint32]:
        """
        Split triangles (n,) uint32 at their points nearest to the light.

        ``first`` is the number of the first of ``points``, after those of the geometry.
        """
        triangles = numbers.reshape(-1, 3)
        is_near = np.zeros(len(triangles), np.bool_)
        _find_corners(triangles, self.corners, is_near)
        if not is_near.any():
            return numbers
        cut: list[tuple[int, int, int]] = []
        for triangle in triangles[is_near].tolist():
            cut += self._cut(triangle, first)
        added = np.array(cut, np.uint32).ravel()
        return np.concatenate([triangles[~is_near].ravel(), added])

    def _cut(self, triangle: list[int], first: int) -> list[tuple[int, int, int]]:
        """Split one triangle at the points on its edges and, if it is a face, inside."""
        rim, feet = [], []
        for k, number in enumerate(triangle):
            onward = triangle[(k + 1) % 3]
            end = number & 1
            stand = self.at_corner.get(number >> 1)
            rim.append(number if stand is None else 2 * (first + stand) + end)
            pair = (min(number, onward) >> 1, max(number, onward) >> 1)
            foot = self.on_edge.get(pair) if end == onward & 1 else None
            if foot is not None:
                feet.append(len(rim))
                rim.append(2 * (first + foot) + end)
        ends = {number & 1 for number in triangle}
        within = self.on_face.get(tuple(sorted(number >> 1 for number in triangle)))
        if len(ends) == 1 and within is not None:
            hub = 2 * (first + within) + ends.pop()
            return [(hub, a, b) for a, b in pairwise([*rim, rim[0]])]
        start = feet[0] if feet else 0
        if len(feet) == 1:
            start = (start + 2) % 4  # the corner across
        rim = rim[start:] + rim[:start]
        return [(rim[0], a, b) for a, b in pairwise(rim[1:])]


@njit(cache=True, nogil=True)
def _find_corners(triangles, corners, found):
    """Mark the triangles (n, 3) of vertex numbers with a corner among points in order."""
    for i in range(triangles.shape[0]):
        for k in range(3):
            point = np.int64(triangles[i, k] >> np.uint32(1))
            if corners[0] <= point <= corners[-1]:
                place = np.searchsorted(corners, point)
                found[i] |= corners[place] == point


def find_nearby(
    near: Sequence[tuple[BodyVolumes, NDArray[np.intp]]], light: NDArray[np.float64]
) -> Nearby | None:
    """
    Find the points near a light (4,), relative to the scene's origin; mostly none.

    ``near`` lists instances and shells (n, 2) per body, from ``find_near``: only these are tested.
    """
    points: list[NDArray[np.float64]] = []
    at_corner: dict[int, int] = {}
    on_edge: dict[tuple[int, int], int] = {}
    on_face: dict[tuple[int, ...], int] = {}
    met: set[int] = set()
    for each, mine in near:
        body = each.body
        reach = REACH * body.size
        for instance in np.unique(mine[:, 0]).tolist():
            some = body.list_faces(mine[mine[:, 0] == instance, 1])
            faces = find_near_faces(body.caster, body.blocks, each.lights[instance], reach, some)[
                :_MOST
            ]
            if not len(faces):
                continue
            used, rows = np.unique(body.caster.faces[faces], return_inverse=True)
            # Relative to the light, so that near points keep full precision.
            apart = body.caster.vertices[used]
            apart = transform_points(body.transforms[instance], apart) - light[:3]
            numbers = body.first[instance] + used
            for corners in rows.reshape(-1, 3):
                names, ways = numbers[corners].tolist(), apart[corners]
                _add_corners(names, ways, reach, at_corner, points)
                _add_edges(names, ways, reach, on_edge, points)
                _add_face(names, ways, reach, on_face, points)
                met.update(names)
    if not points:
        return None
    ways = np.array(points)
    units = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    stacked = np.stack([ways + light[:3], units], 1)
    return Nearby(stacked, at_corner, on_edge, on_face, np.array(sorted(met)))


def _add_corners(
    names: list[int], ways: NDArray, reach: float, at_corner: dict, points: list
) -> None:
    for name, way in zip(names, ways, strict=True):
        if name not in at_corner and 0.0 < np.linalg.norm(way) < reach:
            at_corner[name] = len(points)
            points.append(way)


def _add_edges(names: list[int], ways: NDArray, reach: float, on_edge: dict, points: list) -> None:
    for i, j in ((0, 1), (1, 2), (2, 0)):
        pair = (min(names[i], names[j]), max(names[i], names[j]))
        a, b = (ways[names.index(name)] for name in pair)  # same direction for both faces
        along = b - a
        part = -(a @ along) / (along @ along)
        foot = a + part * along
        if pair not in on_edge and 0.0 < part < 1.0 and 0.0 < np.linalg.norm(foot) < reach:
            on_edge[pair] = len(points)
            points.append(foot)


def _add_face(names: list[int], ways: NDArray, reach: float, on_face: dict, points: list) -> None:
    foot = np.zeros(3)
    if _find_foot(ways, foot) and 0.0 < np.sqrt(foot @ foot) < reach:
        on_face[tuple(sorted(names))] = len(points)
        points.append(foot)


@njit(cache=True, nogil=True)
def _find_foot(ways, foot):
    """Write the point of a face's plane nearest to 0; return whether the face (3, 3) holds it."""
    a, b, c = ways[0], ways[1], ways[2]
    normal = np.cross(b - a, c - a)
    square = (normal * normal).sum()
    if square == 0.0:
        return False
    nearest = a
    for way in (b, c):
        if (way * way).sum() < (nearest * nearest).sum():
            nearest = way
    foot[:] = (normal * nearest).sum() / square * normal
    return (
        (normal * np.cross(a, b)).sum() > 0.0
        and (normal * np.cross(b, c)).sum() > 0.0
        and (normal * np.cross(c, a)).sum() > 0.0
    )
