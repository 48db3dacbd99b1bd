"""GeoPackage and Shapefile through pyogrio: a table of polygons."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.readers.columns import HEIGHTS
from umbra.readers.companions import Companions
from umbra.readers.extras import need
from umbra.readers.footprints import extrude_table
from umbra.readers.georeference import name_crs
from umbra.readers.model import Choices, Model
from umbra.readers.repair import from_shapes
from umbra.readers.table import Table
from umbra.scene import Source

__all__ = ["read_vectors"]

FORMATS = {".gpkg": "GeoPackage", ".shp": "Shapefile"}
POLYGON = 3  # shapely's number


def read_vectors(data: bytes, path: Path, choices: Choices) -> Model:
    """
    Read the footprints of a GeoPackage or a Shapefile.

    Parameters
    ----------
    data : bytes
        Unused: GDAL opens the file itself, and those beside it.
    path : Path
    choices : Choices
        With the columns of the heights.

    Returns
    -------
    model : Model

    Raises
    ------
    InputError
        If the file is damaged, holds several tables of footprints, or no heights;
        if pyogrio or shapely is not installed.
    """
    form = FORMATS.get(path.suffix.lower(), "GeoPackage" if data[:6] == b"SQLite" else "Shapefile")
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
        reason = " ".join(str(error).split())[:200]
        msg = f"cannot be read as {form} ({reason}); export it again"
        raise InputError(msg) from error

    missing = shapely.is_missing(shapes) | shapely.is_empty(shapes)
    if missing.any():
        notes.append(f"features without a geometry left out: {int(missing.sum())}")
    polygons, row = _find_polygons(shapely, shapes, ~missing, notes)
    crs = name_crs(meta["crs"])
    if crs is None:
        notes.append("no CRS is named, so coordinates are taken as metres")
    columns = {
        str(field): _plain(values) for field, values in zip(meta["fields"], fields, strict=True)
    }
    table = Table(
        form,
        from_shapes(shapely, polygons, row),
        [None] * len(shapes),
        columns,
        crs,
        tuple(notes),
    )
    model = extrude_table(table, choices)
    return replace(model, companions=_find_companions(path, companions))


def _choose_table(pyogrio: Any, path: Path, choices: Choices) -> tuple[str, list[str]]:
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


def _find_polygons(shapely: Any, shapes: Any, there: Any, notes: list[str]) -> tuple[Any, Any]:
    """Give all polygons, flat, and the row of each; count what is none."""
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
    """Give Python's own values, None for what a database calls null."""
    return [None if isinstance(v, float) and math.isnan(v) else v for v in values.tolist()]


def _find_companions(path: Path, companions: Companions) -> tuple[Source, ...]:
    """Give the files beside a Shapefile that hold its columns and its CRS."""
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
