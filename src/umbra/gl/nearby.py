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

import numpy as np
from numpy.typing import NDArray

from umbra.gl.open_components import REACH
from umbra.gl.volumes import BodyVolumes
from umbra.kernels import cross, dot, inlined, kernel
from umbra.rays.holding import find_near_faces
from umbra.scene.mesh import transform_points

__all__ = ["Nearby", "find_nearby"]

_MOST = 2000  # faces; of a finer mesh only the nearest
_MOST_PIECES = 6  # of one triangle


@dataclass(frozen=True, eq=False)
class Nearby:
    """
    Points near a light with precomputed far ends.

    Parameters
    ----------
    points : (n, 2, 3) float64
        Position relative to the scene's origin, and unit vector from the light.
    places : (n, 3) int64
        What each replaces or lies on: a corner (k, k, k), an edge (k, l, l), or a face, by
        numbers of the geometry's points, ascending.
    corners : (n,) int64
        Points of the geometry at the affected faces, ascending.
    """

    points: NDArray[np.float64]
    places: NDArray[np.int64]
    corners: NDArray[np.int64]

    def refine(self, numbers: NDArray[np.uint32], first: int) -> NDArray[np.uint32]:
        """
        Split triangles (n,) uint32 at their points nearest to the light.

        ``first`` is the number of the first of ``points``, after those of the geometry.
        """
        triangles = numbers.reshape(-1, 3)
        is_near = np.zeros(len(triangles), np.bool_)
        if not _find_corners(triangles, self.corners, is_near):
            return numbers
        near = triangles[is_near]
        cut = np.zeros((_MOST_PIECES * len(near), 3), np.uint32)
        n = _cut(near, self.places, first, cut)
        return np.concatenate([triangles[~is_near].ravel(), cut[:n].ravel()])


@kernel
def _find_corners(triangles, corners, is_near):
    """Mark the triangles (n, 3) of vertex numbers with a corner among points in order."""
    is_any = False
    for i in range(triangles.shape[0]):
        for k in range(3):
            point = np.int64(triangles[i, k] >> np.uint32(1))
            if corners[0] <= point <= corners[-1]:
                position = np.searchsorted(corners, point)
                is_near[i] |= corners[position] == point
        is_any |= is_near[i]
    return is_any


@kernel
def _find_place(places, count, a, b, c):
    """Return which of the first places is this corner, edge or face, in any order; -1 if none."""
    low, high = min(a, b, c), max(a, b, c)
    middle = a + b + c - low - high
    for i in range(count):
        if places[i, 0] == low and places[i, 1] == middle and places[i, 2] == high:
            return i
    return -1


@kernel
def _cut(triangles, places, first, cut):
    """Split triangles at the points on their edges and, if they are faces, inside."""
    rim = np.zeros(6, np.uint32)
    n = 0
    for i in range(triangles.shape[0]):
        length, feet, foot_at, ends = 0, 0, 0, np.uint32(0)
        a, b, c = triangles[i] >> np.uint32(1)
        for k in range(3):
            number, onward = triangles[i, k], triangles[i, (k + 1) % 3]
            end, point, other = (
                number & np.uint32(1),
                number >> np.uint32(1),
                onward >> np.uint32(1),
            )
            ends += end
            stand = _find_place(places, len(places), point, point, point)
            rim[length] = number if stand < 0 else np.uint32(2 * (first + stand)) + end
            length += 1
            foot = -1
            if end == onward & np.uint32(1) and point != other:
                low, high = min(point, other), max(point, other)
                foot = _find_place(places, len(places), low, high, high)
            if foot >= 0:
                foot_at = length if feet == 0 else foot_at
                feet += 1
                rim[length] = np.uint32(2 * (first + foot)) + end
                length += 1
        within = -1
        if ends in (0, 3):
            within = _find_place(places, len(places), a, b, c) if a != b != c != a else -1
        if within >= 0:
            hub = np.uint32(2 * (first + within) + (1 if ends else 0))
            for k in range(length):
                cut[n, 0], cut[n, 1], cut[n, 2] = hub, rim[k], rim[(k + 1) % length]
                n += 1
            continue
        start = foot_at
        if feet == 1:
            start = (foot_at + 2) % 4  # the corner across
        for k in range(1, length - 1):
            cut[n, 0] = rim[start]
            cut[n, 1] = rim[(start + k) % length]
            cut[n, 2] = rim[(start + k + 1) % length]
            n += 1
    return n


def find_nearby(
    near: Sequence[tuple[BodyVolumes, NDArray[np.intp]]], light: NDArray[np.float64]
) -> Nearby | None:
    """
    Find the points near a light (4,), relative to the scene's origin; mostly none.

    ``near`` lists instances and shells (n, 2) per body, from ``find_near``: only these are tested.
    """
    ways: list[NDArray[np.float64]] = []
    places: list[NDArray[np.int64]] = []
    met: list[NDArray[np.int64]] = []
    for body_volumes, wanted in near:
        body = body_volumes.body
        reach = REACH * body.size
        for instance, shells in body.split(wanted):
            among = body.list_faces(shells)
            faces = find_near_faces(
                body.caster, body.blocks, body_volumes.lights[instance], reach, among
            )[:_MOST]
            if not len(faces):
                continue
            corners = body.caster.faces[faces]
            # Relative to the light, so that near points keep full precision.
            apart = body.caster.vertices[corners.ravel()]
            apart = transform_points(body.transforms[instance], apart) - light[:3]
            numbers = body.first[instance] + corners.astype(np.int64)
            offsets, which = np.zeros((7 * len(faces), 3)), np.zeros((7 * len(faces), 3), np.int64)
            n = _find_points(numbers, apart.reshape(-1, 3, 3), reach, offsets, which)
            ways.append(offsets[:n])
            places.append(which[:n])
            met.append(numbers.ravel())
    if not any(len(vectors) for vectors in ways):
        return None
    offsets = np.concatenate(ways)
    units = offsets / np.sqrt((offsets * offsets).sum(1, keepdims=True))
    stacked = np.stack([offsets + light[:3], units], 1)
    return Nearby(stacked, np.concatenate(places), np.unique(np.concatenate(met)))


@kernel
def _find_points(numbers, ways, reach, points, places):
    """
    Write the points within reach of corners, edges and faces, each once; return their number.

    ``numbers`` (n, 3) are the faces' points, ``ways`` (n, 3, 3) their positions from the light.
    """
    n = 0
    foot = np.zeros(3)
    for i in range(numbers.shape[0]):
        names, corners = numbers[i], ways[i]
        for k in range(3):
            name = names[k]
            if _is_within(corners[k], reach) and _find_place(places, n, name, name, name) < 0:
                n = _add(corners[k], name, name, name, points, places, n)
        for k in range(3):
            a, b = k, (k + 1) % 3
            if names[a] > names[b]:
                a, b = b, a  # the same direction for both faces
            along = _subtract(corners[b], corners[a])
            part = -dot(corners[a], along) / dot(along, along)
            for axis in range(3):
                foot[axis] = corners[a, axis] + part * along[axis]
            if (
                0.0 < part < 1.0
                and _is_within(foot, reach)
                and _find_place(places, n, names[a], names[b], names[b]) < 0
            ):
                n = _add(foot, names[a], names[b], names[b], points, places, n)
        if _find_foot(corners, foot) and _is_within(foot, reach):
            low, high = min(names[0], names[1], names[2]), max(names[0], names[1], names[2])
            n = _add(
                foot, low, names[0] + names[1] + names[2] - low - high, high, points, places, n
            )
    return n


@inlined
def _subtract(p, q):
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


@kernel
def _is_within(way, reach):
    """Return whether a vector is shorter than a reach, and not 0."""
    return 0.0 < np.sqrt(dot(way, way)) < reach


@kernel
def _add(way, a, b, c, points, places, n):
    """Write a point and its place; return the number of points."""
    for axis in range(3):
        points[n, axis] = way[axis]
    places[n, 0], places[n, 1], places[n, 2] = a, b, c
    return n + 1


@kernel
def _find_foot(ways, foot):
    """Write the point of a face's plane nearest to 0; return whether the face (3, 3) holds it."""
    a, b, c = ways[0], ways[1], ways[2]
    normal = cross(_subtract(b, a), _subtract(c, a))
    square = dot(normal, normal)
    if square == 0.0:
        return False
    nearest = a
    for way in (b, c):
        if dot(way, way) < dot(nearest, nearest):
            nearest = way
    share = dot(normal, nearest) / square
    for axis in range(3):
        foot[axis] = share * normal[axis]
    return (
        dot(normal, cross(a, b)) > 0.0
        and dot(normal, cross(b, c)) > 0.0
        and dot(normal, cross(c, a)) > 0.0
    )
