"""Named views of a model: cameras that its bounds place, so that it fills the picture."""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from umbra.scene.camera import Camera, fit_camera

__all__ = ["FOV", "NamedView", "make_named_view"]

NamedView = Literal["isometric", "plan", "street", "bird"]
FOV = 28.0
"""Vertical field of view of the perspective ones [degrees]: a short telephoto lens."""
_FROM = {
    "isometric": ((1.0, 1.0, -1.0), (0.0, 0.0, 1.0)),
    "plan": ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "bird": ((0.5, 0.8, 0.0), (0.0, 0.0, 1.0)),
}  # the view's direction, and up: from the south-west, or north up
_DOWN = 0.6  # of a bird's view, below its horizon, per distance: 31 degrees
_EYE = 1.7  # above the ground [m]
_TRIES, _CLOSE = 8, 0.01  # the eye's height decides how far away it stands, where the ground is [m]
_HORIZON = 0.3  # of a street's picture, below its middle [heights]
_MARGIN = 0.06  # of the picture, on each side


def make_named_view(
    view: NamedView,
    points: NDArray[np.float64],
    size: tuple[int, int],
    fov: float,
    near: float,
    find_height: Callable[[float, float], float] | None = None,
) -> Camera:
    """
    Make the camera of a named view.

    Parameters
    ----------
    view : {'isometric', 'plan', 'street', 'bird'}
        The first two are orthographic. The others look level, with an off-axis lens, so that
        verticals stay upright: a street is seen from 1.7 m above the ground, its horizon below the
        picture's middle; a bird's horizon is far above the picture.
    points : (n, 3) float64
        Of the model [m].
    size : (int, int)
        Columns and rows.
    fov, near : float
        Vertical field of view [degrees]; near plane [m].
    find_height : callable, optional
        Return the height of the ground at x, y [m]; by default that of the lowest point.
    """
    if view == "street":
        lowest = float(points[:, 2].min())
        return _stand_in_street(points, size, fov, near, find_height or (lambda _x, _y: lowest))
    forward, up = (np.array(vector) for vector in _FROM[view])
    middle = points.mean(0)
    camera = Camera(middle - forward, middle, up, size, fov, near=near)
    if view == "bird":
        length = size[1] / (2 * np.tan(np.radians(fov) / 2))  # focal [pixels]
        camera = replace(camera, shift=(0.0, -_DOWN * length))
    else:
        wide, high = np.ptp(points @ camera.axes().T[:, :2], axis=0)
        height = max(float(high), float(wide) * size[1] / size[0], 1e-3) / (1 - 2 * _MARGIN)
        camera = replace(camera, height=height)
    return fit_camera(camera, points, _MARGIN)


def _stand_in_street(
    points: NDArray[np.float64],
    size: tuple[int, int],
    fov: float,
    near: float,
    find_height: Callable[[float, float], float],
) -> Camera:
    """Look level at the model from the south, as far away as shows all of it."""
    low, high = points.min(0), points.max(0)
    forward = np.array([0.0, 1.0, 0.0])
    slope = np.tan(np.radians(fov) / 2) * (1 - 2 * _MARGIN)
    middle = np.array([*(low + high)[:2] / 2, low[2] + _EYE])
    eye = middle
    for _ in range(_TRIES):
        across, ahead, above = (points - middle).T
        needed = [
            np.abs(across) / (slope * size[0] / size[1]) - ahead,
            above / (slope * (1 + 2 * _HORIZON)) - ahead,
            -above / (slope * (1 - 2 * _HORIZON)) - ahead,
        ]
        away = max(float(np.max(needed)), near - float(ahead.min()))
        eye = middle - away * forward
        height = find_height(float(eye[0]), float(eye[1])) + _EYE
        if abs(height - middle[2]) < _CLOSE:
            break
        middle[2] = height
    eye[2] = middle[2]
    return Camera(eye, middle, size=size, fov=fov, near=near, shift=(0.0, _HORIZON * size[1]))
