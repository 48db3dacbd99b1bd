"""
The lattice of an area: squares cut by its polygon, each judged at the centroid of its piece.

The pieces add up to the area of the polygon. The squares are turned against its longest side by an
angle whose tangent is the golden section, so that lines of shadow along its sides, or along walls
parallel to them, pass between the centres as evenly as they can: on a garden of 10 by 10 m with
squares of 0.25 m the share on one side of such a line is right to 0.05 %, and to 1.3 % where
squares lie along the line.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.machine import find_memory, name_memory
from umbra.packages import need

__all__ = ["LEAST_SAMPLES", "choose_side", "cut_polygon"]

LEAST_SAMPLES = 400
"""Least number of squares of an area."""
_USUAL, _MOST = 2_500, 40_000  # squares of an area, if no side is asked for
_LARGEST = 1.0  # side of a square, but for very large areas [m]
_TURN = math.atan((math.sqrt(5.0) - 1.0) / 2.0)
_BYTES = 400  # of a square while it is cut [byte]


def choose_side(area: float, cell: float | None) -> float:
    """
    Choose the side of an area's squares [m].

    Parameters
    ----------
    area : float
        [m2]
    cell : float, optional
        Side that was asked for [m]; smaller squares are taken where fewer than ``LEAST_SAMPLES``
        would fit.
    """
    if cell is not None:
        return min(cell, math.sqrt(area / LEAST_SAMPLES))
    side = min(math.sqrt(area / _USUAL), _LARGEST)
    return max(side, math.sqrt(area / _MOST))


def cut_polygon(polygon: Any, side: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Cut a polygon by a lattice of squares.

    Parameters
    ----------
    polygon : shapely.Polygon or shapely.MultiPolygon
        Valid, of some area [m].
    side : float
        Of the squares [m].

    Returns
    -------
    points : (n, 2) float64
        A place in each piece: its centroid, or another point of a piece that is bent around it.
    areas : (n,) float64
        Of the pieces [m2].

    Raises
    ------
    InputError
        If there are more squares than memory.
    """
    shapely = need("shapely", "gis", "areas")
    # Local coordinates: those of maps leave few digits to clip with.
    origin = shapely.get_coordinates(polygon)[0]
    turn = _TURN + _find_direction(shapely, polygon)
    matrix = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    local = shapely.transform(polygon, lambda points: (points - origin) @ matrix.T)
    low, high = np.reshape(shapely.bounds(local), (2, 2))
    cols, rows = (int(n) for n in np.ceil((high - low) / side) + 1)
    if cols * rows * _BYTES > find_memory():
        msg = (
            f"an area needs {cols * rows:,} squares of {side:g} m and {name_memory(find_memory())};"
            " give a larger cell="
        )
        raise InputError(msg, option="cell", count=cols * rows)
    # The lattice is laid about the middle, so that it does not depend on one corner.
    start = (low + high) / 2 - side * np.array([cols, rows]) / 2
    x, y = (k.ravel() for k in np.meshgrid(np.arange(cols), np.arange(rows)))
    west, south = start[0] + side * x, start[1] + side * y
    squares = shapely.box(west, south, west + side, south + side)
    shapely.prepare(local)
    is_met = shapely.intersects(local, squares)
    is_whole = np.zeros(len(squares), np.bool_)
    is_whole[is_met] = shapely.contains_properly(local, squares[is_met])
    rim = shapely.intersection(squares[is_met & ~is_whole], local)
    areas = np.full(int(is_whole.sum()), side * side)
    points = np.stack([west, south], 1)[is_whole] + side / 2
    own = shapely.area(rim)
    rim, own = rim[own > 0], own[own > 0]
    middle = shapely.centroid(rim)
    bent = ~shapely.intersects(rim, middle)
    middle[bent] = shapely.point_on_surface(rim[bent])
    points = np.concatenate([points, shapely.get_coordinates(middle)])
    return points @ matrix + origin, np.concatenate([areas, own])


def _find_direction(shapely: Any, polygon: Any) -> float:
    """Return the direction of a polygon's longest edge, counter-clockwise from x [radian]."""
    rings = shapely.get_rings(shapely.get_parts(polygon))
    steps = np.concatenate([np.diff(shapely.get_coordinates(ring), axis=0) for ring in rings])
    east, north = steps[np.argmax(np.hypot(*steps.T))].tolist()
    return math.atan2(north, east)
