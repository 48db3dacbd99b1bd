"""Colours of a frame: diffuse surfaces, shadows hard or soft, a quiet sky."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.surfaces import find_surfaces
from umbra.rays.depth import GROUND, NOTHING, DepthBuffer
from umbra.rays.visible import VisibleSurface
from umbra.scene import Light, Material, Scene
from umbra.scene.palette import AMBIENT, GROUND_COLOR, HORIZON, SKY, find_exposure

__all__ = ["shade"]


def shade(
    scene: Scene,
    frame: VisibleSurface,
    lights: Sequence[Light],
    lit: Sequence[NDArray],
    view: DepthBuffer | None = None,
) -> NDArray[np.uint8]:
    """
    Shade what is seen by Lambert's cosine law.

    Each light weakens as its attenuation, range and cone say; several share the
    exposure of one. What a material emits is added, and an unlit one shows its colour
    as it is.

    A pixel shows the one surface that is nearest: transparent surfaces are drawn, and
    cast, as if they were opaque, so that no shadow is missing behind glass.

    Parameters
    ----------
    scene : Scene
    frame : VisibleSurface
    lights : sequence of Light
    lit : sequence of (rows, cols) bool or float
        Where each light reaches the surface, or what share of it does.
    view : DepthBuffer, optional
        Of the frame; without it neither textures, vertex colours nor smooth normals
        show.

    Returns
    -------
    rgb : (rows, cols, 3) uint8
        sRGB.

    Raises
    ------
    InputError
        If a texture cannot be decoded (which).
    """
    rows, cols = frame.part.shape
    seen = frame.part != NOTHING
    materials = [part.material for part in scene.parts] + [Material(GROUND_COLOR)]
    part = np.where(frame.part[seen] == GROUND, len(scene.parts), frame.part[seen])
    albedo, normal = find_surfaces(scene, frame, view)
    position = frame.position[seen]
    energy = np.repeat(AMBIENT * (0.75 + 0.25 * normal[:, 2:]), 3, 1)
    exposure = find_exposure(len(lights))
    for light, reached in zip(lights, lit, strict=True):
        way = light.position[:3] - light.position[3] * position
        away = np.maximum(np.linalg.norm(way, axis=1), np.finfo(np.float64).tiny)
        cosine = np.einsum("ij,ij->i", normal, way) / away
        amount = exposure * reached[seen] * np.maximum(cosine, 0.0)
        energy += amount[:, None] * light.find_intensity(position)
    energy[np.array([material.is_unlit for material in materials])[part]] = 1.0
    fade = np.linspace(0, 1, rows)[:, None, None]
    linear = np.broadcast_to((1 - fade) * SKY + fade * np.array(HORIZON), (rows, cols, 3)).copy()
    linear[seen] = albedo * energy + np.array([material.emission for material in materials])[part]
    return _to_srgb(linear)


def _to_srgb(linear: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Encode linear RGB as sRGB (IEC 61966-2-1)."""
    value = np.clip(linear, 0.0, 1.0)
    encoded = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return np.round(255 * encoded).astype(np.uint8)
