"""
Handles of lights in the picture: position, picking and dragging.

The sun is shown on a dome about the target that always fits the picture. By clock it moves
along its day's path; otherwise anywhere on the dome, like other directional lights. A lamp
is dragged in the plane of the view, or at constant height.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.rays.depth import rasterise_depth
from umbra.scene import Camera, Scene
from umbra.window.daylight import find_day
from umbra.window.view_state import SUN, Viewpoint, ViewState

__all__ = [
    "GRIP",
    "Handle",
    "drag",
    "find_dome",
    "find_handles",
    "find_part",
    "find_path",
    "pick",
    "place_lamp",
    "project",
]

Pixel = tuple[float, float]

_DOME = 0.8  # of half the picture's height
_LAMP_LEAST = 0.08  # of the picture's height, from its top
GRIP = 14.0
"""How far from its middle a handle is held [pixels]."""

_TIME_COST = 0.03  # [pixels per minute], to stay on one branch where the path crosses itself
_PINHOLE = 0.01  # [degrees]: a view of one pixel
_FLATTEST = 0.02  # a flatter ray meets the lamp's level too far away


@dataclass(frozen=True)
class Handle:
    """Draggable handle of a light: its number, pixel and position in the model (3,) [m]."""

    number: int
    at: Pixel
    place: NDArray[np.float64]


def project(camera: Camera, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Project points (n, 3) to pixels (n, 2), columns and rows; NaN behind the eye."""
    matrix = camera.matrix(camera.eye)
    x, y, weight, _ = matrix @ np.column_stack([places - camera.eye, np.ones(len(places))]).T
    ahead = weight > camera.near
    pixels = np.full((len(places), 2), np.nan)
    pixels[ahead] = np.stack([x[ahead], y[ahead]], 1) / weight[ahead, None]
    return pixels


def find_dome(viewpoint: Viewpoint) -> tuple[NDArray[np.float64], float]:
    """Return the centre (3,) and the radius [m] of the sun's dome."""
    radius = _DOME * viewpoint.distance * np.sin(np.radians(viewpoint.fov) / 2)
    return np.array(viewpoint.target), float(radius)


def find_path(view: ViewState) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """
    Find the sun's path of the day on the dome: minutes since midnight (n,), points (n, 3).

    Only points where the sun is up.
    """
    if not view.sun.has_clock or view.sun.site is None:
        return None
    minutes, path = find_day(view.sun.site, view.sun.date)
    middle, radius = find_dome(view.viewpoint)
    return minutes[path.is_up], middle + radius * path.direction[path.is_up]


def find_handles(view: ViewState, size: tuple[int, int]) -> list[Handle]:
    """Find the handles inside a picture of this size."""
    numbers, places = [], []
    if view.sun.is_up:
        middle, radius = find_dome(view.viewpoint)
        numbers.append(SUN)
        places.append(middle + radius * view.sun.direction())
    for number, light in enumerate(view.lights):
        numbers.append(number)
        if light.is_point:
            places.append(light.position[:3])
        else:
            middle, radius = find_dome(view.viewpoint)
            toward = light.position[:3] / np.linalg.norm(light.position[:3])
            places.append(middle + radius * toward)
    if not places:
        return []
    pixels = project(view.viewpoint.camera(size), np.array(places))
    return [
        Handle(number, (float(x), float(y)), position)
        for number, (x, y), position in zip(numbers, pixels, places, strict=True)
        if -GRIP < x < size[0] + GRIP and -GRIP < y < size[1] + GRIP
    ]


def pick(handles: list[Handle], at: Pixel, grip: float = GRIP) -> Handle | None:
    """Find the handle at a pixel."""
    near = [(np.hypot(h.at[0] - at[0], h.at[1] - at[1]), n) for n, h in enumerate(handles)]
    reached = [entry for entry in near if entry[0] <= grip]
    return handles[min(reached)[1]] if reached else None


def find_part(scene: Scene, camera: Camera, at: Pixel) -> int | None:
    """Find the part visible at a pixel, or None."""
    soup = scene.triangles()
    ray = _find_ray(camera, at)
    look = replace(camera, target=camera.eye + ray, up=camera.axes()[1], size=(1, 1), fov=_PINHOLE)
    matrix, limits = look.matrix(scene.origin), look.key_range()
    face = int(rasterise_depth(soup.vertices, soup.faces, matrix, (1, 1), limits).face[0, 0])
    return int(soup.part[face]) if face >= 0 else None


def place_lamp(
    view: ViewState, bounds: NDArray[np.float64], size: tuple[int, int]
) -> NDArray[np.float64]:
    """Find a position for a new lamp: above the model, in the picture, next to earlier ones."""
    low, high = bounds
    length = float(np.linalg.norm(high - low))
    foot = np.array(view.viewpoint.target)
    foot += 0.12 * length * len(view.lights) * view.viewpoint.axes()[0]
    camera = view.viewpoint.camera(size)
    for lift in np.linspace(high[2] + 0.25 * length - foot[2], 0.0, 12):
        position = foot + np.array([0.0, 0.0, lift])
        ((x, y),) = project(camera, position[None])
        if 0 < x < size[0] and _LAMP_LEAST * size[1] < y < size[1]:
            break
    return position


def drag(
    view: ViewState, number: int, at: Pixel, size: tuple[int, int], *, level: bool
) -> ViewState:
    """
    Drag the handle of a light, or of ``SUN``, to a pixel.

    With ``level`` a lamp keeps its height, rather than its distance from the view.
    """
    camera = view.viewpoint.camera(size)
    ray = _find_ray(camera, at)
    if number == SUN:
        return _drag_sun(view, camera, ray, at)
    light = view.lights[number]
    if not light.is_point:
        toward = _find_on_dome(view, camera, ray, light.position[:3])
        return view.change_light(number, replace(light, position=np.append(toward, 0.0)))
    position = light.position[:3]
    depth = float((position - camera.eye) @ camera.axes()[2])
    if level:
        height = position[2] - camera.eye[2]
        if abs(ray[2]) < _FLATTEST or height / ray[2] <= 0:
            return view
        depth = height / ray[2]
    return view.move_light(number, camera.eye + depth * ray)


def _drag_sun(view: ViewState, camera: Camera, ray: NDArray[np.float64], at: Pixel) -> ViewState:
    path = find_path(view)
    if path is not None:
        minutes, places = path
        if not len(minutes):
            return view
        apart = np.hypot(*(project(camera, places) - at).T)
        apart += _TIME_COST * np.abs(minutes - view.sun.minutes)
        if np.isnan(apart).all():
            return view
        return replace(view, sun=replace(view.sun, minutes=float(minutes[np.nanargmin(apart)])))
    best = _find_on_dome(view, camera, ray, view.sun.direction())
    return replace(view, sun=view.sun.point_at(best))


def _find_on_dome(
    view: ViewState, camera: Camera, ray: NDArray[np.float64], now: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Find where a ray meets the dome, on the same side as before; (3,) from its centre [m]."""
    middle, radius = find_dome(view.viewpoint)
    unit = ray / np.linalg.norm(ray)
    way = middle - camera.eye
    along = float(way @ unit)
    aside = way - along * unit  # from the ray's nearest point to the centre
    inside = radius**2 - float(aside @ aside)
    half = np.sqrt(max(inside, 0.0))
    crossings = [-aside - half * unit, -aside + half * unit]
    return max(crossings, key=lambda d: (d[2] > 0, float(d @ now)))


def _find_ray(camera: Camera, at: Pixel) -> NDArray[np.float64]:
    """Return the ray of a pixel, (3,) float64, of depth 1 m along the view axis."""
    right, up, forward = camera.axes()
    cols, rows = camera.size
    pixel = 2 * np.tan(np.radians(camera.fov) / 2) / rows
    return forward + pixel * ((at[0] - (cols - 1) / 2) * right + ((rows - 1) / 2 - at[1]) * up)
