"""Footprint files: GeoJSON, and GeoPackage and Shapefile, which GDAL opens in a child process."""

from collections import Counter
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.packages import require
from umbra.readers.budget import Budget
from umbra.readers.checks import Companions, list_counts
from umbra.readers.child import ReadingChild
from umbra.readers.content import FileContent
from umbra.readers.footprint_table import FootprintTable, Rings
from umbra.readers.footprints import extrude_table
from umbra.readers.georeference import name_crs
from umbra.readers.model import NO_CRS, FileModel, ReadChoices
from umbra.readers.vector_tables import VectorWork
from umbra.scene import Source

__all__ = ["read_geojson", "read_vectors", "tabulate_geojson", "tabulate_vectors"]

_SQUARE, _CLEARLY = 2.0, 0.3  # angle off 90 degrees, and share of corners more: it is no chance
_CELL = 16  # memory of a property of a feature in its column [byte]
_CORNERS = 12  # fewer tell nothing


def read_geojson(documents: list[Any], choices: ReadChoices) -> FileModel:
    """Read parsed GeoJSON: a collection, a feature, or a feature a line."""
    return extrude_table(tabulate_geojson(documents, choices.budget), choices)


def tabulate_geojson(documents: list[Any], budget: Budget) -> FootprintTable:
    """Return the polygons of parsed GeoJSON and their properties."""
    features: list[Any] = []
    for document in documents:
        features += _list_features(document)
    left: Counter[str] = Counter()
    polygons: list[Any] = []
    owner: list[int] = []
    for row, feature in enumerate(features):
        try:
            shapes = _list_polygons(feature.get("geometry"), left)
            _touch_corners(shapes)
        except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
            msg = (
                f"feature {row + 1} of {len(features)} has damaged coordinates; "
                "repair it or export the file again"
            )
            raise InputError(msg, feature=row + 1) from error
        polygons += shapes
        owner += [row] * len(shapes)
    rings = _flatten(polygons, owner)
    crs, note = _find_crs(documents[0], rings)
    return FootprintTable(
        "GeoJSON",
        rings,
        [_name(feature) for feature in features],
        _gather_columns(features, budget),
        crs,
        (*list_counts(left), *note),
    )


def _list_features(document: Any) -> list[Any]:
    kind = document.get("type") if isinstance(document, dict) else None
    if kind == "FeatureCollection":
        features = document.get("features")
        if not isinstance(features, list) or not all(isinstance(f, dict) for f in features):
            msg = "is GeoJSON whose features are not a list of objects; export it again"
            raise InputError(msg)
        return features
    return [document] if kind == "Feature" else [{"type": "Feature", "geometry": document}]


def _list_polygons(geometry: Any, left: Counter[str]) -> list[Any]:
    """Return the polygons of a geometry; count other shapes."""
    if geometry is None:
        left["features without a geometry left out"] += 1
        return []
    kind = geometry["type"]
    if kind == "Polygon":
        rings = geometry["coordinates"]
        return [rings] if rings else []
    if kind == "MultiPolygon":
        return [rings for rings in geometry["coordinates"] if rings]
    if kind == "GeometryCollection":
        return list(chain.from_iterable(_list_polygons(g, left) for g in geometry["geometries"]))
    left[f"{'points' if 'Point' in str(kind) else 'lines'} among the footprints left out"] += 1
    return []


def _touch_corners(polygons: list[Any]) -> None:
    """Raise if the first corner of a ring is not a list of two numbers."""
    for ring in chain.from_iterable(polygons):
        _ = ring[0][1]


def _flatten(polygons: list[Any], owner: list[int]) -> Rings:
    lengths, polygon = [], []
    points: list[Any] = []
    for index, rings in enumerate(polygons):
        for ring in rings:
            # The closing corner repeats the first.
            corners = ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring
            lengths.append(len(corners))
            polygon.append(index)
            points += [corner[:2] for corner in corners]
    try:
        array = np.array(points, np.float64).reshape(len(points), 2)
    except (TypeError, ValueError) as error:
        wrong = next((p for p in points if not all(isinstance(v, int | float) for v in p)), None)
        msg = f"has a corner that is not a pair of numbers ({str(wrong)[:60]}); export it again"
        raise InputError(msg) from error
    return Rings(
        array, np.array(lengths, np.int64), np.array(polygon, np.int64), np.array(owner, np.int64)
    )


def _find_crs(head: dict[str, Any], rings: Rings) -> tuple[str | None, tuple[str, ...]]:
    """Return the named CRS, else degrees, GeoJSON's default, if the numbers allow."""
    named = head.get("crs")
    crs = None
    if isinstance(named, dict):
        properties = named.get("properties")
        crs = name_crs(properties.get("name")) if isinstance(properties, dict) else None
        if crs is not None and not crs.startswith("OGC:CRS84"):
            return crs, ()
    size = np.abs(rings.points)
    if len(size) and (size[:, 0] <= 90).all() and ((size[:, 1] > 90) & (size[:, 1] <= 180)).all():
        first, second = rings.points[0].tolist()
        msg = (
            f"has latitudes where GeoJSON has longitudes (first: {first:.4f}, {second:.4f}); swap "
            "the two numbers of every corner"
        )
        raise InputError(msg)
    # NaN is neither; `make_scene` reports it.
    if crs is not None or not (size > [180.0, 90.0]).any():
        return crs or "OGC:CRS84", _tell_swapped(rings)
    return None, ("the coordinates are not degrees", NO_CRS)


def _tell_swapped(rings: Rings) -> tuple[str, ...]:
    """Report degrees whose corners are square only if the first of two is a latitude."""
    points = rings.points
    if len(points) < _CORNERS:
        return ()
    preceding = np.argsort(rings.following)
    sides = np.stack([points[preceding] - points, points[rings.following] - points])
    squares = []
    for latitude in (1, 0):
        metres = sides.copy()
        metres[..., 1 - latitude] *= np.cos(np.radians(points[:, latitude]))
        before, after = np.degrees(np.arctan2(metres[..., 1], metres[..., 0]))
        off = np.abs((after - before + 45.0) % 90.0 - 45.0)
        squares.append(float((off < _SQUARE).mean()))
    if squares[1] < squares[0] + _CLEARLY:
        return ()
    east, north = points[0].tolist()
    note = (
        f"latitude and longitude may be swapped: {100 * squares[1]:.0f} % of the corners would be "
        f"square if they were, and {100 * squares[0]:.0f} % are; the first corner is taken as "
        f"longitude {east:.4f}, latitude {north:.4f}"
    )
    return (note,)


def _gather_columns(features: list[Any], budget: Budget) -> dict[str, list[Any]]:
    """Return the properties column by column; refuse very many columns that are mostly empty."""
    rows = [feature.get("properties") for feature in features]
    filled = [row if isinstance(row, dict) else {} for row in rows]
    names = dict.fromkeys(chain.from_iterable(filled))
    budget.check(_CELL * len(names) * len(filled), f"a table of {len(names):,} properties")
    return {name: [row.get(name) for row in filled] for name in names}


def _name(feature: dict[str, Any]) -> str | None:
    name = feature.get("id")
    return str(name) if isinstance(name, str | int) else None


FORMATS = {".gpkg": "GeoPackage", ".shp": "Shapefile"}


def read_vectors(content: FileContent, path: Path, choices: ReadChoices) -> FileModel:
    """Read the footprints of a GeoPackage or a Shapefile, which GDAL opens in a child process."""
    table, companions = tabulate_vectors(content, path, choices)
    return replace(extrude_table(table, choices), companions=companions)


def tabulate_vectors(
    content: FileContent, path: Path, choices: ReadChoices
) -> tuple[FootprintTable, tuple[Source, ...]]:
    """Return the polygons of a GeoPackage or a Shapefile, and the files beside it."""
    form = FORMATS.get(
        path.suffix.lower(), "GeoPackage" if content.head[:6] == b"SQLite" else "Shapefile"
    )
    require(["pyogrio", "shapely"], "gis", form)
    companions = choices.companions_of(path)
    companions.check_beside()
    work = VectorWork(str(path.absolute()), form, choices.height_column)
    child = ReadingChild(
        "umbra.readers.vector_tables:read_table", work, choices.budget.limit_child()
    )
    tables = list(child)
    if not child.is_done or not tables:
        error = child.make_error(form, "export it again")
        raise error
    return tables[0], _find_companions(path, companions)


def _find_companions(path: Path, companions: Companions) -> tuple[Source, ...]:
    """Return the files beside a Shapefile that hold its columns and its CRS."""
    if path.suffix.lower() != ".shp":
        return ()
    sources = []
    for ending in (".dbf", ".shx", ".prj", ".cpg"):
        beside = next(
            (p for p in (path.with_suffix(e) for e in (ending, ending.upper())) if p.exists()), None
        )
        if beside is not None:
            companions.read(beside.name)
            sources.append(Source(beside.name, str(companions.record[beside.name]), "Shapefile"))
    return tuple(sources)
