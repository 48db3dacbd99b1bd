"""Colours of ground and sky, and exposure of lights, on every device."""

from dataclasses import replace

import numpy as np

from umbra.scene.lights import Light
from umbra.scene.scene import Scene

__all__ = ["AMBIENT", "GROUND_COLOR", "HORIZON", "SKY", "expose_lights", "find_exposure"]

GROUND_COLOR = (0.50, 0.50, 0.48)
SKY, HORIZON = (0.42, 0.60, 0.82), (0.86, 0.91, 0.95)
"""Behind everything, at the top and at the foot of a picture; linear RGB."""
AMBIENT = 0.20
"""Of a white surface that looks up; half as much looking down."""


def find_exposure(n_lights: int) -> float:
    """Return the radiance that one of n lights of intensity 1 adds to a white surface facing it."""
    return 0.8 / max(n_lights, 1) ** 0.5


def expose_lights(scene: Scene) -> tuple[Light, ...]:
    """
    Return a file's own lights, scaled together so that a picture is neither black nor white.

    Files state candela and lux and leave the exposure to who shows them. Here the light
    that is brightest at the middle of the model has the intensity 1 there, whatever its
    cone; one in the midst is taken at a quarter of the model's diagonal.
    """
    if not scene.lights:
        return ()
    low, high = scene.bounds()
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
