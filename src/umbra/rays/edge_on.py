"""
Counts on faces in whose plane the light lies: walls along the sun, a roof under a level one.

Sides of volumes lie in such a face, and rounding would tell which is nearer. A point is meant as
the limit from the viewer's side, so both devices ask a ray from just beside the face.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.rays import VisibleSurface
from umbra.rays.depth import DepthBuffer
from umbra.rays.eye_count import (
    FaceBlocks,
    find_cut_open,
    find_eye_count,
    find_faces_before,
    pierce,
)
from umbra.rays.holding import find_holders
from umbra.scene import Camera
from umbra.scene.derived import derive
from umbra.scene.scene import Triangles
from umbra.volume.adjacency import Caster

__all__ = ["find_edge_on", "recount_edge_on"]

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
    found = seen[np.abs(planes @ light) <= least]
    if not len(found):
        return None
    is_edge_on = np.zeros(len(triangles.faces) + 2, np.bool_)  # -2 and -1: ground and background
    is_edge_on[found] = True
    return is_edge_on[view.face]


@njit(cache=True, nogil=True)
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
    found = np.zeros(len(points), np.int32)
    is_open = (~caster.is_closed)[caster.component]
    _count(
        points, caster.vertices, caster.faces, caster.planes, is_open, blocks.bounds, light, found
    )
    recounted = counts.astype(np.int32)
    recounted[where] = found
    return recounted


@njit(cache=True, nogil=True)
def _count(points, vertices, faces, planes, is_open, boxes, light, counts):
    crossed = np.empty(faces.shape[0], np.int32)
    start = np.ones(4)
    for i in range(points.shape[0]):
        start[:3] = points[i]
        n, _ = pierce(
            vertices, faces, planes, boxes, points[i], light[:3] - light[3] * points[i],
            light[3] > 0.0, start, light, crossed,
        )  # fmt: skip
        for k in range(n):
            counts[i] += crossed[k] >= 0 or is_open[~crossed[k]]
