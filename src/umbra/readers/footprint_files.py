"""Footprint files: GeoJSON, and GeoPackage and Shapefile through pyogrio."""

import math
from collections import Counter
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.checks import Companions, find_reason, list_counts
from umbra.readers.content import FileContent
from umbra.readers.footprint_table import HEIGHTS, FootprintTable, Rings
from umbra.readers.footprints import extrude_table, from_shapes
from umbra.readers.georeference import name_crs
from umbra.readers.model import FileModel, ReadChoices
from umbra.scene import Source

__all__ = ["find_polygons", "read_geojson", "read_vectors"]

_SQUARE, _CLEARLY = 2.0, 0.3  # angle off 90 degrees, and share of corners more: it is no chance
_CORNERS = 12  # fewer tell nothing


def read_geojson(documents: list[Any], choices: ReadChoices) -> FileModel:
    """Read parsed GeoJSON: a collection, a feature, or a feature a line."""
    features: list[Any] = []
    for document in documents:
        features += _list_features(document)
    left: Counter[str] = Counter()
    polygons: list[Any] = []
    owner: list[int] = []
    for row, feature in enumerate(features):
        try:
            found = _list_polygons(feature.get("geometry"), left)
            _touch_corners(found)
        except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
            msg = (
                f"feature {row + 1} of {len(features)} has damaged coordinates; "
                "repair it or export the file again"
            )
            raise InputError(msg, feature=row + 1) from error
        polygons += found
        owner += [row] * len(found)
    rings = _flatten(polygons, owner)
    crs, note = _find_crs(documents[0], rings)
    return extrude_table(
        FootprintTable(
            "GeoJSON",
            rings,
            [_name(feature) for feature in features],
            _gather_columns(features),
            crs,
            (*list_counts(left), *note),
        ),
        choices,
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
    note = "the coordinates are not degrees and no CRS is named, so they are taken as metres"
    return None, (note,)


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


def _gather_columns(features: list[Any]) -> dict[str, list[Any]]:
    """Return the properties column by column."""
    rows = [feature.get("properties") for feature in features]
    filled = [row if isinstance(row, dict) else {} for row in rows]
    names = dict.fromkeys(chain.from_iterable(filled))
    return {name: [row.get(name) for row in filled] for name in names}


def _name(feature: dict[str, Any]) -> str | None:
    name = feature.get("id")
    return str(name) if isinstance(name, str | int) else None


FORMATS = {".gpkg": "GeoPackage", ".shp": "Shapefile"}
POLYGON = 3  # shapely's number


def read_vectors(content: FileContent, path: Path, choices: ReadChoices) -> FileModel:
    """Read the footprints of a GeoPackage or a Shapefile, which GDAL opens."""
    form = FORMATS.get(
        path.suffix.lower(), "GeoPackage" if content.head[:6] == b"SQLite" else "Shapefile"
    )
    pyogrio = need("pyogrio", "gis", form)
    raw = need("pyogrio.raw", "gis", form)
    shapely = need("shapely", "gis", form)
    companions = choices.companions_of(path)
    companions.check_beside()
    try:
        name, notes = _choose_table(pyogrio, path, choices)
        meta, _, geometry, fields = raw.read(path, layer=name)
        shapes = shapely.from_wkb(geometry)
    except InputError:
        raise
    except Exception as error:  # GDAL raises many kinds
        reason = find_reason(error, 200)
        msg = f"cannot be read as {form} ({reason}); export it again"
        raise InputError(msg) from error

    missing = shapely.is_missing(shapes) | shapely.is_empty(shapes)
    if missing.any():
        notes.append(f"features without a geometry left out: {int(missing.sum())}")
    polygons, row = find_polygons(shapely, shapes, ~missing, notes)
    crs = name_crs(meta["crs"])
    if crs is None:
        notes.append("no CRS is named, so coordinates are taken as metres")
    columns = {
        str(field): _plain(values) for field, values in zip(meta["fields"], fields, strict=True)
    }
    table = FootprintTable(
        form, from_shapes(shapely, polygons, row), [None] * len(shapes), columns, crs, tuple(notes)
    )
    model = extrude_table(table, choices)
    return replace(model, companions=_find_companions(path, companions))


def _choose_table(pyogrio: Any, path: Path, choices: ReadChoices) -> tuple[str, list[str]]:
    """Choose the table of polygons; of several the one that has the heights."""
    layers = [
        (str(name), pyogrio.read_info(path, layer=name)) for name, _ in pyogrio.list_layers(path)
    ]
    names = [name for name, info in layers if _may_hold_polygons(info["geometry_type"])]
    if not names:
        msg = "has no table of polygons; give a file of building footprints"
        raise InputError(msg)
    wanted = {choices.height_column.casefold()} if choices.height_column else set(HEIGHTS)
    having = [
        name
        for name, info in layers
        if name in names and wanted & {str(field).casefold() for field in info["fields"]}
    ]
    if len(names) == 1 or len(having) == 1:
        chosen = having[0] if len(having) == 1 else names[0]
        others = [name for name, _ in layers if name != chosen]
        left = f"tables without footprints or heights left out: {', '.join(others)}"
        return chosen, [left] if others else []
    shown = ", ".join(having or names)
    msg = (
        f"has several tables of footprints ({shown}); export the one you mean "
        f"(ogr2ogr one.gpkg {path.name} {(having or names)[0]})"
    )
    raise InputError(msg, tables=having or names)


def _may_hold_polygons(kind: str | None) -> bool:
    return kind is not None and ("Polygon" in kind or kind in {"Unknown", "GeometryCollection"})


def find_polygons(shapely: Any, shapes: Any, there: Any, notes: list[str]) -> tuple[Any, Any]:
    """Return all polygons, flat, and the row of each; count other shapes."""
    rows = np.flatnonzero(there)
    parts, index = shapely.get_parts(shapes[rows], return_index=True)
    while (shapely.get_type_id(parts) > 3).any():  # collections in collections
        parts, inner = shapely.get_parts(parts, return_index=True)
        index = index[inner]
    is_polygon = (shapely.get_type_id(parts) == POLYGON) & ~shapely.is_empty(parts)
    if not is_polygon.all():
        notes.append(f"points and lines among the footprints left out: {int((~is_polygon).sum())}")
    return shapely.force_2d(parts[is_polygon]), rows[index[is_polygon]]


def _plain(values: Any) -> list[Any]:
    """Return Python values, None for null."""
    return [None if isinstance(v, float) and math.isnan(v) else v for v in values.tolist()]


def _find_companions(path: Path, companions: Companions) -> tuple[Source, ...]:
    """Return the files beside a Shapefile that hold its columns and its CRS."""
    if path.suffix.lower() != ".shp":
        return ()
    found = []
    for ending in (".dbf", ".shx", ".prj", ".cpg"):
        beside = next(
            (p for p in (path.with_suffix(e) for e in (ending, ending.upper())) if p.exists()), None
        )
        if beside is not None:
            companions.read(beside.name)
            found.append(Source(beside.name, str(companions.record[beside.name]), "Shapefile"))
    return tuple(found)
