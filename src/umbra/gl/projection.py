"""
Projection to OpenGL's clip space, relative to the eye so that float32 is enough.

A spot or a light of limited range affects only part of a picture: its *clip range*, a
scissor and depth bounds.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.state import ClipSpace
from umbra.rays.depth import find_ground_keys
from umbra.scene import Camera, Light
from umbra.volume.bounds import find_span
from umbra.volume.regions import find_near_rectangle, find_view_planes
from umbra.volume.scissor import (
    find_cone_scissor,
    find_depth_bounds,
    find_sphere_depths,
    find_sphere_scissors,
)

if TYPE_CHECKING:
    from umbra.gl.request import LightShape

__all__ = [
    "EDGE_ON",
    "CameraProjection",
    "find_clip_range",
    "find_clip_ranges",
    "find_light_source",
    "find_pixel",
    "find_scissors",
    "make_projection",
    "turn_scissor",
]

EDGE_ON = 1e-300
"""Planes whose points in the picture span a smaller volume are seen edge-on."""

_HORIZON = 1e4  # depth of an orthographic view, in sizes of the scene


def find_light_source(
    light: "Light | LightShape", origin: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return a light relative to a scene's origin, (4,); a direction has length 1."""
    source = light.local(origin)
    source[:3] /= 1.0 if source[3] else np.linalg.norm(source[:3])
    return source


@dataclass(frozen=True, eq=False)
class CameraProjection:
    """
    A camera's projection, as shaders need it.

    Parameters
    ----------
    matrix : (4, 4) float64
        From coordinates relative to the eye to the clip space.
    eye : (3,) float64
        Relative to the scene's origin [m].
    camera : Camera
        The same camera with the near plane moved to the nearest surface: nothing drawn is
        lost, and depth is more precise.
    asked : Camera
        The camera as requested.
    reverses_depth : bool
        As in ``Device``.
    is_zero_to_one : bool
        Depth in the clip space is 0 to w, as wherever it is reversed; else -w to w.
    is_mirrored : bool
        The picture is drawn mirrored: what the camera sees at the left is at the right.
    """

    matrix: NDArray[np.float64]
    eye: NDArray[np.float64]
    camera: Camera
    asked: Camera
    reverses_depth: bool = False
    is_zero_to_one: bool = False
    is_mirrored: bool = False

    @property
    def clip(self) -> ClipSpace:
        """The clip space that passes must set."""
        return ClipSpace(
            self.reverses_depth, self.reverses_depth or self.is_zero_to_one, self.is_mirrored
        )

    @property
    def clipping(self) -> Camera:
        """
        The camera whose near plane clips volumes: in perspective the requested one.

        Depth is clamped between that plane and the nearest surface. In parallel views that
        would keep points at infinity along the view, which have no position in the picture.
        """
        return self.asked if self.camera.is_perspective else self.camera

    @property
    def sees_all(self) -> bool:
        """Whether nothing extends in front of the near plane, so that no solid is cut open."""
        return self.camera.near > self.asked.near

    @property
    def clip_matrix(self) -> NDArray[np.float64]:
        """The matrix for shaders, in the projection's own clip space."""
        matrix = self.matrix.copy()
        if self.clip.is_zero_to_one:
            toward = -1.0 if self.reverses_depth else 1.0
            matrix[2] = (matrix[3] + toward * matrix[2]) / 2.0
        if self.is_mirrored:
            matrix[0] = -matrix[0]
        return matrix

    def magnified(self, x: float, y: float, times: tuple[int, int]) -> "CameraProjection":
        """Magnify the picture about one of its points (-1 to 1)."""
        matrix = self.matrix.copy()
        for row, (at, scale) in enumerate(zip((x, y), times, strict=True)):
            matrix[row] = scale * (matrix[row] - at * matrix[3])
        return replace(self, matrix=matrix)

    def tilted(self, tilt: NDArray[np.float64]) -> "CameraProjection":
        """Tilt parallel rays to the left and down by the tangents (2,) ``tilt``."""
        if not tilt.any():
            return self
        matrix = self.matrix.copy()
        scale = np.linalg.norm(matrix[:2, :3], axis=1)
        matrix[:2, :3] += np.outer(tilt * scale, self.camera.axes()[2])
        return replace(self, matrix=matrix)

    def _find_before(self) -> float:
        """Return how far before the near plane volumes begin, for ``volume.vert.glsl``."""
        near, begin, far = self.camera.near, self.clipping.near, self.camera.far
        ratio = 1.0 if np.isinf(far) else (far - begin) / (far - near)
        return near / begin * ratio - 1.0

    @cached_property
    def uniforms(self) -> dict[str, NDArray | float]:
        """The uniforms of ``place.glsl`` that depend on the camera alone."""
        high = self.eye.astype(np.float32)
        arrays: dict[str, NDArray] = {
            "projection": self.clip_matrix.astype(np.float32),
            "eye_high": high,
            "eye_low": (self.eye - high).astype(np.float32),
            "near_plane": self.clip.near_plane,
        }
        for array in arrays.values():
            array.setflags(write=False)  # so that a program uploads them once
        return {**arrays, "before": self._find_before()}

    @cached_property
    def lowest(self) -> float:
        """Lowest z of the near rectangle that clips volumes, in the frame of ``eye`` [m]."""
        corners = find_near_rectangle(self.clipping, self.asked.eye - self.eye)
        return float(corners[:, 2].min())

    @cached_property
    def rays(self) -> dict[str, Any]:
        """The uniforms of ``picture.glsl``: the rays of pixels."""
        rays = _find_rays(self)
        for array in rays.values():
            if isinstance(array, np.ndarray):
                array.setflags(write=False)
        return rays


def make_projection(
    camera: Camera,
    origin: NDArray[np.float64],
    bounds: NDArray[np.float64],
    ground: float | None = None,
    *,
    reverses_depth: bool = False,
) -> CameraProjection:
    """
    Find the projection that shows a scene with the best depth.

    In perspective, points at infinity get exactly the farthest depth, so that no far plane
    cuts them.

    Parameters
    ----------
    camera : Camera
    origin : (3,) float64
        Origin of the scene.
    bounds : (n, 2, 3) float64
        Bounds of all drawn surfaces, relative to the origin [m].
    ground : float, optional
        z of a plane drawn, too, relative to the origin [m].

    Returns
    -------
    projection : CameraProjection
    """
    right, up, forward = camera.axes()
    eye = camera.eye - origin
    nearest, furthest = _find_depths(camera, origin, bounds, ground)
    near = max(camera.near, min(nearest * 0.999, camera.far * 0.5))
    near = near if np.isfinite(near) else camera.near  # nothing is in view
    cols, rows = camera.size
    matrix = np.zeros((4, 4))
    if camera.height is None:
        scale = 1.0 / np.tan(np.radians(camera.fov) / 2)
        far = camera.far
        matrix[3, :3] = forward
        stretch = 1.0 if np.isinf(far) else (far + near) / (far - near)
        shift = -2.0 * near if np.isinf(far) else -2.0 * far * near / (far - near)
        matrix[2] = np.append(stretch * forward, shift)
    else:
        scale = 2.0 / camera.height
        far = min(camera.far, max(furthest * 1.001, 2.0 * near))
        matrix[3, 3] = 1.0
        matrix[2] = np.append(2.0 * forward, -(far + near)) / (far - near)
    matrix[0, :3] = right * scale * rows / (cols * camera.stretch)
    matrix[1, :3] = up * scale
    matrix[0] -= 2.0 * camera.aside[0] / cols * matrix[3]
    matrix[1] += 2.0 * camera.aside[1] / rows * matrix[3]
    return CameraProjection(matrix, eye, camera.begin_at(near), camera, reverses_depth)


def _find_depths(
    camera: Camera, origin: NDArray, bounds: NDArray, ground: float | None
) -> tuple[float, float]:
    """Bound the depths of visible points: (nearest, furthest) [m] along the view axis."""
    forward = camera.axes()[2]
    eye = camera.eye - origin
    nearest, furthest = find_span(find_view_planes(camera, origin), bounds, forward)
    nearest, furthest = nearest - forward @ eye, max(furthest - forward @ eye, camera.near)
    if ground is not None:
        # The key of a plane is affine in the picture, so its extremes are at the corners.
        cols, rows = camera.size
        slope = find_ground_keys(camera.matrix(origin), ground)
        if slope is None:
            return float(nearest), float(furthest)
        picture = np.array([[x, y, 1] for x in (-0.5, cols - 0.5) for y in (-0.5, rows - 0.5)])
        keys = picture @ slope
        if camera.height is None:
            nearest = min(nearest, 1.0 / keys.max()) if keys.max() > 0 else nearest
        else:
            size = np.ptp(bounds.reshape(-1, 3), axis=0).max() + np.abs(eye).max() + camera.height
            nearest = min(nearest, (-keys).min())
            furthest = max(furthest, min((-keys).max(), _HORIZON * size))
    return float(nearest), float(furthest)


def find_pixel(camera: Camera) -> tuple[float, float]:
    """Return the size of a pixel [m], and by how much it grows with each metre of distance."""
    rows = camera.size[1]
    if camera.height is not None:
        return camera.height / rows, 0.0
    return 0.0, float(2.0 * np.tan(np.radians(camera.fov) / 2.0) / rows)


def _find_rays(projection: CameraProjection) -> dict[str, Any]:
    camera = projection.camera
    right, up, forward = camera.pixel_axes
    cols, rows = camera.size
    if camera.height is None:
        pixel, ahead = 2 * np.tan(np.radians(camera.fov) / 2) / rows, forward
    else:
        pixel, ahead = camera.height / rows, np.zeros(3)
    left, below = cols / 2 - camera.aside[0], rows / 2 + camera.aside[1]
    return {
        "corner": ahead - pixel * (left * right + below * up),
        "across": pixel * right,
        "upward": pixel * up,
        "forward": forward,
        "is_perspective": int(camera.is_perspective),
    }


Rectangle = NDArray[np.int64]
"""Left, top, right, bottom [pixels], row 0 the top."""


def find_clip_range(
    camera: Camera, origin: NDArray, source: NDArray, light: Light
) -> tuple[Rectangle | None, tuple[float, float] | None]:
    """Find the clip range of a light; see ``find_clip_ranges``."""
    return find_clip_ranges(camera, origin, source[None], [light])[0]


def find_clip_ranges(
    camera: Camera, origin: NDArray, sources: NDArray, lights: "Sequence[Light | LightShape]"
) -> list[tuple[Rectangle | None, tuple[float, float] | None]]:
    """
    Find the clip ranges of lights, by their ranges and cones.

    Parameters
    ----------
    camera : Camera
    origin : (3,) float64
        Origin of the scene.
    sources : (n, 4) float64
        The lights, relative to the origin.
    lights : sequence of Light or LightShape

    Returns
    -------
    ranges : list of (corners, depths)
        Rectangle, None for the whole picture; lowest and highest window depth (float, float),
        None without a range or in parallel views.
    """
    ranges: list[tuple[Rectangle | None, tuple[float, float] | None]] = [(None, None)] * len(lights)
    limited = [
        number
        for number, light in enumerate(lights)
        if sources[number, 3] and (light.range < np.inf or light.axis is not None)
    ]
    if not limited:
        return ranges
    places = sources[limited, :3]
    reaches = np.array([lights[number].range for number in limited])
    corners = find_sphere_scissors(camera, places, reaches, origin)
    spans: list[tuple[float, float] | None] = [None] * len(limited)
    if camera.is_perspective:
        bounds = find_depth_bounds(camera, find_sphere_depths(camera, places, reaches, origin))
        spans = [(low, high) for low, high in bounds.bounds.tolist()]
        corners[bounds.is_empty & np.isfinite(reaches)] = 0
    for row, number in enumerate(limited):
        light, rectangle = lights[number], corners[row]
        if light.axis is not None:
            cone = find_cone_scissor(
                camera, places[row], light.axis, light.half_angle, light.range, origin
            )
            rectangle = _meet(rectangle, cone)
        ranges[number] = rectangle, spans[row] if light.range < np.inf else None
    return ranges


def _meet(first: NDArray[np.int64], second: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the intersection of two rectangles; all 0 if empty."""
    met = np.concatenate([np.maximum(first[:2], second[:2]), np.minimum(first[2:], second[2:])])
    return met * (met[2:] > met[:2]).all()


def turn_scissor(corners: NDArray[np.int64], camera: Camera) -> tuple[int, int, int, int]:
    """Return a rectangle as OpenGL's scissor, its rows counted from below."""
    left, top, right, bottom = corners.tolist()
    return left, camera.size[1] - bottom, right - left, bottom - top


def find_scissors(
    camera: Camera, origin: NDArray, lights: Sequence[Light]
) -> list[tuple[int, int, int, int] | None]:
    """Find the scissors of lights' ranges, as OpenGL's; None: whole picture."""
    sources = np.array([light.local(origin) for light in lights]).reshape(-1, 4)
    ranges = find_clip_ranges(camera, origin, sources, lights)
    return [None if corners is None else turn_scissor(corners, camera) for corners, _ in ranges]
