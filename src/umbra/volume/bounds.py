"""
What a frame can leave out: lights and volumes out of view, pixels and depths out of reach.

Everything here is conservative: what it drops cannot change the picture. Regions are
given as inward planes (a, b, c, d), a point x being inside where a x + b y + c z + d w
is not negative in any; shapes as homogeneous points that span them, (direction, 0)
being infinitely far. So a volume that ends at infinity is treated like one that ends on
a floor. Rectangles of pixels are (left, top, right, bottom), right and bottom left out;
row 0 is the top, as in a picture.

Sources: McGuire et al. 2003, sections 4, 5.1 and 6; Wallner 2008, section 6.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.scene.camera import Camera

__all__ = ["find_box_points", "find_near_rectangle", "find_view_planes", "is_outside"]

_CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])


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


def find_box_points(bounds: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Give the corners of boxes.

    Parameters
    ----------
    bounds : (n, 2, 3) float64
        Lowest and highest corner of each [m].

    Returns
    -------
    points : (n, 8, 4) float64
        Homogeneous; x changes fastest.
    """
    bounds = np.asarray(bounds, np.float64)
    points = np.ones((len(bounds), 8, 4))
    points[..., :3] = bounds[:, _CORNERS, [0, 1, 2]]
    return points


def is_outside(planes: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """
    Tell which shapes lie wholly beyond one of a region's planes.

    Parameters
    ----------
    planes : (k, 4) float64
        Inward.
    points : (n, m, 4) float64
        What spans each of n shapes, homogeneous with w >= 0.

    Returns
    -------
    outside : (n,) bool
        True means surely outside; False that the shape may reach in.
    """
    values = points @ planes.T
    # Of a shape that ends at infinity only its finite points must be truly beyond.
    beyond = np.where(points[..., 3:] > 0, values < 0, values <= 0)
    return np.asarray(beyond.all(1).any(-1))
