"""What one light's plan holds: draws, statistics, and where counts are made."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.gl.projection import Projection
from umbra.gl.selection import Selection
from umbra.gl.volumes import BodyVolumes

__all__ = ["LIGHT_CAP", "Z_FAIL", "Z_PASS", "Draw", "Plan", "Statistics"]

Z_PASS, Z_FAIL, LIGHT_CAP = "z_pass", "z_fail", "light_cap"


@dataclass(frozen=True)
class Draw:
    """Triangles to count in one way, ``z_pass``, ``z_fail`` or ``light_cap``, in the list."""

    kind: str
    is_cut: bool
    first: int
    count: int


@dataclass(frozen=True, kw_only=True)
class Statistics:
    """
    What one light's plan draws.

    Parameters
    ----------
    things, culled, cut : int
        Things that cast; those out of view; those in view whose volumes end at the floor.
    cases : (int, int, int)
        Things in view of case 1, 2 and 3.
    sides, sides_z_pass, dark_caps, light_caps : int
        Triangles: all sides, those counted before the visible surface, and caps.
    index_bytes : int
        That travel to the device.
    deepest : int
        No count can be larger.
    counts_in : {'stencil', 'float'}
        Where they are kept: 8 bits, or a float where more than 255 may overlap.
    """

    things: int
    culled: int
    cut: int
    cases: tuple[int, int, int]
    sides: int
    sides_z_pass: int
    dark_caps: int
    light_caps: int
    index_bytes: int
    deepest: int
    counts_in: str


@dataclass(frozen=True, eq=False)
class Plan:
    """
    One light's volumes, ready to draw.

    Parameters
    ----------
    projection : Projection
    light : (4,) float64
        Relative to the eye.
    bottom : float
        z, relative to the eye, where cut volumes end [m].
    draws : tuple of Draw
    start : int
        The count from which to start: of the far ends of rays, in orthographic views.
    case : (n_things,) int8
        McGuire's; 0 where culled.
    statistics : Statistics
    scissor : (int, int, int, int), optional
        Left, bottom, columns, rows [pixels]: where counts are made.
    depth_bounds : (float, float), optional
        Window depths between which they are.
    selection : Selection, optional
    volumes : tuple of BodyVolumes
        From which the draws were selected.
    """

    projection: Projection
    light: NDArray[np.float64]
    bottom: float
    draws: tuple[Draw, ...]
    start: int
    case: NDArray[np.int8]
    statistics: Statistics
    scissor: tuple[int, int, int, int] | None = None
    depth_bounds: tuple[float, float] | None = None
    selection: Selection | None = None
    volumes: tuple[BodyVolumes, ...] = ()
