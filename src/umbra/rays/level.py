"""
Counts on level faces in whose plane the light lies: a roof under a level sun.

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

__all__ = ["find_level", "recount_level"]

_BESIDE = 2.0**-30  # of the largest coordinate


def find_level(
    view: DepthBuffer, triangles: Triangles, light: NDArray[np.float64]
) -> NDArray[np.bool_] | None:
    """Find the pixels that see a level face in the plane of a light (4,); None without any."""
    if not light[3] and light[2]:
        return None

    def find_heights() -> tuple[NDArray[np.float64], set[float]]:
        z = triangles.vertices[triangles.faces, 2]
        level = np.where((z == z[:, :1]).all(1), z[:, 0], np.nan)
        # The ground and the background, -2 and -1, are no faces.
        return np.append(level, [np.nan, np.nan]), set(level[~np.isnan(level)].tolist())

    heights, known = derive(triangles, "level faces", None, find_heights)
    if light[3] and light[2] / light[3] not in known:
        return None
    seen = heights[view.face]
    found = seen == light[2] / light[3] if light[3] else ~np.isnan(seen)
    return found if found.any() else None


def recount_level(
    counts: NDArray[np.integer],
    where: NDArray[np.bool_],
    frame: VisibleSurface,
    caster: Caster,
    camera: Camera,
    light: NDArray[np.float64],
    origin: NDArray[np.float64],
) -> NDArray[np.int32]:
    """
    Count the faces between a light and visible points of level faces in its plane.

    Parameters
    ----------
    counts : (rows, cols) int
        Counts of the view.
    where : (rows, cols) bool
        The points, from ``find_level``.
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
    points[:, 2] += np.copysign(_BESIDE * size, frame.normal[where][:, 2])
    found = np.zeros(len(points), np.int32)
    is_open = (~caster.is_closed)[caster.component].astype(caster.component.dtype)
    _count(
        points, caster.vertices, caster.faces, caster.planes, is_open, blocks.bounds, light, found
    )
    recounted = counts.astype(np.int32)
    recounted[where] = found
    return recounted


@njit(cache=True, nogil=True)
def _count(points, vertices, faces, planes, is_open, boxes, light, counts):
    lit, unlit = np.zeros(2, np.int64), np.zeros(2, np.int64)  # of closed and open components
    start = np.ones(4)
    for i in range(points.shape[0]):
        start[:3] = points[i]
        lit[:], unlit[:] = 0, 0
        pierce(
            vertices, faces, planes, is_open, boxes, points[i],
            light[:3] - light[3] * points[i], light[3] > 0.0, start, light, lit, unlit,
        )  # fmt: skip
        counts[i] = lit.sum() + unlit[1]
