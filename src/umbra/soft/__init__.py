"""
Soft shadows: the share of an area light that each visible point sees.

    __init__.py       the lights: evenly bright rectangles, balls, discs in the sky as the sun
    light_samples.py  many hard shadows averaged: the reference
    wedges.py         hard count, corrected along silhouette edges
    complexity.py     casters counted at spots of the light
    parts.py          their kernel: part of the light hidden by an edge
    weng.py           scaled layers of the hard volume, stacked

A method is a function ``(counter, view, frame, camera, light)`` of its module, which
returns (rows, cols) float32: 1 is fully lit, 0 umbra, 1 where nothing is seen. The counter is a
``FrameCounter``, view and frame come from its ``see``, the light is an ``AreaLight``. To add a
method, write the module and list it in `umbra.methods.SOFT` and ``_FUNCTIONS``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError, check_type
from umbra.methods import SOFT
from umbra.packages import load_named
from umbra.scene.large_lights import spread
from umbra.scene.lights import Light
from umbra.scene.numbers import OUTSIDE, check_reach, read_number, read_vector

__all__ = [
    "SUN_RADIUS",
    "AreaLight",
    "ball_light",
    "find_method",
    "find_middles",
    "make_axes",
    "rectangle_light",
    "size_lights",
]

SUN_RADIUS = 0.2665
"""Angular radius of the sun [degrees]."""


_FUNCTIONS = {
    "samples": "umbra.soft.light_samples:find_visibility_by_samples",
    "wedges": "umbra.soft.wedges:find_visibility_by_wedges",
    "complexity": "umbra.soft.complexity:find_visibility_by_complexity",
    "weng": "umbra.soft.weng:find_visibility_by_layers",
}


def find_middles(lights: "Sequence[Light | AreaLight]") -> list[Light]:
    """Return the lights at the centres of area lights."""
    return [light.light if isinstance(light, AreaLight) else light for light in lights]


def find_method(name: str) -> Callable[..., NDArray[np.float32]]:
    """Return a method's function by name, loading only its module; `InputError` if unknown."""
    if name not in SOFT:
        msg = f"there is no method '{name}' for soft shadows; there are {', '.join(SOFT)}"
        raise InputError(msg, method=name)
    method: Callable[..., NDArray[np.float32]] = load_named(_FUNCTIONS[name])
    return method


@dataclass(frozen=True, eq=False)
class AreaLight:
    """
    A light with an extent.

    Made by `ball_light` and `rectangle_light`. A ball appears to every receiver as a uniform disc,
    a rectangle is equally bright on both sides; intensity does not depend on its foreshortening, as
    for a point light.

    Parameters
    ----------
    light : Light
        Light at the centre, with colour, range and so on.
    radius : float
        Radius of the ball [m], tangent of the angular radius of a disc in the sky, or radius of a
        rectangle's bounding sphere [m].
    edges : (2, 3) float64, optional
        Sides of a rectangle, full length [m].
    """

    light: Light
    radius: float
    edges: NDArray[np.float64] | None = None

    def moved(self, by: NDArray[np.float64]) -> "AreaLight":
        """Return the light moved by (3,), in units of its radius."""
        position = self._unit()
        position[:3] += self.radius * np.asarray(by)
        return replace(self, light=replace(self.light, position=position))

    def points(self, n: int) -> list[Light]:
        """
        Return point or directional lights that together sample this light.

        Low-discrepancy and jittered (`umbra.scene.large_lights.spread`), always the same. The
        points of a rectangle lie in it. Points of a ball have the density 1 / sqrt(R² - r²) at the
        distance r from its centre, the only one that projects to a uniform disc in all directions
        (its Abel integral is constant).

        Parameters
        ----------
        n : int

        Returns
        -------
        lights : list of Light
            Each has the full colour: average the n results.
        """
        middle = self._unit()
        if self.edges is not None:
            offsets = (spread(n, 2) - 0.5) @ self.edges
        elif self.light.is_point:
            shares = spread(n, 3)
            away = self.radius * _find_shell(shares[:, 0])
            height, longitude = 2 * shares[:, 1] - 1, 2 * np.pi * shares[:, 2]
            flat = np.sqrt(1 - height**2)
            ways = np.stack([flat * np.cos(longitude), flat * np.sin(longitude), height], 1)
            offsets = away[:, None] * ways
        else:
            shares = spread(n, 2)
            away, longitude = self.radius * np.sqrt(shares[:, 0]), 2 * np.pi * shares[:, 1]
            across = np.stack(make_axes(middle[:3]))
            offsets = away[:, None] * np.stack([np.cos(longitude), np.sin(longitude)], 1) @ across
        places = np.tile(middle, (n, 1))
        places[:, :3] += offsets
        return [replace(self.light, position=position) for position in places]

    def _unit(self) -> NDArray[np.float64]:
        """Return a copy of the centre: a position, or a unit direction."""
        position = self.light.position.copy()
        if not self.light.is_point:
            position[:3] /= np.linalg.norm(position[:3])
        return position


def ball_light(light: Light, radius: float) -> AreaLight:
    """
    Make an area light: a ball, or a disc in the sky.

    Parameters
    ----------
    light : Light
        Light at the centre.
    radius : float
        Radius [m] of a ball; for a directional light the angular radius of the disc [degrees],
        `SUN_RADIUS` for the sun.

    Raises
    ------
    InputError
        If the light is no `Light`, the radius is no number above 0, or a disc in the sky reaches 45
        degrees.
    """
    check_type("light", light, Light)
    radius = read_number("an area light's radius", radius)
    if not 0 < radius < np.inf:
        msg = f"an area light's radius must be above 0; got {radius:g}"
        raise InputError(msg)
    if light.is_point:
        return AreaLight(light, float(radius))
    if radius >= 45:
        msg = f"a directional light's radius is an angle below 45 degrees; got {radius:g}"
        raise InputError(msg)
    return AreaLight(light, float(np.tan(np.radians(radius))))


def size_lights(lights: Sequence[Light], sizes: Sequence[float]) -> list[AreaLight]:
    """
    Make area lights: balls, or discs in the sky.

    Parameters
    ----------
    lights : sequence of Light
    sizes : sequence of float
        None, one for all, or one each: radius [m] or, for a directional light, [degrees].

    Raises
    ------
    InputError
        If the numbers do not match, a point light has no size, or a size is out of range.
    """
    if len(sizes) not in {0, 1, len(lights)}:
        msg = f"light_size= has {len(sizes)} radii for {len(lights)} lights; give one, or one each"
        raise InputError(msg, option="light_size")
    if not sizes and any(light.is_point for light in lights):
        msg = "a light at a place needs its radius for soft shadows; give light_size= [m]"
        raise InputError(msg, option="light_size")
    radii = list(sizes) or [SUN_RADIUS]
    radii *= len(lights) // len(radii)
    return [ball_light(light, radius) for light, radius in zip(lights, radii, strict=True)]


def rectangle_light(light: Light, edge_u: ArrayLike, edge_v: ArrayLike) -> AreaLight:
    """
    Make an area light: a parallelogram.

    Parameters
    ----------
    light : Light
        Light at the centre.
    edge_u, edge_v : (3,) float64
        Sides, full length [m].

    Raises
    ------
    InputError
        If the light is directional, or the sides are not finite or span no area.
    """
    check_type("light", light, Light)
    edges = np.stack([read_vector("a rectangular light's side", side) for side in (edge_u, edge_v)])
    check_reach("a rectangular light's sides", edges, "give them in metres", OUTSIDE)
    if not np.cross(*edges).any():
        msg = "a rectangular light needs two sides that span an area"
        raise InputError(msg)
    if not light.is_point:
        msg = "a directional light is a disc in the sky, not a rectangle; give it a radius"
        raise InputError(msg)
    corners = 0.5 * np.stack([edges[0] + edges[1], edges[0] - edges[1]])
    return AreaLight(light, float(np.linalg.norm(corners, axis=1).max()), edges)


def make_axes(way: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Make unit vectors u, v that form a right-handed basis u, v, way with a unit vector (3,)."""
    least = np.zeros(3)
    least[np.abs(way).argmin()] = 1.0
    u = np.cross(least, way)
    u /= np.linalg.norm(u)
    return u, np.cross(way, u)


def _find_shell(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Find the radius that contains a share of a unit ball's points.

    It solves (2 / pi) (arcsin r - r sqrt(1 - r²)) = share; with r = sin(t / 2) that is
    Kepler's t - sin t = pi share, whose left side grows with t: bisection.
    """
    low, high = np.zeros_like(shares), np.full_like(shares, np.pi)
    for _ in range(52):
        middle = (low + high) / 2
        below = middle - np.sin(middle) < np.pi * shares
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.sin(low / 2)
