"""
What is seen through a picture, or a part of it: the near rectangle, and planes to infinity.

Planes are inward (a, b, c, d): a point x is inside where a x + b y + c z + d w is not
negative in any.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.scene.camera import Camera

__all__ = ["find_near_rectangle", "find_view_planes"]


def find_near_rectangle(
    camera: Camera, origin: ArrayLike = (0.0, 0.0, 0.0), scissor: ArrayLike | None = None
) -> NDArray[np.float64]:
    """
    Find where the picture lies in the near plane.

    Parameters
    ----------
    camera : Camera
    origin : (3,) float64
        Subtracted from the eye: points are given relative to it [m].
    scissor : (4,) int, optional
        Left, top, right, bottom [pixels]; the whole picture by default.

    Returns
    -------
    corners : (4, 3) float64
        Top left, bottom left, bottom right, top right [m].
    """
    cols, rows = camera.size
    left, top, right, bottom = (0, 0, cols, rows) if scissor is None else np.asarray(scissor)
    across, up, forward = camera.axes()
    if camera.height is None:
        pixel = camera.near * 2.0 * np.tan(np.radians(camera.fov) / 2.0) / rows
    else:
        pixel = camera.height / rows
    x = pixel * (np.array([left, left, right, right]) - cols / 2.0)
    y = pixel * (rows / 2.0 - np.array([top, bottom, bottom, top]))
    middle = camera.eye - np.asarray(origin, np.float64) + camera.near * forward
    return middle + x[:, None] * across + y[:, None] * up


def find_view_planes(
    camera: Camera, origin: ArrayLike = (0.0, 0.0, 0.0), scissor: ArrayLike | None = None
) -> NDArray[np.float64]:
    """
    Find the planes of what is seen through the picture or a part of it.

    There is no far plane: with depth clamping, z-fail needs volumes to infinity.

    Parameters
    ----------
    camera : Camera
    origin : (3,) float64
        Planes are for points relative to it [m].
    scissor : (4,) int, optional
        Left, top, right, bottom [pixels]; the whole picture by default.

    Returns
    -------
    planes : (5, 4) float64
        Near, left, bottom, right, top; inward, with unit normals.
    """
    corners = find_near_rectangle(camera, origin, scissor)
    forward = camera.axes()[2]
    if camera.height is None:
        rays = corners - (camera.eye - np.asarray(origin, np.float64))
    else:
        rays = np.broadcast_to(forward, (4, 3))
    normals = np.cross(rays, np.roll(corners, -1, 0) - corners)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Corners run counter-clockwise seen from the eye, so ray x edge points outward.
    normals = np.concatenate([forward[None], -normals])
    on = np.concatenate([corners[:1], corners])
    return np.column_stack([normals, -np.einsum("ij,ij->i", normals, on)])
