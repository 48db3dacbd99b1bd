"""
Pixels and depths that a light can change: scissor rectangles and depth bounds.

Rectangles of pixels are (left, top, right, bottom), right and bottom exclusive; row 0 is the top.
They contain every pixel that a shape touches, slightly widened.

Sources: McGuire et al. 2003, section 5.1 and "Depth Bounds"; docs/papers.md, M4.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError
from umbra.scene.camera import Camera
from umbra.volume.bounds import find_box_points
from umbra.volume.regions import find_view_planes

__all__ = [
    "DepthBounds",
    "find_box_scissors",
    "find_cone_planes",
    "find_cone_scissor",
    "find_depth_bounds",
    "find_depths",
    "find_sphere_depths",
    "find_sphere_scissors",
    "find_window_depths",
]

_EDGES = np.array([(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit])
_SLACK = 1e-3  # pixels by which scissors are widened, for devices that compute in float32


def find_box_scissors(
    camera: Camera, bounds: NDArray[np.float64], origin: ArrayLike = (0.0, 0.0, 0.0)
) -> NDArray[np.int64]:
    """
    Find the pixels in which boxes (n, 2, 3), relative to the origin [m], are visible.

    Boxes are first clipped at the near plane, so the rectangles stay tight. Returns (n, 4) int64:
    left, top, right, bottom; all 0 where nothing is seen.
    """
    points = find_box_points(bounds)
    ahead = points @ find_view_planes(camera, origin)[0]
    start, end = points[:, _EDGES[:, 0]], points[:, _EDGES[:, 1]]
    from_near, to_near = ahead[:, _EDGES[:, 0]], ahead[:, _EDGES[:, 1]]
    cut = (from_near < 0) != (to_near < 0)
    along = np.divide(from_near, from_near - to_near, out=np.zeros_like(from_near), where=cut)
    points = np.concatenate([points, start + along[..., None] * (end - start)], 1)
    seen = np.concatenate([ahead >= 0, cut], 1)
    x, y, w, _ = np.moveaxis(points @ camera.matrix(origin).T, 2, 0)
    w = np.where(seen, w, 1.0)
    spans = [
        (np.where(seen, v / w, np.inf).min(1), np.where(seen, v / w, -np.inf).max(1))
        for v in (x, y)
    ]
    return _make_scissors(camera, spans[0], spans[1], np.asarray(seen.any(1)))


def find_sphere_scissors(
    camera: Camera,
    centres: NDArray[np.float64],
    radii: ArrayLike,
    origin: ArrayLike = (0.0, 0.0, 0.0),
) -> NDArray[np.int64]:
    """
    Find the pixels in which spheres, e.g. lights' ranges, are visible; as ``find_box_scissors``.

    Along each axis of the picture a sphere is a disc: its ends are tangent rays, or its
    intersections with the near plane. Centres (n, 3) are relative to the origin, radii (n,) may be
    infinite [m].
    """
    centres = np.asarray(centres, np.float64).reshape(-1, 3)
    radii = np.broadcast_to(np.asarray(radii, np.float64), len(centres))
    endless = ~np.isfinite(radii)
    radius = np.where(endless, 0.0, radii)
    right, up, forward = camera.axes()
    apart = centres - (camera.eye - np.asarray(origin, np.float64))
    depth = apart @ forward
    short = camera.near - depth  # of the near plane
    chord = np.sqrt(np.maximum(radius**2 - short**2, 0.0))
    rows = camera.size[1]
    height = camera.height or 2.0 * np.tan(np.radians(camera.fov) / 2.0)
    spans = []
    ways = ((right, 1.0, height * camera.stretch), (up, -1.0, height))
    for (axis, sign, height), middle in zip(ways, camera.center, strict=True):
        across = sign * (apart @ axis)
        low, high = across - chord, across + chord
        if camera.height is None:
            low, high = low / camera.near, high / camera.near
            square = across**2 + depth**2
            tangent = np.sqrt(np.maximum(square - radius**2, 0.0))
            square = np.where(square > 0, square, 1.0)
            is_cut = np.abs(short) <= radius
            low, high = np.where(is_cut, low, np.inf), np.where(is_cut, high, -np.inf)
            for turn in (-1.0, 1.0):
                x = tangent * (tangent * across + turn * radius * depth) / square
                z = tangent * (tangent * depth - turn * radius * across) / square
                touches = (tangent > 0) & (z >= camera.near)
                slope = x / np.where(touches, z, 1.0)
                low = np.minimum(low, np.where(touches, slope, np.inf))
                high = np.maximum(high, np.where(touches, slope, -np.inf))
        else:
            whole = short <= 0
            low, high = (
                np.where(whole, across - radius, low),
                np.where(whole, across + radius, high),
            )
        pixels = [np.where(endless, end, v) for end, v in ((-np.inf, low), (np.inf, high))]
        low, high = (v * rows / height + middle for v in pixels)
        spans.append((low, high))
    return _make_scissors(camera, spans[0], spans[1], endless | (short <= radius))


_SIDES = 16  # sides of the pyramid around a cone
_WIDER = 1e-6  # widening of a cone's cosine, for devices that compute in float32

_AHEAD = 1e-6  # margin by which an end at infinity is in front of the eye


def _make_pyramid(
    axis: NDArray[np.float64], half_angle: float
) -> tuple[float, NDArray[np.float64]] | None:
    """Return the widened half angle and directions (16, 3) around the axis; None from 90° on."""
    angle = np.arccos(max(np.cos(np.radians(half_angle)) - _WIDER, -1.0))
    if angle >= np.radians(89.0):
        return None
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    turn = 2.0 * np.pi / _SIDES * np.arange(_SIDES)[:, None]
    return float(angle), np.cos(turn) * across + np.sin(turn) * np.cross(axis, across)


def find_cone_planes(
    apex: NDArray[np.float64], axis: NDArray[np.float64], half_angle: float
) -> NDArray[np.float64] | None:
    """
    Find inward planes (16, 4) around a cone with an apex and a unit axis.

    None if the half angle [degrees] is too wide.
    """
    pyramid = _make_pyramid(axis, half_angle)
    if pyramid is None:
        return None
    angle, around = pyramid
    normals = np.sin(angle) * axis - np.cos(angle) * around
    return np.column_stack([normals, -(normals @ apex)])


def find_cone_scissor(
    camera: Camera,
    apex: NDArray[np.float64],
    axis: NDArray[np.float64],
    half_angle: float,
    reach: float = np.inf,
    origin: ArrayLike = (0.0, 0.0, 0.0),
) -> NDArray[np.int64]:
    """
    Find the pixels in which a cone, e.g. of a spot light, is visible, up to its reach [m].

    Parameters as in ``find_cone_planes``. Returns (4,) int64, as ``find_box_scissors`` does; the
    whole picture if the cone is too wide or its end has no projection.
    """
    whole = np.array([0, 0, *camera.size], np.int64)
    pyramid = _make_pyramid(axis, half_angle)
    if pyramid is None or (np.isinf(reach) and camera.height is not None):
        return whole
    angle, around = pyramid
    rim = axis + np.tan(angle) / np.cos(np.pi / _SIDES) * around
    is_endless = bool(np.isinf(reach))
    points = np.ones((_SIDES + 1, 4))
    points[0, :3] = apex
    points[1:, :3] = rim if is_endless else apex + reach * rim
    points[1:, 3] = 0.0 if is_endless else 1.0
    ahead = points @ find_view_planes(camera, origin)[0]
    if is_endless and (ahead[1:] < _AHEAD).any():
        return whole
    # Segments between all pairs of points, clipped at the near plane, contain the hull's edges.
    start, end = (k.ravel() for k in np.indices((len(points), len(points))))
    cut = (ahead[start] < 0) & (ahead[end] >= 0)
    start, end = start[cut], end[cut]
    along = ahead[start] / (ahead[start] - ahead[end])
    cuts = points[start] + along[:, None] * (points[end] - points[start])
    x, y, w, _ = (np.concatenate([points[ahead >= 0], cuts]) @ camera.matrix(origin).T).T
    if not len(w):
        return np.zeros(4, np.int64)
    spans = [(np.array([(v / w).min()]), np.array([(v / w).max()])) for v in (x, y)]
    return _make_scissors(camera, spans[0], spans[1], np.ones(1, np.bool_))[0]


def _make_scissors(
    camera: Camera,
    x: tuple[NDArray[np.float64], NDArray[np.float64]],
    y: tuple[NDArray[np.float64], NDArray[np.float64]],
    seen: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """Return the pixels that spans of the picture touch; empty where nothing is visible."""
    sides = []
    for (low, high), size in zip((x, y), camera.size, strict=True):
        first = np.floor(np.clip(low + 0.5 - _SLACK, 0, size))
        last = np.floor(np.clip(high + 0.5 + _SLACK, -1, size - 1)) + 1
        sides.append((first, last))
    (left, right), (top, bottom) = sides
    scissors = np.stack([left, top, right, bottom], 1).astype(np.int64)
    scissors[~seen | (left >= right) | (top >= bottom)] = 0
    return scissors


def find_depths(
    camera: Camera, points: NDArray[np.float64], origin: ArrayLike = (0.0, 0.0, 0.0)
) -> NDArray[np.float64]:
    """
    Find the nearest and farthest depth of shapes along the view axis, (n, 2) [m].

    ``points`` (n, m, 4) span each shape: homogeneous with w = 0 or 1, relative to the origin.
    Infinite for infinite shapes.
    """
    near = find_view_planes(camera, origin)[0]
    depths = points @ near + camera.near * points[..., 3]
    finite = points[..., 3] > 0
    ends = np.where(depths > 0, np.inf, np.where(depths < 0, -np.inf, np.nan))
    depths = np.where(finite, depths, ends)
    return np.stack([np.nanmin(depths, 1), np.nanmax(depths, 1)], 1)


def find_sphere_depths(
    camera: Camera,
    centres: NDArray[np.float64],
    radii: ArrayLike,
    origin: ArrayLike = (0.0, 0.0, 0.0),
) -> NDArray[np.float64]:
    """Find the nearest and farthest depth of spheres (n, 3), (n,), (n, 2) [m]."""
    apart = np.asarray(centres, np.float64).reshape(-1, 3) - camera.eye + np.asarray(origin)
    depth = apart @ camera.axes()[2]
    return np.stack([depth - radii, depth + radii], 1)


def find_window_depths(camera: Camera, depths: ArrayLike) -> NDArray[np.float64]:
    """
    Turn distances along the view axis into window depths, (z/w + 1) / 2.

    0 is the near plane, 1 the far plane, which may be infinite in perspective; there distances must
    be above 0. `InputError` if an orthographic camera has no finite far plane.
    """
    depths = np.asarray(depths, np.float64)
    near, far = camera.near, camera.far
    if camera.height is not None:
        if not np.isfinite(far):
            msg = "an orthographic view has no window depths without a finite far plane"
            raise InputError(msg)
        return np.asarray((depths - near) / (far - near))
    # 1 / (1 - near / far) is 1 for an infinite far plane.
    return np.asarray((1.0 - near / depths) / (1.0 - near / far))


@dataclass(frozen=True, eq=False)
class DepthBounds:
    """
    Range of window depths in which pixels can be in shadow.

    ``bounds`` (n, 2) are lowest and highest, in 0 to 1; (0, 1) where ``is_empty``: then draw
    nothing. Never pass empty bounds to OpenGL: lowest above highest is an error that keeps the old
    bounds.
    """

    bounds: NDArray[np.float64]
    is_empty: NDArray[np.bool_]


def find_depth_bounds(
    camera: Camera, depths: NDArray[np.float64], widen: float = 2.0**-23
) -> DepthBounds:
    """
    Find the depth bounds of shapes, clipped at the near and far planes.

    Depths (n, 2) come from ``find_depths`` or ``find_sphere_depths`` [m]. Both ends are widened, by
    default by two steps of a 24-bit depth buffer: one for its rounding, one for the device's
    float32.
    """
    depths = np.asarray(depths, np.float64).reshape(-1, 2)
    is_empty = (depths[:, 1] < camera.near) | (depths[:, 0] > camera.far)
    window = find_window_depths(camera, np.clip(depths, camera.near, camera.far))
    bounds = np.clip(window + [-widen, widen], 0.0, 1.0)
    bounds[is_empty] = 0.0, 1.0
    return DepthBounds(bounds, is_empty)
