"""
Regions of a camera and a light: the view frustum and the occlusion pyramid.

A caster outside the hull of near rectangle and light leaves the viewport lit. Regions are inward
planes, slightly widened, in any caster's own frame.

Sources: McGuire et al. 2003, section 5.2 and figure 2; docs/papers.md, M6.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from umbra.scene.camera import Camera

__all__ = [
    "Regions",
    "find_many_regions",
    "find_near_rectangle",
    "find_view_planes",
    "make_regions",
    "occlusion_pyramid",
]


def find_near_rectangle(
    camera: Camera, origin: ArrayLike = (0.0, 0.0, 0.0), scissor: ArrayLike | None = None
) -> NDArray[np.float64]:
    """
    Find the rectangle of the picture, or of a scissor, in the near plane.

    Returns (4, 3) float64: top left, bottom left, bottom right, top right, relative to the origin
    [m]. A scissor is left, top, right, bottom [pixels].
    """
    chosen = (0, 0, *camera.size) if scissor is None else scissor
    corners = np.zeros((4, 3))
    scissors = np.asarray(chosen, np.float64)
    _write_rectangle(*_measure_near_plane(camera, origin), scissors, corners)
    return corners


def _measure_near_plane(
    camera: Camera, origin: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, NDArray[np.float64]]:
    """Return the near plane's middle, axes, size of a pixel, and middle as a pixel's corner."""
    axes, rows = camera.pixel_axes, camera.size[1]
    if camera.height is None:
        pixel = camera.near * 2.0 * np.tan(np.radians(camera.fov) / 2.0) / rows
    else:
        pixel = camera.height / rows
    middle = camera.eye - np.asarray(origin, np.float64) + camera.near * axes[2]
    # Pixel centres have integer coordinates.
    return middle, axes, float(pixel), np.array(camera.center) + 0.5


@njit(cache=True, nogil=True)
def _write_rectangle(middle, axes, pixel, center, scissor, corners):
    """Write the corners of a scissor's rectangle in the near plane."""
    left, right = scissor[0] - center[0], scissor[2] - center[0]
    top, bottom = center[1] - scissor[1], center[1] - scissor[3]
    for axis in range(3):
        across, up = pixel * axes[0, axis], pixel * axes[1, axis]
        corners[0, axis] = middle[axis] + left * across + top * up
        corners[1, axis] = middle[axis] + left * across + bottom * up
        corners[2, axis] = middle[axis] + right * across + bottom * up
        corners[3, axis] = middle[axis] + right * across + top * up


def find_view_planes(
    camera: Camera, origin: ArrayLike = (0.0, 0.0, 0.0), scissor: ArrayLike | None = None
) -> NDArray[np.float64]:
    """
    Find the planes of the view through the picture, or through a scissor.

    Returns (5, 4) float64: near, left, bottom, right, top; inward, with unit normals, for points
    relative to the origin. There is no far plane: with depth clamping, z-fail needs volumes to
    infinity.
    """
    corners = find_near_rectangle(camera, origin, scissor)
    planes = np.zeros((5, 4))
    eye = camera.eye - np.asarray(origin, np.float64)
    _write_view(corners, eye, camera.axes()[2], camera.is_perspective, planes)
    return planes


@njit(cache=True, nogil=True)
def _write_view(corners, eye, forward, is_perspective, planes):
    """Write the planes of ``find_view_planes``."""
    planes[0, :3] = forward
    planes[0, 3] = -(forward * corners[0]).sum()
    for side in range(4):
        here = corners[side]
        ray = here - eye if is_perspective else forward
        # Corners run counter-clockwise seen from the eye, so ray x edge points outward.
        normal = np.cross(corners[(side + 1) % 4] - here, ray)
        normal /= np.sqrt((normal * normal).sum())
        planes[1 + side, :3] = normal
        planes[1 + side, 3] = -(normal * here).sum()


MARGIN = 1e-6
"""Widening of regions, relative to the near rectangle's coordinates."""


@dataclass(frozen=True, eq=False)
class Regions:
    """
    Planes shared by all placements of one camera and one light.

    ``pyramid`` (n, 4) and ``view`` (5, 4) are inward planes, slightly widened, of the occlusion
    pyramid and of the infinite view; ``light`` (4,) is in their frame.
    """

    pyramid: NDArray[np.float64]
    view: NDArray[np.float64]
    light: NDArray[np.float64]

    def within(self, transform: NDArray[np.float64]) -> "Regions":
        """Return the regions in a caster's own frame; ``transform`` maps that frame to this one."""
        light = np.asarray(np.linalg.solve(transform, self.light), np.float64)
        light[3] = self.light[3]
        return Regions(self.pyramid @ transform, self.view @ transform, light)


def occlusion_pyramid(
    camera: Camera,
    light: ArrayLike,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    scissor: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """
    Find the planes (n, 4) around all segments from the near rectangle to a light (4,).

    A directional light yields an infinite prism. Each plane contains an edge of the rectangle and
    the homogeneous light and faces the rectangle's centre; the near plane faces the light. A light
    in the near plane spans no volume: the result is a slab around the near plane, so that casters
    that touch it near the rectangle count as occluding. Planes that rounding may have spoilt are
    left out or moved outward, so n is 5, or 2 to 6 for a light in the near plane.
    """
    corners = find_near_rectangle(camera, origin, scissor)
    light = np.asarray(light, np.float64)
    planes = np.zeros((6, 4))
    n = _write_pyramid(corners, camera.axes()[2], light, planes)
    return planes[:n]


@njit(cache=True, nogil=True)
def _write_pyramid(corners, forward, light, planes):
    """Write the planes of ``occlusion_pyramid``; return their number."""
    to_light = light[:3] - light[3] * corners
    edges = np.zeros((4, 3))
    for side in range(4):
        edges[side] = corners[(side + 1) % 4] - corners[side]
    reach, size = np.abs(to_light).max(), np.abs(edges).max()
    rise = (forward * to_light[0]).sum()
    limit = 1e-9 * max(reach, size) if light[3] != 0.0 else 1e-12 * reach
    is_off = abs(rise) > limit  # the light is not in the near plane
    planes[0, :3] = forward if rise > 0.0 or not is_off else -forward
    n = 1
    if not is_off:
        planes[1, :3] = -forward
        n = 2
    middle = (corners[0] + corners[1] + corners[2] + corners[3]) / 4.0
    for side in range(4):
        normal = np.cross(edges[side], to_light[side] if is_off else forward)
        length = np.sqrt((normal * normal).sum())
        if length > 1e-12 * size * (reach if is_off else 1.0):
            inner = (normal * (middle - corners[side])).sum()
            planes[n, :3] = normal / (-length if inner < 0.0 else length)
            n += 1

    # A plane is valid if all points of the pyramid are inside: move it until they are, and leave it
    # out if a directional light crosses it outward.
    m = 0
    for k in range(n):
        normal = planes[k, :3].copy()
        lowest = np.inf
        for corner in range(4):
            lowest = min(lowest, (normal * corners[corner]).sum())
        if light[3] != 0.0:
            lowest = min(lowest, (normal * light[:3]).sum() / light[3])
        elif (normal * light[:3]).sum() < -1e-12 * reach:
            continue
        planes[m, :3] = normal
        planes[m, 3] = -lowest
        m += 1
    return m


def make_regions(
    camera: Camera,
    light: ArrayLike,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    scissor: ArrayLike | None = None,
    margin: float = MARGIN,
) -> Regions:
    """
    Find the occlusion pyramid and the view of a camera and a light (4,), for many casters.

    The light is relative to the origin [m]; the scissor (left, top, right, bottom) [pixels] is the
    drawn part of the picture. Planes move outward by the margin times the near rectangle's largest
    coordinate, for devices that compute in float32.
    """
    light = np.asarray(light, np.float64)
    pyramid = occlusion_pyramid(camera, light, origin, scissor)
    view = find_view_planes(camera, origin, scissor)
    slack = margin * float(np.abs(find_near_rectangle(camera, origin, scissor)).max())
    pyramid[:, 3] += slack
    view[:, 3] += slack
    return Regions(pyramid, view, light)


def find_many_regions(
    camera: Camera,
    origin: ArrayLike,
    lights: NDArray[np.float64],
    scissors: NDArray[np.int64],
    margin: float = 0.0,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """
    Find the occlusion pyramids and the views of many lights at once, as ``make_regions``.

    Parameters
    ----------
    camera : Camera
    origin : (3,)
    lights : (n, 4) float64
        Relative to the origin [m].
    scissors : (n, 4) int64
        Left, top, right, bottom [pixels]; nothing is written for an empty one.
    margin : float
        As in ``make_regions``.

    Returns
    -------
    pyramids : (n, 6, 4) float64
        Rows of fewer planes are filled by planes that hold everything.
    views : (n, 5, 4) float64
    rectangles : (n, 4, 3) float64
        In the near plane, as ``find_near_rectangle``.
    """
    pyramids, views = np.zeros((len(lights), 6, 4)), np.zeros((len(lights), 5, 4))
    rectangles = np.zeros((len(lights), 4, 3))
    eye = camera.eye - np.asarray(origin, np.float64)
    plane = _measure_near_plane(camera, origin)
    _write_many(
        *plane, eye, camera.is_perspective, lights, scissors.astype(np.float64), margin,
        pyramids, views, rectangles,
    )  # fmt: skip
    return pyramids, views, rectangles


@njit(cache=True, nogil=True)
def _write_many(
    middle, axes, pixel, center, eye, is_perspective, lights, scissors, margin, pyramids, views,
    rectangles,
):  # fmt: skip
    """Write the regions of ``find_many_regions``."""
    for k in range(lights.shape[0]):
        scissor = scissors[k]
        if not (scissor[2] > scissor[0] and scissor[3] > scissor[1]):
            continue
        corners = rectangles[k]
        _write_rectangle(middle, axes, pixel, center, scissor, corners)
        _write_view(corners, eye, axes[2], is_perspective, views[k])
        used = _write_pyramid(corners, axes[2], lights[k], pyramids[k])
        pyramids[k, used:] = np.array([0.0, 0.0, 0.0, 1.0])
        slack = margin * np.abs(corners).max()
        pyramids[k, :, 3] += slack
        views[k, :, 3] += slack
