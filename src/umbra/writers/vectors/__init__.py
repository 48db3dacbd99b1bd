"""
Vectors: shadow outlines of each instant and lines of equal hours, for GIS and CAD.

``outlines.py`` finds the polygons of shadows; here are lines of equal hours and the layers of
simple features that every format is written from. ``gis_files.py`` writes GeoJSON, GeoPackage and
GeoTIFF by the model's CRS, ``dxf.py`` CAD.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.study import Study, count_finer, split_dates, tell_dates
from umbra.writers.csv_tables import find_columns, tell_instants
from umbra.writers.vectors.outlines import Polygon, ShadowOutline

if TYPE_CHECKING:
    from umbra.writers.picture_content import Show

__all__ = [
    "HourLine",
    "Layer",
    "find_hour_lines",
    "join_polygons",
    "make_line_layer",
    "make_outline_layer",
    "make_point_layer",
    "make_seen_layer",
    "trace_seen",
]


@dataclass(frozen=True, eq=False)
class HourLine:
    """Lines around the cells with at least a number of hours in shadow, or in the sun."""

    shadow_hours: float  # at least, on the line's deeper side [h]; of lines of equal sun at most
    sun_hours: float  # at most [h]; of lines of equal sun at least
    # (k, 2) in the study's coordinates: a plan's are the model's, a view's along and up [m]
    lines: list[NDArray[np.float64]]
    date: str  # 2026-03-21, or sum of 30 dates
    seconds: float  # of a step: times are known to half of it; 0 of exact instants


def find_hour_lines(study: Study, show: "Show" = "shadow") -> Iterator[HourLine]:
    """
    Trace a study's hours at whole hours of shadow or sun, interpolated between cells' centres.

    Hours are counted again in finer steps where ``count_finer`` allows it, and grow by whole steps
    from cell to cell. A line runs half a step below its hour, so midway between the last cell that
    has less and the first that has as much. Hours of exact instants have no steps. On the ground,
    lines end at buildings: cells under them do not count. On roofs and walls they end at edges,
    where one surface ends before another or two meet at an angle. Levels without lines are left
    out; several dates follow one another.
    """
    for dated in split_dates(study):
        yield from _trace(dated, show)


def _trace(study: Study, show: "Show") -> Iterator[HourLine]:
    """Trace the lines of one date, or of sums."""
    import contourpy  # noqa: PLC0415

    from umbra.writers.contours import find_levels  # noqa: PLC0415

    finer = count_finer(study, longest=None)
    seconds = 3600 * float(study.period.hours.min()) if finer is None else finer.seconds
    if "exact_tolerance_seconds" in study.facts:
        seconds = 0.0
    counted = study if finer is None else finer
    values = counted.shadow_hours
    if show == "sun":
        values = counted.up_hours - values
    hours = np.ma.masked_invalid(values.astype(np.float64))
    if study.kind.lies_under_roofs:
        hours = np.ma.masked_where(~study.kind.find_open(study), hours)
    else:
        from umbra.writers.edges import find_breaks  # noqa: PLC0415

        hours = np.ma.masked_where(find_breaks(study), hours)
    if min(hours.shape) < 2 or hours.mask.all():
        return
    generator = contourpy.contour_generator(study.x, study.y, hours)
    for level in find_levels(study.up_hours, most=48):
        traced: Any = generator.lines(level - seconds / 7200)
        lines = [line for line in traced if len(line) > 1]
        if lines:
            pair = float(level), study.up_hours - level
            shadow, sun = pair[::-1] if show == "sun" else pair
            yield HourLine(shadow, sun, lines, tell_dates(study), seconds)


def trace_seen(study: Study) -> list[NDArray[np.float64]]:
    """Trace the border of the model in a view, half a cell exact: closed lines [m]."""
    import contourpy  # noqa: PLC0415

    drawn = np.isfinite(study.shadow_hours) & (study.is_of_model | study.is_plan)
    seen = np.pad(drawn.astype(np.float64), 1)
    grid = study.grid
    x = np.concatenate([[study.x[0] - grid.dx], study.x, [study.x[-1] + grid.dx]])
    y = np.concatenate([[study.y[0] - grid.dy], study.y, [study.y[-1] + grid.dy]])
    traced: Any = contourpy.contour_generator(x, y, seen).lines(0.5)
    return [line for line in traced if len(line) > 2]


@dataclass(frozen=True, eq=False)
class Layer:
    """Geometries of one kind, each with its values."""

    name: str
    kind: str  # MultiPolygon, MultiLineString or Point
    geometries: list[Any]  # of shapely
    values: dict[str, list]  # attributes by name, one for each geometry


def join_polygons(polygons: Iterable[Polygon]) -> Any:
    """Join polygons of rings in a ``shapely.MultiPolygon`` that is valid by the OGC's rules."""
    import shapely  # noqa: PLC0415  (an extra)

    # A ring that touches itself at a corner is split there; nothing moves.
    parts = [
        part
        for polygon in (shapely.Polygon(rings[0], rings[1:]) for rings in polygons)
        for part in shapely.get_parts(polygon if polygon.is_valid else shapely.make_valid(polygon))
        if part.geom_type == "Polygon"
    ]
    return shapely.orient_polygons(shapely.MultiPolygon(parts))


def make_outline_layer(outlines: Iterable[ShadowOutline]) -> Layer:
    """Make a layer of shadows: one geometry for each instant, valid by the OGC's rules."""
    geometries: list[Any] = []
    values: dict[str, list] = {
        name: [] for name in ("local_time", "utc", "sun_altitude", "sun_azimuth", "area_m2")
    }
    for outline in outlines:
        geometry = join_polygons(outline.polygons)
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

    lines = list(hour_lines)
    return Layer(
        "hour_lines",
        "MultiLineString",
        [shapely.MultiLineString(hour_line.lines) for hour_line in lines],
        {
            "date": [hour_line.date for hour_line in lines],
            "shadow_hours": [hour_line.shadow_hours for hour_line in lines],
            "sun_hours": [hour_line.sun_hours for hour_line in lines],
            "step_minutes": [round(hour_line.seconds / 60, 4) for hour_line in lines],
        },
    )


def make_seen_layer(lines: list[NDArray[np.float64]], receivers: str) -> Layer:
    """Make a layer of the model's border in a view, so that its lines have a place."""
    import shapely  # noqa: PLC0415

    return Layer(
        "seen", "MultiLineString", [shapely.MultiLineString(lines)], {"receivers": [receivers]}
    )


def make_point_layer(study: Study) -> Layer:
    """Make a layer of points, each with its results; instants are UTC as text."""
    import shapely  # noqa: PLC0415  (an extra)

    values: dict[str, list] = {}
    for name, column in find_columns(study, ("sample",)).items():
        if column.dtype.kind == "M":
            values[name] = tell_instants(column)
        elif column.dtype.kind == "f":
            values[name] = np.round(column.astype(np.float64), 4).tolist()
        else:
            values[name] = column.tolist()
    if "name" in values:
        values = {"name": values.pop("name"), **values}
    geometries = shapely.points(study.places.points[:, :2]).tolist()
    return Layer("points", "Point", geometries, values)
