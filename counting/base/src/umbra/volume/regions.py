"""
Regions of a camera and a light: the view frustum and the occlusion pyramid.

A caster outside the hull of near rectangle and light leaves the viewport lit. Regions are inward
planes, slightly widened, in any caster's own frame.

Sources: McGuire et al. 2003, section 5.2 and figure 2; docs/papers.md, M6.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.kernels import cross, dot, inlined, kernel
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


@kernel
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
    forward = camera.axes()[2].copy()  # which may be written to, as in _write_many: one type
    _write_view(corners, eye, forward, camera.is_perspective, planes)
    return planes


@kernel
def _write_view(corners, eye, forward, is_perspective, planes):
    """Write the planes of ``find_view_planes``."""
    way = forward[0], forward[1], forward[2]
    _write_plane(way, -dot(way, corners[0]), planes[0])
    for side in range(4):
        here = corners[side]
        ray = _subtract(here, eye) if is_perspective else way
        # Corners run counter-clockwise seen from the eye, so ray x edge points outward.
        normal = cross(_subtract(corners[(side + 1) % 4], here), ray)
        normal = _divide(normal, np.sqrt(dot(normal, normal)))
        _write_plane(normal, -dot(normal, here), planes[1 + side])


@inlined
def _subtract(p, q):
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


@inlined
def _divide(p, length):
    return p[0] / length, p[1] / length, p[2] / length


@inlined
def _write_plane(normal, offset, plane):
    plane[0], plane[1], plane[2], plane[3] = normal[0], normal[1], normal[2], offset


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


@kernel
def _write_pyramid(corners, forward, light, planes):
    """Write the planes of ``occlusion_pyramid``; return their number."""
    to_light, edges = np.zeros((4, 3)), np.zeros((4, 3))
    reach = size = 0.0
    for side in range(4):
        for axis in range(3):
            to_light[side, axis] = light[axis] - light[3] * corners[side, axis]
            edges[side, axis] = corners[(side + 1) % 4, axis] - corners[side, axis]
            reach = max(reach, abs(to_light[side, axis]))
            size = max(size, abs(edges[side, axis]))
    way = forward[0], forward[1], forward[2]
    back = -way[0], -way[1], -way[2]
    rise = dot(way, to_light[0])
    limit = 1e-9 * max(reach, size) if light[3] != 0.0 else 1e-12 * reach
    is_off = abs(rise) > limit  # the light is not in the near plane
    _write_plane(way if rise > 0.0 or not is_off else back, 0.0, planes[0])
    n = 1
    if not is_off:
        _write_plane(back, 0.0, planes[1])
        n = 2
    a, b, c, d = corners[0], corners[1], corners[2], corners[3]
    middle = (
        (a[0] + b[0] + c[0] + d[0]) / 4.0,
        (a[1] + b[1] + c[1] + d[1]) / 4.0,
        (a[2] + b[2] + c[2] + d[2]) / 4.0,
    )
    for side in range(4):
        normal = cross(edges[side], to_light[side] if is_off else forward)
        length = np.sqrt(dot(normal, normal))
        if length > 1e-12 * size * (reach if is_off else 1.0):
            inside = dot(normal, _subtract(middle, corners[side]))
            _write_plane(_divide(normal, -length if inside < 0.0 else length), 0.0, planes[n])
            n += 1

    # A plane is valid if all points of the pyramid are inside: move it until they are, and leave it
    # out if a directional light crosses it outward.
    m = 0
    for k in range(n):
        normal = planes[k, 0], planes[k, 1], planes[k, 2]
        lowest = np.inf
        for corner in range(4):
            lowest = min(lowest, dot(normal, corners[corner]))
        toward = dot(normal, light)
        if light[3] != 0.0:
            lowest = min(lowest, toward / light[3])
        elif toward < -1e-12 * reach:
            continue
        _write_plane(normal, -lowest, planes[m])
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


@kernel
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
        for side in range(used, pyramids.shape[1]):
            _write_plane((0.0, 0.0, 0.0), 1.0, pyramids[k, side])
        size = 0.0
        for corner in range(4):
            for axis in range(3):
                size = max(size, abs(corners[corner, axis]))
        for side in range(pyramids.shape[1]):
            pyramids[k, side, 3] += margin * size
        for side in range(views.shape[1]):
            views[k, side, 3] += margin * size
