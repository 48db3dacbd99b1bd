"""
What lies on rays: what the eye sees, and what is between a place and the light.

``depth`` tells which face a pixel sees and how near; here this becomes the visible surface:
places in the model's own coordinates, normals and parts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.rays.depth import GROUND, NOTHING, DepthBuffer, rasterise_depth
from umbra.scene import Camera, Light, Scene
from umbra.scene.scene import Triangles

__all__ = ["VisibleSurface", "count_cut", "locate"]

_CLOSEST = 1e-6  # of the near plane's distance: what is nearer to the eye is not looked for
_GRAIN = 2.0**-42
"""Of the largest coordinate: how well the place of a visible point is known."""


@dataclass(frozen=True, eq=False)
class VisibleSurface:
    """
    The visible surface of a scene.

    Parameters
    ----------
    position : (rows, cols, 3) float64
        In the model's own coordinates [m]; NaN where nothing is seen.
    normal : (rows, cols, 3) float64
        Unit normal of the side that is seen; NaN where nothing is.
    part : (rows, cols) int32
        Index in ``Scene.parts``; ``NOTHING`` or ``GROUND``.
    """

    position: NDArray[np.float64]
    normal: NDArray[np.float64]
    part: NDArray[np.int32]

    def lit(self, counts: NDArray[np.signedinteger], light: Light) -> NDArray[np.bool_]:
        """
        Tell which visible points a light reaches: unshadowed, turned to it, within its reach.

        Surfaces are what they are for every material: one that glows, is unlit or lets
        light through can be in shadow and casts one.

        Parameters
        ----------
        counts : (rows, cols) int
            Shadow counts of this light.
        light : Light

        Returns
        -------
        lit : (rows, cols) bool
        """
        position = np.nan_to_num(self.position)
        way = light.position[:3] - light.position[3] * position
        # What a lamp lies in the plane of, it sees edge-on: positions tell no more than this.
        coarse = np.abs(position).max(-1) + np.abs(light.position[:3]).max()
        least = light.position[3] * _GRAIN * coarse
        facing = np.einsum("ijk,ijk->ij", np.nan_to_num(self.normal), way) > least
        if light.axis is not None or light.range < np.inf:
            facing &= light.is_within(position)
        return facing & (counts == 0) & (self.part != NOTHING)


def locate(
    view: DepthBuffer, camera: Camera, triangles: Triangles, ground: float | None = None
) -> VisibleSurface:
    """
    Find where in the model the points lie that a camera sees.

    Parameters
    ----------
    view : DepthBuffer
        Of this camera.
    camera : Camera
    triangles : Triangles
        Whose faces the view names.
    ground : float, optional
        z of the ground plane in the view [m].

    Returns
    -------
    frame : VisibleSurface
    """
    rows, cols = view.key.shape
    right, up, forward = camera.axes()
    x = np.arange(cols) - (cols - 1) / 2
    y = (rows - 1) / 2 - np.arange(rows)
    seen = view.face != NOTHING
    if camera.height is None:
        pixel = 2 * np.tan(np.radians(camera.fov) / 2) / rows
        ray = forward + pixel * (x[None, :, None] * right + y[:, None, None] * up)
        apart = ray[seen] / view.key[seen, None]
    else:
        pixel = camera.height / rows
        across = pixel * (x[None, :, None] * right + y[:, None, None] * up)
        ray = np.broadcast_to(forward, across.shape)
        apart = across[seen] - view.key[seen, None] * forward
    position = np.full((rows, cols, 3), np.nan)
    position[seen] = camera.eye + apart
    if ground is not None:
        position[view.face == GROUND, 2] = ground

    normal = np.full((rows, cols, 3), np.nan)
    mesh = view.face >= 0
    corners = triangles.vertices[triangles.faces[view.face[mesh]]]
    plane = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal[mesh] = plane / np.linalg.norm(plane, axis=1, keepdims=True)
    normal[view.face == GROUND] = (0.0, 0.0, 1.0)
    is_back = np.einsum("ijk,ijk->ij", np.nan_to_num(normal), ray) > 0
    normal[is_back] *= -1.0

    part = view.face.copy()
    part[mesh] = triangles.part[view.face[mesh]]
    return VisibleSurface(position, normal, part)


def count_cut(scene: Scene, camera: Camera, threads: int = 1) -> int:
    """Count the pixels where something that is not drawn lies between eye and near plane."""
    soup = scene.triangles()
    forward = camera.axes()[2]
    ahead = soup.vertices @ forward - (camera.eye - scene.origin) @ forward
    corners = ahead[soup.faces]
    close = (corners.min(1) < camera.near) & (corners.max(1) > 0)
    if not close.any():
        return 0
    if camera.is_perspective:
        limits = (1 / camera.near, 1 / (_CLOSEST * camera.near))
    else:
        limits = (-camera.near, 0.0)
    matrix = camera.matrix(scene.origin)
    view = rasterise_depth(soup.vertices, soup.faces[close], matrix, camera.size, limits, threads)
    return int((view.face != NOTHING).sum())
