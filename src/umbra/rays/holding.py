"""
Faces that hold a light: a lamp on a wall, on an edge or at a corner of a caster.

Such a face is neither lit nor unlit, and rounding would decide differently for each face at a
corner. So all devices apply one rule: **a face that holds the light casts nothing**, and its
component follows the open rule, as the light is neither inside nor outside it.

A face holds a light that lies on it within float64 rounding: no farther than ``HOLDS`` times the
largest coordinate. Edges and corners belong to the face, so no edge through the light is ever in a
silhouette.
"""

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from umbra.kernels import cross, dot, inlined
from umbra.rays.eye_count import BLOCK, FaceBlocks
from umbra.volume.adjacency import Caster

__all__ = ["HOLDS", "find_holders", "find_near_faces"]

HOLDS = 2.0**-44
"""Relative to the largest coordinate: eight halves of its last digit."""


def find_holders(
    caster: Caster,
    blocks: FaceBlocks,
    light: NDArray[np.float64],
    origin: ArrayLike,
    among: NDArray[np.intp] | None = None,
) -> NDArray[np.intp]:
    """
    Find the faces that hold a light, ascending; none for a directional light.

    Parameters
    ----------
    caster : Caster
    blocks : FaceBlocks
        Boxes of the caster.
    light : (4,) float64
        Homogeneous, in the caster's frame.
    origin : (3,) float64
        Origin of that frame in the model's own coordinates, which limit the precision [m].
    among : (n,) int, optional
        Test only these faces.
    """
    if light[3] == 0.0:
        return np.zeros(0, np.intp)
    place = light[:3] / light[3]
    world = float(np.abs(origin).max())
    coarse = float(np.abs(place).max())
    margin = HOLDS * (world + coarse)
    faces, apart, largest = _find_near(caster, blocks, place, margin, HOLDS, among)
    if not len(faces):
        return faces
    size = np.maximum(largest, coarse) + world
    return np.sort(faces[apart <= HOLDS * size])


def find_near_faces(
    caster: Caster,
    blocks: FaceBlocks,
    light: NDArray[np.float64],
    reach: float,
    among: NDArray[np.intp] | None = None,
) -> NDArray[np.intp]:
    """Find the faces within reach of a point light in the caster's frame, nearest first."""
    faces, apart, _ = _find_near(caster, blocks, light[:3] / light[3], reach, 0.0, among)
    order = np.argsort(apart, kind="stable")
    return faces[order[: np.count_nonzero(apart <= reach)]]


def _find_near(
    caster: Caster,
    blocks: FaceBlocks,
    place: NDArray[np.float64],
    margin: float,
    share: float,
    among: NDArray[np.intp] | None,
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """
    Find the faces near a point, their distances and their largest coordinates.

    Those ``among`` faces, or of blocks within ``margin`` and ``share`` of their coordinates.
    """
    if among is None:
        near = _find_blocks(blocks.bounds, place, margin, share)
        among = (near[:, None] * BLOCK + np.arange(BLOCK)).ravel() if len(near) else near
    faces = among[among < len(caster.faces)]
    apart, largest = np.zeros((2, len(faces)))
    if len(faces):
        _measure(caster.vertices, caster.faces, faces, place, apart, largest)
    return faces, apart, largest


@njit(cache=True, nogil=True)
def _find_blocks(bounds, place, margin, share):
    """Find the boxes within ``margin`` of a point, and ``share`` of their largest coordinate."""
    found = np.empty(bounds.shape[0], np.intp)
    n = 0
    for block in range(bounds.shape[0]):
        size = 0.0
        for k in range(6):
            size = max(size, abs(bounds[block, k]))
        reach = margin + share * size
        is_near = True
        for k in range(3):
            is_near &= bounds[block, k] - reach <= place[k] <= bounds[block, k + 3] + reach
        found[n] = block
        n += is_near
    return found[:n].copy()


@inlined
def _subtract(p, q):
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


@inlined
def _to_segment(p, q):
    """Return the distance from 0 to the segment between two points."""
    along = _subtract(q, p)
    square = dot(along, along)
    t = 0.0 if square == 0.0 else min(1.0, max(0.0, -dot(p, along) / square))
    nearest = p[0] + t * along[0], p[1] + t * along[1], p[2] + t * along[2]
    return np.sqrt(dot(nearest, nearest))


@njit(cache=True, nogil=True)
def _measure(vertices, faces, some, place, apart, largest):
    """Find the distances of faces from a point, and their largest coordinates."""
    for i in range(some.size):
        corners = faces[some[i]]
        for k in range(3):
            for axis in range(3):
                largest[i] = max(largest[i], abs(vertices[corners[k], axis]))
        # Relative to the point, so that near corners keep all digits.
        a = _subtract(vertices[corners[0]], place)
        b = _subtract(vertices[corners[1]], place)
        c = _subtract(vertices[corners[2]], place)
        apart[i] = min(_to_segment(a, b), _to_segment(b, c), _to_segment(c, a))
        normal = cross(_subtract(b, a), _subtract(c, a))
        square = dot(normal, normal)
        if (
            square > 0.0
            and dot(normal, cross(a, b)) > 0.0
            and dot(normal, cross(b, c)) > 0.0
            and dot(normal, cross(c, a)) > 0.0
        ):
            apart[i] = min(apart[i], abs(dot(normal, a)) / np.sqrt(square))
