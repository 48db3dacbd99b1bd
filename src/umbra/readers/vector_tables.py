"""
pyogrio on one GeoPackage or Shapefile: the table of its footprints.

This runs in a child process (`umbra.readers.footprint_files`), as GDAL runs what a database asks
for, which may never end, and may end the process at damaged files. All that is yielded here is
arrays and plain values.
"""

import math
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.checks import find_reason
from umbra.readers.footprint_table import HEIGHTS, FootprintTable, Rings, has_height
from umbra.readers.footprints import from_shapes
from umbra.readers.georeference import name_crs
from umbra.readers.model import NO_CRS

__all__ = ["VectorWork", "check_schema", "find_polygons", "read_table"]

POLYGON = 3  # shapely's number
_VALUES = (bool, int, float, str, type(None))
MOST_TABLES = 500  # to look for footprints in one of 3,000 took half a minute
_INDEX = "rtree"  # the one kind of virtual table that a GeoPackage has


@dataclass(frozen=True)
class VectorWork:
    """Request to read a file."""

    path: str
    form: str  # GeoPackage or Shapefile
    height_column: str | None


def read_table(work: VectorWork) -> Iterator[FootprintTable]:
    """Read a file's footprints: yield one table."""
    path, form = Path(work.path), work.form
    pyogrio = need("pyogrio", "gis", form)
    raw = need("pyogrio.raw", "gis", form)
    shapely = need("shapely", "gis", form)
    if form == "GeoPackage":
        check_schema(path)
    try:
        name, notes = _choose_table(pyogrio, path, work.height_column)
        meta, _, geometry, fields = raw.read(path, layer=name)
        shapes = shapely.from_wkb(geometry)
    except (InputError, MemoryError):
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
        notes.append(NO_CRS)
    columns = {
        str(field): _plain(values) for field, values in zip(meta["fields"], fields, strict=True)
    }
    rings: Rings = from_shapes(shapely, polygons, row)
    yield FootprintTable(form, rings, [None] * len(shapes), columns, crs, tuple(notes))


def check_schema(path: Path) -> None:
    """
    Refuse a database that would compute what it shows: views, and virtual tables but indices.

    Their definitions are read, none is run.
    """
    uri = f"{path.as_uri()}?mode=ro&immutable=1"
    query = "SELECT type, name, sql FROM sqlite_master WHERE type = 'view' OR sql LIKE '%virtual%'"
    try:
        with closing(sqlite3.connect(uri, uri=True)) as store:
            store.execute("PRAGMA trusted_schema = OFF")
            entries = store.execute(query).fetchall()
            views = [name for kind, name, _ in entries if kind == "view"]
            # A view in place of a table of the format itself would run where names are looked up.
            is_own = any(name.casefold().startswith("gpkg_") for name in views)
            names = [] if is_own else store.execute("SELECT table_name FROM gpkg_contents")
            tables = {str(name) for (name,) in names}
    except sqlite3.Error as error:
        msg = (
            f"cannot be read as GeoPackage ({' '.join(str(error).split())[:120]}); export it again"
        )
        raise InputError(msg) from error
    views = [name for name in views if is_own or name in tables]
    if len(tables) > MOST_TABLES:
        msg = (
            f"has {len(tables):,} tables, of which one is read; export the one you mean (ogr2ogr "
            f"one.gpkg {path.name} TABLE)"
        )
        raise InputError(msg, count=len(tables))
    if views:
        msg = (
            f"has layers that are views, which are not read: {len(views)} (first: "
            f"'{views[0][:60]}'); export the layer as a table (ogr2ogr OUT.gpkg {path.name} "
            f"{views[0][:60]})"
        )
        raise InputError(msg, views=views)
    for kind, name, text in entries:
        words = " ".join(str(text).casefold().split()).partition(" using ")[2]
        if kind == "table" and words and not words.startswith(_INDEX):
            msg = f"has a virtual table '{name[:60]}', which is not read; export it again without"
            raise InputError(msg, table=name)


def _choose_table(pyogrio: Any, path: Path, height_column: str | None) -> tuple[str, list[str]]:
    """Choose the table of polygons; of several the one that has the heights."""
    layers = [
        (str(name), pyogrio.read_info(path, layer=name)) for name, _ in pyogrio.list_layers(path)
    ]
    names = [name for name, info in layers if _may_hold_polygons(info["geometry_type"])]
    if not names:
        msg = "has no table of polygons; give a file of building footprints"
        raise InputError(msg)
    wanted = {height_column.casefold()} if height_column else set(HEIGHTS)
    having = [
        name
        for name, info in layers
        if name in names and any(has_height(str(field), wanted) for field in info["fields"])
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
    """Return Python values, None for null; times and bytes as text."""
    if values.dtype.kind in "mM":
        values = values.astype(str)
    return [
        None if isinstance(v, float) and math.isnan(v) else v if isinstance(v, _VALUES) else str(v)
        for v in values.tolist()
    ]
