"""
A drawing ready to be written: filled polygons, hatching and lines by part, in pixels.

Also what it says of itself: its units and scale, and what it leaves out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.drawing.overlay import Ring
from umbra.errors import show_count
from umbra.scene import Camera, Light, Scene

__all__ = ["INK", "DrawnPart", "Fill", "Hatching", "Page", "list_losses", "tell_scale"]

INK = (28, 28, 34)
"""Of lines, hatching and the caption, sRGB."""

Rgb = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Fill:
    """Rings filled with a colour (sRGB), by the nonzero rule."""

    rings: list[Ring]
    color: Rgb
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class Hatching:
    """Rings filled with parallel lines: the number of the light that does not reach them."""

    rings: list[Ring]
    light: int


@dataclass(frozen=True, eq=False)
class DrawnPart:
    """What a part shows. ``is_clear``: its surfaces are transparent, and lie over all others."""

    name: str
    kind: str = ""
    is_clear: bool = False
    faces: list[Fill] = field(default_factory=list)
    shadows: list[Fill | Hatching] = field(default_factory=list)
    outlines: list[NDArray[np.float64]] = field(default_factory=list)  # (2, 2) each
    creases: list[NDArray[np.float64]] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Page:
    """
    A drawing. (0, 0) is the upper left corner, y runs down, a unit is a pixel.

    Parameters
    ----------
    size : (int, int)
        Columns and rows.
    parts : list of DrawnPart
    sky : list of (float, colour)
        Share of the height from the top, and sRGB there; empty: nothing is behind the model.
    caption : str
    about : str
        What it is, its scale, and what is left out.
    lights : int
    """

    size: tuple[int, int]
    parts: list[DrawnPart]
    sky: list[tuple[float, Rgb]]
    caption: str
    about: str
    lights: int


_INCH, _UNITS = 0.0254, 96  # metres, and units of a drawing to the inch


def list_losses(scene: Scene, lights: Sequence[Light]) -> list[str]:
    """Describe what a drawing leaves out of the picture of a scene."""
    parts: dict[str, int] = {}
    for part in scene.parts:
        material, mesh = part.material, part.mesh
        has = {
            "textures and vertex colours (a part has its mean colour)": material.image is not None
            or mesh.colors is not None,
            "smooth normals (faces are flat)": mesh.normals is not None,
            "normal textures": material.normal_image is not None,
            "occlusion textures": material.occlusion_image is not None,
            "emissive textures": material.emission_image is not None,
            "gloss": material.roughness is not None,
            "holes": part.has_holes,
            "light through transparent parts": part.is_transparent,
        }
        for what, is_there in has.items():
            parts[what] = parts.get(what, 0) + is_there
    left = [f"{what} of {show_count(count, 'part')}" for what, count in parts.items() if count]
    if any(light.is_point for light in lights):
        left.append("the change of a lamp's light across a face")
    return [f"vectors leave out {'; '.join(left)}"] if left else []


def tell_scale(camera: Camera) -> str:
    """State a drawing's units and scale."""
    if camera.height is None:
        return "One unit is a pixel; a perspective view has no scale."
    metres = camera.height / camera.size[1]
    return (
        f"One unit is {metres:g} m across the view; printed at 96 units to the inch, the scale is "
        f"1:{metres * _UNITS / _INCH:.6g}."
    )
