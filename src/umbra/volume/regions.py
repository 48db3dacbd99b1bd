"""
Regions of a camera and a light: the view, and the occlusion pyramid.

A caster that leaves the hull of near rectangle and light free leaves the viewport lit.
Regions are inward planes, widened a little, in any caster's own frame.

Sources: McGuire et al. 2003, section 5.2 and figure 2; docs/papers.md, M6.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.scene.camera import Camera

__all__ = [
    "Regions",
    "find_near_rectangle",
    "find_view_planes",
    "make_regions",
    "occlusion_pyramid",
]


def find_near_rectangle(
    camera: Camera, origin: ArrayLike = (0.0, 0.0, 0.0), scissor: ArrayLike | None = None
) -> NDArray[np.float64]:
    """
    Find where the picture, or a scissor's part of it, lies in the near plane.

    Returns (4, 3) float64: top left, bottom left, bottom right, top right, relative to the origin
    [m]. A scissor is left, top, right, bottom [pixels].
    """
    cols, rows = camera.size
    left, top, right, bottom = (0, 0, cols, rows) if scissor is None else np.asarray(scissor)
    across, up, forward = camera.axes()
    if camera.height is None:
        pixel = camera.near * 2.0 * np.tan(np.radians(camera.fov) / 2.0) / rows
    else:
        pixel = camera.height / rows
    # Corners of pixels, whose centres are whole numbers in the picture.
    x = pixel * (np.array([left, left, right, right]) - 0.5 - camera.center[0])
    y = pixel * (camera.center[1] + 0.5 - np.array([top, bottom, bottom, top]))
    middle = camera.eye - np.asarray(origin, np.float64) + camera.near * forward
    return middle + x[:, None] * across + y[:, None] * up


def find_view_planes(
    camera: Camera, origin: ArrayLike = (0.0, 0.0, 0.0), scissor: ArrayLike | None = None
) -> NDArray[np.float64]:
    """
    Find the planes of the view through the picture, or through a scissor's part of it.

    Returns (5, 4) float64: near, left, bottom, right, top; inward, with unit normals, for points
    relative to the origin. There is no far plane: with depth clamping, z-fail needs volumes to
    infinity.
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


MARGIN = 1e-6
"""By how much regions are widened, relative to the near rectangle's coordinates."""


@dataclass(frozen=True, eq=False)
class Regions:
    """
    Planes shared by all placements of one camera and one light.

    ``pyramid`` (n, 4) and ``view`` (5, 4) are inward planes, a little widened, of the occlusion
    pyramid and of the view, to infinity; ``light`` (4,) is in their frame.
    """

    pyramid: NDArray[np.float64]
    view: NDArray[np.float64]
    light: NDArray[np.float64]

    def within(self, transform: NDArray[np.float64]) -> "Regions":
        """Return the regions in a caster's own frame, from which ``transform`` leads here."""
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
    Find the planes (n, 4) around all ways from the near rectangle to a light (4,).

    A directional light gives a prism without end. Each plane holds an edge of the
    rectangle and the homogeneous light; it is turned to the rectangle's centre, the near
    plane to the light. A light in the near plane leaves no volume: there a slab around
    the near plane is returned, so that what touches that plane near the rectangle counts
    as in the way. Planes that rounding might have spoilt are left out or moved outward, so n is
    5, or 2 to 6 for a light in the near plane.
    """
    corners = find_near_rectangle(camera, origin, scissor)
    light = np.asarray(light, np.float64)
    forward = camera.axes()[2]
    to_light = light[:3] - light[3] * corners
    reach = np.abs(to_light).max()
    edges = np.roll(corners, -1, 0) - corners
    size = np.abs(edges).max()
    rise = forward @ to_light[0]
    limit = 1e-9 * max(reach, size) if light[3] else 1e-12 * reach
    if abs(rise) > limit:
        normals = np.cross(edges, to_light)
        near = np.copysign(1.0, rise) * forward[None]
    else:
        normals = np.cross(edges, forward)
        near = np.stack([forward, -forward])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    sound = length[:, 0] > 1e-12 * size * (reach if abs(rise) > limit else 1.0)
    normals = normals[sound] / length[sound]
    inner = np.einsum("ij,ij->i", normals, corners.mean(0) - corners[sound])
    normals *= np.where(inner < 0, -1.0, 1.0)[:, None]

    # A plane is right if all that spans the pyramid is inside: move it until it is, and
    # leave it out if a directional light leads away through it.
    normals = np.concatenate([near, normals])
    spans = np.append(corners, light[None, :3] / light[3], 0) if light[3] else corners
    planes = np.column_stack([normals, -(normals @ spans.T).min(1)])
    if light[3] == 0:
        planes = planes[normals @ light[:3] >= -1e-12 * reach]
    return planes


def make_regions(
    camera: Camera,
    light: ArrayLike,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    scissor: ArrayLike | None = None,
    margin: float = MARGIN,
) -> Regions:
    """
    Find the pyramid and the view of a camera and a light (4,), for many casters.

    The light is relative to the origin [m]; the scissor, left, top, right, bottom [pixels], is the
    part of the picture that is drawn. Planes move outward by the margin times the near rectangle's
    largest coordinate, for devices that compute in float32.
    """
    light = np.asarray(light, np.float64)
    pyramid = occlusion_pyramid(camera, light, origin, scissor)
    view = find_view_planes(camera, origin, scissor)
    slack = margin * np.abs(find_near_rectangle(camera, origin, scissor)).max()
    pyramid[:, 3] += slack
    view[:, 3] += slack
    return Regions(pyramid, view, light)
