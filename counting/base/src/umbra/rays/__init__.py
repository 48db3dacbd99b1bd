"""
Ray queries: the visible surface of a camera, and occluders between points and lights.

``depth`` finds the face and depth of each pixel; this module turns them into the visible surface:
positions in the model's own coordinates, normals and parts.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.rays.depth import GROUND, NOTHING, DepthBuffer, rasterise_depth
from umbra.scene import Camera, Light, Scene
from umbra.scene.scene import Triangles

__all__ = ["VisibleSurface", "count_cut", "locate"]

_CLOSEST = 1e-6  # of the near plane's distance: nearer faces are ignored
_GRAIN = 2.0**-42
"""Error of a visible point's position, relative to the largest coordinate."""


@dataclass(frozen=True, eq=False)
class VisibleSurface:
    """
    The visible surface of a scene.

    Parameters
    ----------
    position : (rows, cols, 3) float64
        In the model's own coordinates [m]; NaN where nothing is seen.
    normal : (rows, cols, 3) float64
        Unit normal of the visible side; NaN where nothing is seen.
    part : (rows, cols) int32
        Index in ``Scene.parts``; ``NOTHING`` or ``GROUND``.
    """

    position: NDArray[np.float64]
    normal: NDArray[np.float64]
    part: NDArray[np.int32]

    def lit(self, counts: NDArray[np.signedinteger], light: Light) -> NDArray[np.bool_]:
        """
        Return the visible points that a light reaches: unshadowed, facing it, in its range.

        Materials do not matter: surfaces that are emissive, unlit or transparent cast and receive
        shadows.

        Parameters
        ----------
        counts : (rows, cols) int
            Shadow counts of this light.
        light : Light

        Returns
        -------
        lit : (rows, cols) bool
        """
        seen = self.part != NOTHING
        position = self.position[seen]
        way = light.position[:3] - light.position[3] * position
        # A lamp in the plane of a face sees it edge-on, within the rounding of positions.
        coarse = np.abs(position).max(-1) + np.abs(light.position[:3]).max()
        least = light.position[3] * _GRAIN * coarse
        facing = np.einsum("ij,ij->i", self.normal[seen], way) > least
        if light.axis is not None or light.range < np.inf:
            facing &= light.is_within(position)
        lit = np.zeros(self.part.shape, np.bool_)
        lit[seen] = facing & (counts[seen] == 0)
        return lit


def locate(
    view: DepthBuffer, camera: Camera, triangles: Triangles, ground: float | None = None
) -> VisibleSurface:
    """
    Find the points of the model that a camera sees.

    Parameters
    ----------
    view : DepthBuffer
        View of this camera.
    camera : Camera
    triangles : Triangles
        Triangles that the view's faces index.
    ground : float, optional
        z of the ground plane in the view [m].

    Returns
    -------
    frame : VisibleSurface
    """
    height = camera.height
    if height is None:
        height = 2 * np.tan(np.radians(camera.fov) / 2)
    position, normal = _place(
        view.key, view.face, triangles.vertices, triangles.faces, camera.eye, camera.pixel_axes,
        camera.center, float(height), camera.is_perspective,
    )  # fmt: skip
    if ground is not None:
        position[view.face == GROUND, 2] = ground
    part, mesh = view.face.copy(), view.face >= 0
    part[mesh] = triangles.part[view.face[mesh]]
    return VisibleSurface(position, normal, part)


@kernel
def _place(
    key: NDArray[np.float64],
    face: NDArray[np.int32],
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    eye: NDArray[np.float64],
    axes: NDArray[np.float64],
    center: tuple[float, float],
    height: float,
    is_perspective: bool,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Find the position of each visible point, and the unit normal of the visible side."""
    rows, cols = key.shape
    right, up, forward = axes
    pixel, ray = height / rows, forward.copy()
    position, normal = np.full((rows, cols, 3), np.nan), np.full((rows, cols, 3), np.nan)
    for i in range(rows):
        for j in range(cols):
            if face[i, j] == NOTHING:
                continue
            x, y = j - center[0], center[1] - i
            for k in range(3):
                across = pixel * (x * right[k] + y * up[k])
                if is_perspective:
                    ray[k] = forward[k] + across
                    position[i, j, k] = eye[k] + ray[k] / key[i, j]
                else:
                    position[i, j, k] = eye[k] + (across - key[i, j] * forward[k])
            n = _find_normal(vertices, faces, face[i, j])
            side = -1.0 if n[0] * ray[0] + n[1] * ray[1] + n[2] * ray[2] > 0 else 1.0
            for k in range(3):
                normal[i, j, k] = side * n[k]
    return position, normal


@kernel
def _find_normal(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], face: int
) -> tuple[float, float, float]:
    """Find the unit normal of a face, or of the ground."""
    if face == GROUND:
        return 0.0, 0.0, 1.0
    p, q, r = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
    ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    bx, by, bz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    length = math.sqrt(x**2 + y**2 + z**2)
    return x / length, y / length, z / length


def count_cut(scene: Scene, camera: Camera, threads: int = 1) -> int:
    """Count the pixels where a face lies between the eye and the near plane, so is not drawn."""
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
