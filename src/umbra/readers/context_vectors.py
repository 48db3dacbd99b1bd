"""
pyogrio on one GeoPackage or Shapefile: all its lines and polygons, of all its layers.

This runs in a child process (`umbra.readers.context_file`), as `umbra.readers.vector_tables` does.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.checks import find_reason
from umbra.readers.context_table import ContextTable, make_context_table, name_context_kind
from umbra.readers.georeference import name_crs
from umbra.readers.vector_tables import VectorWork, check_schema

__all__ = ["ContextTable", "VectorWork", "read_layers"]

_LINE, _RING, _POLYGON = 1, 2, 3  # shapely's numbers


def read_layers(work: VectorWork) -> Iterator[ContextTable]:
    """Read a file's lines and polygons: yield a table of each layer that has some."""
    path, form = Path(work.path), work.form
    pyogrio = need("pyogrio", "gis", form)
    raw = need("pyogrio.raw", "gis", form)
    shapely = need("shapely", "gis", form)
    if form == "GeoPackage":
        check_schema(path)
    try:
        layers = [(str(name), kind) for name, kind in pyogrio.list_layers(path)]
        for name, kind in layers:
            if kind is None:
                continue
            meta, _, geometry, fields = raw.read(path, layer=name)
            columns = dict(zip(map(str, meta["fields"]), fields, strict=True))
            rows = [{key: _plain(column[row]) for key, column in columns.items()}
                    for row in range(len(geometry))]  # fmt: skip
            kinds = [name_context_kind(row, name, path.stem) for row in rows]
            lines = list(_list_lines(shapely, shapely.from_wkb(geometry)))
            yield make_context_table(lines, kinds, name_crs(meta["crs"]))
    except (InputError, MemoryError):
        raise
    except Exception as error:  # GDAL raises many kinds
        msg = f"cannot be read as {form} ({find_reason(error, 200)}); export it again"
        raise InputError(msg) from error


def _plain(value: Any) -> Any:
    return None if value is None or value != value else str(value)  # noqa: PLR0124  (NaN)


def _list_lines(shapely: Any, shapes: Any) -> Iterator[tuple[Any, bool, int]]:
    """List the lines and rings of shapes, each with the index of its shape."""
    for row, shape in enumerate(shapes):
        if shape is None:
            continue
        parts = shapely.get_parts(shape)
        while any(shapely.get_type_id(part) > _POLYGON for part in parts):  # nested collections
            parts = shapely.get_parts(parts)
        for part in parts:
            kind = shapely.get_type_id(part)
            if kind in (_LINE, _RING):
                yield shapely.get_coordinates(part).tolist(), kind == _RING, row
            elif kind == _POLYGON:
                for ring in shapely.get_rings(part):
                    yield shapely.get_coordinates(ring).tolist(), True, row
