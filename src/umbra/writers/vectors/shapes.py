"""Outlines and lines as simple-feature geometries with attributes: one list for every format."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.writers.vectors.hour_lines import HourLine
from umbra.writers.vectors.outlines import Outline

__all__ = ["Layer", "make_line_layer", "make_outline_layer", "make_seen_layer"]

To = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Layer:
    """
    Geometries of one kind, each with its values.

    Parameters
    ----------
    name : str
    kind : {'MultiPolygon', 'MultiLineString', 'Point'}
    geometries : list of shapely geometries
    values : dict of str to list
        Attributes by name, one of each for each geometry.
    """

    name: str
    kind: str
    geometries: list[Any]
    values: dict[str, list]


def make_outline_layer(outlines: Iterable[Outline]) -> Layer:
    """
    Make a layer of shadows: one geometry for each instant, valid by the OGC's rules.

    Parameters
    ----------
    outlines : iterable of Outline

    Returns
    -------
    layer : Layer
    """
    import shapely  # noqa: PLC0415  (an extra)

    geometries: list[Any] = []
    values: dict[str, list] = {
        name: [] for name in ("local_time", "utc", "sun_altitude", "sun_azimuth", "area_m2")
    }
    for outline in outlines:
        polygons = [shapely.Polygon(rings[0], rings[1:]) for rings in outline.polygons]
        # A ring that touches itself at a corner is split there; nothing moves.
        parts = [
            part
            for polygon in polygons
            for part in shapely.get_parts(
                polygon if polygon.is_valid else shapely.make_valid(polygon)
            )
            if part.geom_type == "Polygon"
        ]
        geometry = shapely.orient_polygons(shapely.MultiPolygon(parts))
        geometries.append(geometry)
        values["local_time"].append(outline.local.isoformat())
        values["utc"].append(outline.instant.isoformat().replace("+00:00", "Z"))
        values["sun_altitude"].append(round(outline.altitude, 4))
        values["sun_azimuth"].append(round(outline.azimuth, 4))
        values["area_m2"].append(round(geometry.area, 3))
    return Layer("shadow_outlines", "MultiPolygon", geometries, values)


def make_line_layer(hour_lines: Iterable[HourLine]) -> Layer:
    """Make a layer of lines of equal hours: one geometry for each hour."""
    import shapely  # noqa: PLC0415

    found = list(hour_lines)
    return Layer(
        "hour_lines",
        "MultiLineString",
        [shapely.MultiLineString(hour_line.lines) for hour_line in found],
        {
            "date": [hour_line.date for hour_line in found],
            "shadow_hours": [hour_line.shadow_hours for hour_line in found],
            "sun_hours": [hour_line.sun_hours for hour_line in found],
        },
    )


def make_seen_layer(lines: list[NDArray[np.float64]], receivers: str) -> Layer:
    """Make a layer of the border of what a view sees, so that its lines have a place."""
    import shapely  # noqa: PLC0415

    return Layer(
        "seen", "MultiLineString", [shapely.MultiLineString(lines)], {"receivers": [receivers]}
    )
