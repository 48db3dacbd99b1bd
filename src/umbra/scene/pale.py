"""umbra's own look: a model pale as plaster on paper, a warm sky, blue-grey shadows."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from umbra.scene.exposure import BOUNCE, DAY, Sky, choose_sky
from umbra.scene.lights import Light
from umbra.scene.mesh import ADDED_GROUND
from umbra.scene.scene import Scene

__all__ = [
    "BRIGHTEST",
    "PALENESS",
    "PAPER",
    "RISE",
    "STUDIO",
    "choose_pale_sky",
    "expose_suns",
    "has_looks",
    "make_pale",
]

_PLASTER = np.array((0.86, 0.83, 0.78))  # linear RGB, warm as paper
PALENESS = 0.72
"""Share of plaster in the colours of surfaces."""
PAPER = (0.90, 0.87, 0.82)
"""Of a ground that the picture adds; linear RGB."""

STUDIO = Sky((0.50, 0.64, 0.88), (0.93, 0.925, 0.91), BOUNCE, 0.13)
"""A warm horizon, and blue light in shadows, little enough for their contrast."""
RISE, BRIGHTEST = 0.72, 1.7
"""
Sine of the sun's altitude below which its light is raised, and by how much at most: as a photograph
is exposed, so that level ground is as bright at all times of day and no wall turns white.
"""
_LOWEST = 1e-6  # sine of the altitude of a sun that is as low as any
_WARM = (1.03, 1.0, 0.94)  # of their light: shadows are blue beside it


def has_looks(scene: Scene) -> bool:
    """Return whether a model has textures or gloss, which are shown as they are."""
    return any(part.material.images or part.material.roughness is not None for part in scene.parts)


def choose_pale_sky(lights: Sequence[Light]) -> Sky:
    """Return the sky of a pale picture: a night's if lamps shine alone."""
    sky = choose_sky(lights)
    return STUDIO if sky is DAY else sky


def expose_suns(lights: Sequence[Light]) -> list[Light]:
    """
    Return the lights with low suns as bright as a photograph shows them.

    A sun too low for the largest factor is bent besides (`Light.bend`), so that level ground takes
    no less and a wall before it no more. The live page has the same law (`exposeSun`).
    """
    exposed = []
    for light in lights:
        times = bend = 1.0
        if not light.is_point:
            rise = float(light.position[2] / np.linalg.norm(light.position[:3]))
            times = min(max(RISE / max(rise, _LOWEST), 1.0), BRIGHTEST)
            if 0 < rise < RISE / BRIGHTEST:
                bend = float(np.log(RISE / BRIGHTEST) / np.log(max(rise, _LOWEST)))
        red, green, blue = (times * np.multiply(light.color, _WARM)).tolist()
        exposed.append(replace(light, color=(red, green, blue), bend=bend))
    return exposed


def make_pale(
    scene: Scene, share: float, ground: tuple[float, float, float] | None = None
) -> Scene:
    """
    Return the scene for shading alone, its colours mixed with plaster.

    An added ground keeps its colour, which is a plane's, or gets the colour ``ground``.
    """
    if not share:
        return scene
    parts = []
    for part in scene.parts:
        color = share * _PLASTER + (1 - share) * np.array(part.material.color)
        if part.kind in ADDED_GROUND:
            if ground is None:
                parts.append(part)
                continue
            color = np.array(ground)
        red, green, blue = color.tolist()
        parts.append(replace(part, material=replace(part.material, color=(red, green, blue))))
    return replace(scene, parts=tuple(parts))
