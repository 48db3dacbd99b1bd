"""Cameras along a way: once around what a camera looks at, and through given ones in turn."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.scene.camera import Camera

__all__ = ["follow_cameras", "hold_in_turn", "turn_camera"]


def turn_camera(camera: Camera, count: int) -> list[Camera]:
    """
    Take a camera once around its target, clockwise as seen from above, at even steps.

    The first of ``count`` cameras is the given one, and the last stands a step before it, so that
    a film of them loops.
    """
    eye, target = np.asarray(camera.eye, np.float64), np.asarray(camera.target, np.float64)
    up = np.asarray(camera.up, np.float64)
    upright = np.array([0.0, 0.0, 1.0])
    ways = [_turn(upright, -2 * np.pi * k / count) for k in range(count)]
    return [replace(camera, eye=target + way @ (eye - target), up=way @ up) for way in ways]


def hold_in_turn(
    camera: Camera, points: NDArray[np.float64], count: int, margin: float = 0.04
) -> Camera:
    """
    Return a camera that looks at the middle of points, all of which its turn's pictures hold.

    Its direction is kept. ``points`` (n, 3) are in the model [m], ``margin`` is of the picture.
    """
    target = (points.min(0) + points.max(0)) / 2
    cols, rows = camera.size
    fill = 1 - 2 * margin
    slope = fill * np.tan(np.radians(camera.fov) / 2)
    away, high = camera.near, 0.0
    axes, slant = camera.axes(), camera.slant()
    aim = axes[2] + slant @ axes[:2]  # toward the picture's middle
    at = replace(camera, eye=target - aim, target=target - aim + axes[2])
    for one in turn_camera(at, count):
        across, above, ahead = np.array(one.axes()) @ (points - target).T
        across, above = across - slant[0] * ahead, above - slant[1] * ahead
        need = np.maximum(np.abs(across) * rows / cols, np.abs(above))
        away = max(away, float((need / slope - ahead).max()))
        high = max(high, 2 * float(need.max()) / fill)
    if not camera.is_perspective:
        return replace(at, height=high, eye=target - (away + high) * axes[2], target=target)
    eye = target - away * aim
    return replace(at, eye=eye, target=eye + away * axes[2])


def _turn(axis: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Return the matrix (3, 3) of a turn about a unit axis, anticlockwise [radians]."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def follow_cameras(cameras: Sequence[Camera], count: int) -> list[Camera]:
    """
    Go smoothly through cameras, at even steps, from the first to the last.

    Target, distance, heading and tilt of the view are each interpolated by monotone cubics (Fritsch
    and Carlson 1980), which never overshoot: a camera between two of one height keeps it. Each leg
    takes as long as any other.

    Parameters
    ----------
    cameras : sequence of Camera
        At least two, upright, all of them perspective.
    count : int
        How many cameras are returned.

    Raises
    ------
    InputError
        If there are fewer than two, or one is orthographic.
    """
    if len(cameras) < 2:
        msg = f"a path needs at least two views, and this has {len(cameras)}"
        raise InputError(msg)
    for number, camera in enumerate(cameras, start=1):
        if camera.height is not None:
            msg = f"view {number} of the path is orthographic; a path is of perspective views"
            raise InputError(msg)
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415

    eyes = np.array([camera.eye for camera in cameras], np.float64)
    targets = np.array([camera.target for camera in cameras], np.float64)
    back = eyes - targets
    level = np.hypot(back[:, 0], back[:, 1])
    heading = np.unwrap(np.arctan2(back[:, 1], back[:, 0]))  # the shorter way round
    shape = np.column_stack(
        [
            np.log(np.linalg.norm(back, axis=1)),
            np.arctan2(back[:, 2], level),
            heading,
            [camera.fov for camera in cameras],
            np.log([camera.near for camera in cameras]),
        ]
    )
    stops = np.arange(len(cameras), dtype=np.float64)
    at = np.linspace(0, stops[-1], count)
    aims = PchipInterpolator(stops, targets)(at)
    path = []
    for aim, (far, tilt, turned, fov, near) in zip(
        aims, PchipInterpolator(stops, shape)(at), strict=True
    ):
        way = [np.cos(tilt) * np.cos(turned), np.cos(tilt) * np.sin(turned), np.sin(tilt)]
        eye = aim + np.exp(far) * np.array(way)
        path.append(
            replace(
                cameras[0], eye=eye, target=aim, fov=float(fov),
                near=float(np.exp(near)),
            )
        )  # fmt: skip
    return path
