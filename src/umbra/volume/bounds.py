"""
Culling for a frame: casters out of the light's range, volumes out of view.

All tests are conservative: culled parts cannot change the picture. Regions are inward planes (a, b,
c, d), a point x being inside where a x + b y + c z + d w is not negative in any; shapes are convex
hulls of homogeneous points, (direction, 0) being infinitely far. So volumes may end at infinity or
on a floor. Rectangles of pixels are (left, top, right, bottom), right and bottom exclusive; row 0
is the top.

Source: McGuire et al. 2003, sections 5 and 6.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.kernels import copy_rows, kernel
from umbra.scene.camera import Camera
from umbra.volume.regions import find_view_planes

__all__ = [
    "VisibleParts",
    "can_box_end",
    "find_box_distance",
    "find_box_parts",
    "find_box_points",
    "find_far_plane",
    "find_shadow_points",
    "find_span",
    "find_visible_parts",
    "is_beyond_any",
    "is_outside",
    "is_seen",
    "move_boxes",
    "throw_box",
]

_CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])


def find_box_points(bounds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of boxes (n, 2, 3), homogeneous (n, 8, 4); x changes fastest."""
    bounds = np.asarray(bounds, np.float64)
    points = np.ones((len(bounds), 8, 4))
    points[..., :3] = bounds[:, _CORNERS, [0, 1, 2]]
    return points


def move_boxes(transforms: NDArray[np.float64], bounds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the bounds (n, m, 2, 3) of boxes (m, 2, 3) under affine transforms (n, 4, 4)."""
    middle, half = bounds.mean(1), np.ptp(bounds, axis=1) / 2.0
    linear = transforms[:, None, :3, :3]
    middle = (linear @ middle[..., None])[..., 0] + transforms[:, None, :3, 3]
    half = (np.abs(linear) @ half[..., None])[..., 0]
    return np.stack([middle - half, middle + half], 2)


def is_outside(planes: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """
    Return whether shapes lie wholly beyond one of a region's planes, (n,) bool.

    True means certainly outside; False that the shape may reach inside. ``planes`` (k, 4) are
    inward, ``points`` (n, m, 4) span each shape, homogeneous with w >= 0.
    """
    values = points @ planes.T
    # Of a shape that reaches infinity only the finite points must be strictly beyond.
    beyond = np.where(points[..., 3:] > 0, values < 0, values <= 0)
    return np.asarray(beyond.all(1).any(-1))


def find_span(
    planes: NDArray[np.float64], bounds: NDArray[np.float64], along: NDArray[np.float64]
) -> tuple[float, float]:
    """
    Find how far boxes (n, 2, 3) reach along a vector (3,), but those beyond a region's planes.

    Returns the lowest and highest product with the vector; infinite if no box is left.
    """
    low, high = _find_span(np.ascontiguousarray(planes), bounds, along)
    return float(low), float(high)


@kernel
def is_beyond_any(planes, box):
    """Return whether a box lies wholly beyond any plane."""
    for k in range(planes.shape[0]):
        highest = planes[k, 3]
        for axis in range(3):
            highest += max(planes[k, axis] * box[0, axis], planes[k, axis] * box[1, axis])
        if highest < 0.0:
            return True
    return False


@kernel
def _find_span(planes, bounds, along):
    lowest, highest = np.inf, -np.inf
    for i in range(bounds.shape[0]):
        if not is_beyond_any(planes, bounds[i]):
            low = high = 0.0
            for axis in range(3):
                a, b = along[axis] * bounds[i, 0, axis], along[axis] * bounds[i, 1, axis]
                low += min(a, b)
                high += max(a, b)
            lowest, highest = min(lowest, low), max(highest, high)
    return lowest, highest


def find_shadow_points(
    bounds: NDArray[np.float64],
    light: ArrayLike,
    floor: float | None = None,
    reach: float = np.inf,
) -> NDArray[np.float64]:
    """
    Find points (n, 16, 4) whose hull contains the shadow volume of each box (n, 2, 3).

    The box's corners, then their projection from the light (4,): to infinity (w = 0), the floor or
    the light's reach [m], whichever is nearest. No receiver lies below the floor's z, so a volume
    may be cut there; with z-fail, or with a receiver in the floor itself, choose a floor slightly
    below the lowest receiver. Boxes that reach up to the light ignore it.
    """
    bounds, light = np.asarray(bounds, np.float64), np.asarray(light, np.float64)
    points = np.zeros((len(bounds), 16, 4))
    for box, shape in zip(bounds, points, strict=True):
        throw_box(box, light, np.nan if floor is None else float(floor), float(reach), shape)
    return points


@kernel
def can_box_end(box, light):
    """Return whether a box (2, 3) lies wholly below a light (4,): its volume meets every floor."""
    size = np.sqrt(light[0] ** 2 + light[1] ** 2 + light[2] ** 2)
    # Almost horizontal light projects corners farther than float32 can resolve.
    level = 1e-4 * (size if light[3] == 0.0 else abs(box[1, 2]))
    return light[2] - light[3] * box[1, 2] > level


@kernel
def find_box_distance(box, light):
    """Return the distance of a box from a light; 0 for a directional light."""
    square = 0.0
    if light[3] != 0.0:
        for axis in range(3):
            coordinate = light[axis] / light[3]
            square += max(box[0, axis] - coordinate, coordinate - box[1, axis], 0.0) ** 2
    return np.sqrt(square)


@kernel
def throw_box(box, light, floor, reach, points):
    """Write the points of ``find_shadow_points`` for one box (16, 4); NaN means no floor."""
    for k in range(8):
        for axis in range(3):
            points[k, axis] = box[k >> axis & 1, axis]
            points[8 + k, axis] = light[3] * points[k, axis] - light[axis]
        points[k, 3], points[8 + k, 3] = 1.0, 0.0
    is_below = True
    distance = find_box_distance(box, light)
    if light[3] != 0.0 and np.isfinite(reach) and distance > 1e-6 * reach:
        # On a ray, the point at the reach is at most reach / distance times as far as the box's.
        times = max(reach / distance, 1.0)
        is_below = False
        for k in range(8):
            for axis in range(3):
                coordinate = light[axis] / light[3]
                points[8 + k, axis] = coordinate + times * (points[k, axis] - coordinate)
            points[8 + k, 3] = 1.0
            is_below |= points[8 + k, 2] < floor
    # One kind of end for all corners: the hull of mixed ends could miss part of the volume.
    if is_below and not np.isnan(floor) and can_box_end(box, light):
        for k in range(8):
            drop = max(points[k, 2] - floor, 0.0) / (light[3] * points[k, 2] - light[2])
            for axis in range(3):
                away = light[3] * points[k, axis] - light[axis]
                points[8 + k, axis] = points[k, axis] - drop * away
            points[8 + k, 3] = 1.0


@kernel
def _is_beyond(plane, points):
    """Return whether a shape lies wholly beyond a plane, as ``is_outside``."""
    for k in range(points.shape[0]):
        value = plane[3] * points[k, 3]
        for axis in range(3):
            value += plane[axis] * points[k, axis]
        if value > 0.0 or (value == 0.0 and points[k, 3] > 0.0):
            return False
    return True


@kernel
def is_seen(box, light, planes, floor, reach, points):
    """
    Return whether a box (2, 3) is in range and its shadow volume beyond none of planes (k, 4).

    The box itself is tested first, and projected only if it is beyond a plane, which is rare.
    ``points`` (16, 4) is scratch; other parameters as in ``find_visible_parts``.
    """
    if find_box_distance(box, light) > reach:
        return False
    is_thrown = False
    for k in range(planes.shape[0]):
        highest = planes[k, 3]
        for axis in range(3):
            highest += max(planes[k, axis] * box[0, axis], planes[k, axis] * box[1, axis])
        if highest >= 0.0:
            continue
        if not is_thrown:
            throw_box(box, light, floor, reach, points)
            is_thrown = True
        if _is_beyond(planes[k], points[8:]):
            return False
    return True


@kernel
def find_box_parts(box, light, planes, far, floor, reach, scratch):
    """
    Return whether the volume, the light cap and the dark cap of a box (2, 3) may be in view.

    ``scratch`` is (40, 4); other parameters as in ``find_visible_parts``.
    """
    points, ends, feet = scratch[:16], scratch[16:32], scratch[32:]
    if not is_seen(box, light, planes, floor, reach, points):
        return False, False, False
    if not is_seen(box, light, far, floor, reach, points):
        return False, False, False
    for k in range(8):
        for axis in range(3):
            points[k, axis] = box[k >> axis & 1, axis]
        points[k, 3] = 1.0
    # The part of the box below the floor is not projected: without its section at the floor the
    # hull would miss the projection from just above it.
    throw_box(box, light, floor, np.inf, ends)
    is_cut = ends[8, 3] > 0.0
    starts_below = is_cut and box[0, 2] < floor
    copy_rows(points[:8] if starts_below else ends[8:], feet)
    for k in range(8 if starts_below else 0):
        feet[k, 2] = min(feet[k, 2], floor)
    light_cap = True
    dark_cap = is_cut or light[3] != 0.0  # at infinity it is a single point
    for number in range(planes.shape[0]):
        plane = planes[number]
        light_cap = light_cap and not _is_beyond(plane, points[:8])
        dark_cap = dark_cap and not (_is_beyond(plane, ends[8:]) and _is_beyond(plane, feet))
    return True, light_cap, dark_cap


@kernel
def _find_parts(bounds, light, planes, far, floor, reach, parts):
    """Write the parts of each box that may be in view."""
    scratch = np.zeros((40, 4))
    for i in range(bounds.shape[0]):
        box_parts = find_box_parts(bounds[i], light, planes, far, floor, reach, scratch)
        parts[0, i], parts[1, i], parts[2, i] = box_parts


@dataclass(frozen=True, eq=False)
class VisibleParts:
    """
    Visibility of the parts of shadow volumes, (n,) bool each; True if in doubt.

    If the ``volume`` is out of view, so are all parts. Sides are in view with it.
    """

    volume: NDArray[np.bool_]
    light_cap: NDArray[np.bool_]
    dark_cap: NDArray[np.bool_]


def find_visible_parts(
    bounds: NDArray[np.float64],
    light: ArrayLike,
    camera: Camera,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    *,
    scissor: ArrayLike | None = None,
    floor: float | None = None,
    reach: float = np.inf,
) -> VisibleParts:
    """
    Find the parts of casters' (n, 2, 3) shadow volumes in view and in the light's range.

    Bounds, light (4,) and floor are relative to the origin [m]. The scissor (left, top, right,
    bottom) [pixels] is the whole picture by default; volumes are cut at the floor's z, below all
    receivers; ``reach`` is the light's range.
    """
    bounds, light = np.asarray(bounds, np.float64), np.asarray(light, np.float64)
    planes = find_view_planes(camera, origin, scissor)
    far = find_far_plane(camera, planes)[None]
    parts = np.zeros((3, len(bounds)), np.bool_)
    end = np.nan if floor is None else float(floor)
    _find_parts(bounds, light, planes, far, end, float(reach), parts)
    return VisibleParts(*parts)


def find_far_plane(camera: Camera, planes: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Find the inward far plane (4,) that belongs to the planes of a view.

    No visible point is beyond it, but z-fail counts faces there. Without a far plane everything is
    inside.
    """
    if np.isinf(camera.far):
        return np.array([0.0, 0.0, 0.0, 1.0])
    return np.append(-planes[0, :3], camera.far - camera.near - planes[0, 3])
