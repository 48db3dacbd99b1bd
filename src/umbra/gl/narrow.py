"""Where a light of limited range can change a picture: its scissor and depth bounds."""

import numpy as np
from numpy.typing import NDArray

from umbra.scene import Camera, Light
from umbra.volume.scissor import find_depth_bounds, find_sphere_depths, find_sphere_scissors

__all__ = ["find_reach", "find_scissor", "turn_scissor"]


def find_reach(
    camera: Camera, origin: NDArray, source: NDArray, reach: float
) -> tuple[NDArray[np.int64] | None, tuple[float, float] | None]:
    """
    Find what a light's range reaches of a picture.

    Parameters
    ----------
    camera : Camera
    origin : (3,) float64
        Of the scene.
    source : (4,) float64
        The light, relative to the origin.
    reach : float
        Its range [m].

    Returns
    -------
    corners : (4,) int64 or None
        Left, top, right, bottom [pixels], row 0 the top; None where all is reached.
    depths : (float, float) or None
        Lowest and highest window depth, in perspective.
    """
    if np.isinf(reach) or source[3] == 0:
        return None, None
    place = source[None, :3]
    (corners,) = find_sphere_scissors(camera, place, [reach], origin)
    if not camera.is_perspective:
        return corners, None
    found = find_depth_bounds(camera, find_sphere_depths(camera, place, [reach], origin))
    low, high = found.bounds[0].tolist()
    return corners * ~found.is_empty[0], (low, high)


def turn_scissor(corners: NDArray[np.int64], camera: Camera) -> tuple[int, int, int, int]:
    """Give a rectangle as OpenGL has it, its rows counted from below."""
    left, top, right, bottom = corners.tolist()
    return left, camera.size[1] - bottom, right - left, bottom - top


def find_scissor(camera: Camera, origin: NDArray, light: Light) -> tuple[int, int, int, int] | None:
    """Find the rectangle that a light's range reaches, as OpenGL has it; None: all."""
    corners, _ = find_reach(camera, origin, light.local(origin), light.range)
    return None if corners is None else turn_scissor(corners, camera)
