"""The light of sky and ground, and how bright lights are in a picture, on every device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.scene.lights import Light
from umbra.scene.scene import Scene

__all__ = [
    "AMBIENT",
    "BOUNCE",
    "DAY",
    "FROM_GROUND",
    "FROM_SKY",
    "GROUND_COLOR",
    "HORIZON",
    "NIGHT",
    "SKY",
    "Sky",
    "choose_sky",
    "expose_lights",
    "find_ambient",
    "find_exposure",
]

GROUND_COLOR = (0.50, 0.50, 0.48)
SKY, HORIZON = (0.42, 0.60, 0.82), (0.86, 0.91, 0.95)
"""Behind everything, at the top and at the foot of a picture, and in mirrors; linear RGB."""
BOUNCE = (0.25, 0.25, 0.24)
"""Of the ground in mirrors: some of it is in shadow."""
AMBIENT = 0.20
"""Luminance of a white surface that looks up, without a light; half as much looking down."""
_AT_NIGHT = 0.2 * AMBIENT  # enough to tell surfaces apart where no lamp shines


def _tint(color: NDArray[np.float64], luminance: float) -> NDArray[np.float64]:
    """Scale a colour to a luminance (ITU-R BT.709)."""
    return color * (luminance / float(color @ (0.2126, 0.7152, 0.0722)))


@dataclass(frozen=True)
class Sky:
    """
    A sky that runs from horizon to zenith as the sine of the height, and its even light.

    Parameters
    ----------
    zenith, horizon, bounce : (float, float, float)
        Of the sky, and of the ground in mirrors, linear RGB.
    luminance : float
        Of a white surface that looks up; half as much looking down.
    """

    zenith: tuple[float, float, float]
    horizon: tuple[float, float, float]
    bounce: tuple[float, float, float]
    luminance: float

    @cached_property
    def from_above(self) -> NDArray[np.float64]:
        """Even light on a surface that looks up, (3,) linear RGB."""
        # The mean by the cosine is a third of the horizon and two of the zenith.
        return _tint((np.array(self.horizon) + 2.0 * np.array(self.zenith)) / 3.0, self.luminance)

    @cached_property
    def from_below(self) -> NDArray[np.float64]:
        """Even light on a surface that looks down, (3,) linear RGB."""
        return _tint(np.array(GROUND_COLOR), 0.5 * self.luminance)


DAY = Sky(SKY, HORIZON, BOUNCE, AMBIENT)
NIGHT = Sky((0.003, 0.005, 0.012), (0.010, 0.014, 0.026), (0.01, 0.01, 0.01), _AT_NIGHT)
FROM_SKY, FROM_GROUND = DAY.from_above, DAY.from_below
"""Even light from above and from below, (3,) linear RGB, as much of each as a surface faces."""


def choose_sky(lights: Sequence[Light]) -> Sky:
    """Return a night's sky if lamps shine alone: by day little is seen of their light."""
    return NIGHT if lights and all(light.is_point for light in lights) else DAY


def find_ambient(up: NDArray[np.float64], sky: Sky = DAY) -> NDArray[np.float64]:
    """Find the ambient light (n, 3) on surfaces whose normals have the z ``up``, -1 to 1."""
    share = 0.5 + 0.5 * up[:, None]
    return sky.from_below + share * (sky.from_above - sky.from_below)


def find_exposure(n_lights: int) -> float:
    """Return the radiance that one of n lights of intensity 1 adds to a white surface facing it."""
    return 0.8 / max(n_lights, 1) ** 0.5


def expose_lights(scene: Scene) -> tuple[Light, ...]:
    """
    Return a file's own lights, scaled together so that a picture is neither black nor white.

    Files state candela and lux but no exposure. Here the light that is brightest at the
    model's centre has the intensity 1 there, ignoring its cone; a light near the centre is
    taken at a quarter of the model's diagonal.
    """
    if not scene.lights:
        return ()
    low, high = scene.model_bounds()
    middle, nearest = (low + high) / 2, float(np.linalg.norm(high - low)) / 4
    amounts = []
    for light in scene.lights:
        away = 0.0
        if light.is_point:
            away = max(float(np.linalg.norm(light.position[:3] - middle)), nearest)
        constant, linear, quadratic = light.attenuation if light.is_point else (1.0, 0.0, 0.0)
        weakened = constant + away * (linear + away * quadratic)
        amounts.append(max(light.color) / max(weakened, 1e-12))
    if not max(amounts) > 0:
        return scene.lights
    scaled = []
    for light in scene.lights:
        red, green, blue = (value / max(amounts) for value in light.color)
        scaled.append(replace(light, color=(red, green, blue)))
    return tuple(scaled)
