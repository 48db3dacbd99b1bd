"""
Faces that hold a light: a lamp on a wall, on an edge or at a corner of a caster.

Such a face is neither lit nor unlit, and rounding would decide differently for each face at a
corner. So all devices apply one rule: **a face that holds the light casts nothing**, and its
component follows the open rule, as the light is neither inside nor outside it.

A face holds a light that lies on it within float64 rounding: no farther than ``HOLDS`` times the
largest coordinate. Edges and corners belong to the face, so no edge through the light is ever in a
silhouette.

Counts on faces in whose plane the light lies: walls along the sun, a roof under a level one.

Sides of volumes lie in such a face, and rounding would tell which is nearer. A point is meant as
the limit from the viewer's side, so both devices ask a ray from just beside the face.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.kernels import cross, dot, inlined, kernel
from umbra.rays import VisibleSurface
from umbra.rays.depth import DepthBuffer
from umbra.rays.eye_count import (
    BLOCK,
    FaceBlocks,
    find_cut_open,
    find_eye_count,
    find_faces_before,
    pierce,
)
from umbra.scene import Camera
from umbra.scene.derived import derive
from umbra.scene.scene import Triangles
from umbra.volume.adjacency import Caster

__all__ = ["HOLDS", "find_edge_on", "find_holders", "find_near_faces", "recount_edge_on"]

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
    position = light[:3] / light[3]
    world = float(np.abs(origin).max())
    coarse = float(np.abs(position).max())
    margin = HOLDS * (world + coarse)
    faces, apart, largest = _find_near(caster, blocks, position, margin, HOLDS, among)
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
    position: NDArray[np.float64],
    margin: float,
    share: float,
    among: NDArray[np.intp] | None,
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """
    Find the faces near a point, their distances and their largest coordinates.

    Those ``among`` faces, or of blocks within ``margin`` and ``share`` of their coordinates.
    """
    if among is None:
        near = _find_blocks(blocks.bounds, position, margin, share)
        among = (near[:, None] * BLOCK + np.arange(BLOCK)).ravel() if len(near) else near
    faces = among[among < len(caster.faces)]
    apart, largest = np.zeros((2, len(faces)))
    if len(faces):
        _measure(caster.vertices, caster.faces, faces, position, apart, largest)
    return faces, apart, largest


@kernel
def _find_blocks(bounds, position, margin, share):
    """Find the boxes within ``margin`` of a point, and ``share`` of their largest coordinate."""
    near = np.empty(bounds.shape[0], np.intp)
    n = 0
    for block in range(bounds.shape[0]):
        size = 0.0
        for k in range(6):
            size = max(size, abs(bounds[block, k]))
        reach = margin + share * size
        is_near = True
        for k in range(3):
            is_near &= bounds[block, k] - reach <= position[k] <= bounds[block, k + 3] + reach
        near[n] = block
        n += is_near
    return near[:n].copy()


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


@kernel
def _measure(vertices, faces, selection, position, apart, largest):
    """Find the distances of faces from a point, and their largest coordinates."""
    for i in range(selection.size):
        corners = faces[selection[i]]
        for k in range(3):
            for axis in range(3):
                largest[i] = max(largest[i], abs(vertices[corners[k], axis]))
        # Relative to the point, so that near corners keep all digits.
        a = _subtract(vertices[corners[0]], position)
        b = _subtract(vertices[corners[1]], position)
        c = _subtract(vertices[corners[2]], position)
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


_BESIDE = 2.0**-30  # of the largest coordinate
_EDGE_ON = 2.0**-40  # sine of the light's angle to a plane, or a lamp's distance: far smaller


def find_edge_on(
    view: DepthBuffer, triangles: Triangles, light: NDArray[np.float64]
) -> NDArray[np.bool_] | None:
    """Find the pixels that see a face in the plane of a light (4,); None without any."""

    def find_planes() -> tuple[NDArray[np.intp], NDArray[np.float64], float]:
        seen = np.flatnonzero(_mark_seen(view.face, len(triangles.faces)))
        a, b, c = triangles.vertices[triangles.faces[seen]].transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        offsets = -np.einsum("ij,ij->i", normals, a)
        return seen, np.column_stack([normals, offsets]), float(np.abs(a).max(initial=0.0))

    seen, planes, size = derive(view, "planes seen", None, find_planes)
    least = _EDGE_ON * (np.abs(light[:3]).max() + light[3] * size)
    edge_on = seen[np.abs(planes @ light) <= least]
    if not len(edge_on):
        return None
    is_edge_on = np.zeros(len(triangles.faces) + 2, np.bool_)  # -2 and -1: ground and background
    is_edge_on[edge_on] = True
    return is_edge_on[view.face]


@kernel
def _mark_seen(view, n_faces):
    """Mark the faces that a view shows."""
    is_seen = np.zeros(n_faces, np.bool_)
    for row in range(view.shape[0]):
        for face in view[row]:
            if face >= 0:
                is_seen[face] = True
    return is_seen


def recount_edge_on(
    counts: NDArray[np.integer],
    where: NDArray[np.bool_],
    frame: VisibleSurface,
    caster: Caster,
    camera: Camera,
    light: NDArray[np.float64],
    origin: NDArray[np.float64],
) -> NDArray[np.int32]:
    """
    Count the faces between a light and visible points of faces in whose plane it lies.

    Parameters
    ----------
    counts : (rows, cols) int
        Counts of the view.
    where : (rows, cols) bool
        The points, from ``find_edge_on``.
    frame : VisibleSurface
    caster : Caster
        In the scene's frame, as is the light.
    camera : Camera
    light : (4,) float64
    origin : (3,) float64
        Origin of the scene.

    Returns
    -------
    counts : (rows, cols) int32
        With those of the points replaced.
    """
    blocks = FaceBlocks.of(caster)
    caster = caster.without(find_holders(caster, blocks, light, origin))
    eye = find_eye_count(caster, blocks, camera, origin, light)
    cut = find_faces_before(caster, blocks, camera, origin)
    caster = caster.opened(eye.start.enclosed | find_cut_open(caster, blocks, cut, light))
    points = frame.position[where] - origin
    size = 1.0 + max(blocks.largest, np.abs(light[:3]).max())
    points += _BESIDE * size * frame.normal[where]
    fresh = np.zeros(len(points), np.int32)
    is_open = (~caster.is_closed)[caster.component]
    _count(
        points, caster.vertices, caster.faces, caster.planes, is_open, blocks.bounds, light, fresh
    )
    recounted = counts.astype(np.int32)
    recounted[where] = fresh
    return recounted


@kernel
def _count(points, vertices, faces, planes, is_open, boxes, light, counts):
    crossed = np.empty(faces.shape[0], np.int32)
    start, to_light = np.empty(4), np.empty(3)
    start[3] = 1.0
    for i in range(points.shape[0]):
        for axis in range(3):
            start[axis] = points[i, axis]
            to_light[axis] = light[axis] - light[3] * points[i, axis]
        n, _ = pierce(
            vertices, faces, planes, boxes, points[i], to_light, light[3] > 0.0, start, light,
            crossed,
        )  # fmt: skip
        for k in range(n):
            counts[i] += crossed[k] >= 0 or is_open[~crossed[k]]
