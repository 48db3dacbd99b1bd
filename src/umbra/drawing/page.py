"""A drawing ready to be written: filled polygons, hatching and lines by part, in pixels."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.drawing.overlay import Ring

__all__ = ["INK", "DrawnPart", "Fill", "Hatching", "Page"]

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
