"""Shapes of a made-up city's houses and crowns, as polygons between numbered corners."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["SHAPES", "Objects", "Shape"]


@dataclass(frozen=True)
class Shape:
    """
    A shape that many objects share.

    Parameters
    ----------
    name : str
    parts : tuple of tuple
        Of each building part its polygons: kind of surface, then rings of corners, holes last;
        wound counter-clockwise as seen from outside.
    """

    name: str
    parts: tuple[tuple[tuple[str, tuple[tuple[int, ...], ...]], ...], ...]


@dataclass(frozen=True, eq=False)
class Objects:
    """
    Objects of one shape.

    Parameters
    ----------
    shape : Shape
    names : list of str
        Unique in the city.
    vertices : (n, k, 3) float64
        [m].
    """

    shape: Shape
    names: list[str]
    vertices: NDArray[np.float64]


def _make_box(first: int, *, roof: tuple[tuple[int, ...], ...] | None = None) -> tuple:
    """Return the polygons of a box: corners of the bottom, then of the top."""
    a, b, c, d = range(first, first + 4)
    walls = [(i, j, j + 4, i + 4) for i, j in ((a, b), (b, c), (c, d), (d, a))]
    roofs = roof or ((a + 4, b + 4, c + 4, d + 4),)
    return (
        ("GroundSurface", ((a, d, c, b),)),
        *(("WallSurface", (ring,)) for ring in walls),
        *(("RoofSurface", (ring,)) for ring in roofs),
    )


def _make_courtyard() -> tuple:
    """Return the polygons of a house around a courtyard: outer box, inner box."""
    outer, inner = _make_box(0), _make_box(8)
    walls = [("WallSurface", (ring[::-1],)) for kind, (ring,) in inner if kind == "WallSurface"]
    return (
        ("GroundSurface", (outer[0][1][0], inner[0][1][0][::-1])),
        *outer[1:5],
        *walls,
        ("RoofSurface", (outer[5][1][0], inner[5][1][0][::-1])),
    )


_PITCHED = ((4, 5, 9, 8), (6, 7, 8, 9))
_GABLED = (
    ("GroundSurface", ((0, 3, 2, 1),)),
    ("WallSurface", ((0, 1, 5, 4),)), ("WallSurface", ((1, 2, 6, 9, 5),)),
    ("WallSurface", ((2, 3, 7, 6),)), ("WallSurface", ((3, 0, 4, 8, 7),)),
    *(("RoofSurface", (ring,)) for ring in _PITCHED),
)  # fmt: skip
_CROWN = tuple(
    ("", (ring,))
    for k in range(6)
    for ring in ((0, 1 + (k + 1) % 6, 1 + k), (7, 1 + k, 1 + (k + 1) % 6))
)
SHAPES = {
    shape.name: shape
    for shape in (
        Shape("flat", (_make_box(0),)),
        Shape("gabled", (_GABLED,)),
        Shape("hipped", (_make_box(0, roof=(*_PITCHED, (5, 6, 9), (7, 4, 8))),)),
        Shape("courtyard", (_make_courtyard(),)),
        Shape("tower", (_make_box(0), _make_box(8))),
        Shape("crown", (_CROWN,)),
    )
}
"""Shapes by name."""
