"""
Files of streets, green and water to be drawn under a plan: GeoJSON, GeoPackage, Shapefile, DXF.

Nothing of them is counted. Coordinates are taken as those of named areas are
(`umbra.readers.area_file`).
"""

from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.area_file import FARTHEST, find_move
from umbra.readers.checks import errors_of
from umbra.readers.child import ReadingChild
from umbra.readers.content import FileContent
from umbra.readers.context_table import ContextTable, make_context_table, name_context_kind
from umbra.readers.footprint_files import FORMATS
from umbra.readers.formats import parse_documents
from umbra.readers.georeference import name_crs
from umbra.readers.model import ReadChoices
from umbra.readers.vector_tables import VectorWork
from umbra.scene import Scene

__all__ = ["Shape", "load_context", "place_context"]

_FORMS = "GeoJSON, GeoPackage (.gpkg), Shapefile (.shp) or DXF"
_DEGREES = "OGC:CRS84"
_DXF = (b"0\nSECTION", b"0\r\nSECTION", b"999")
_SHAPEFILE = b"\x00\x00\x27\x0a"
_DEPTH = 8  # of collections within collections


def load_context(path: Path | str) -> tuple[ContextTable, ...]:
    """
    Read the lines and polygons of a file in its own coordinates.

    Raises
    ------
    InputError
        If it cannot be read, or holds none.
    """
    file = Path(path)
    with suppress(OSError, ValueError):
        about = file.stat()
        return _load(file, about.st_mtime_ns, about.st_size)
    return _load(file, 0, 0)


@lru_cache(maxsize=1)  # checked with the options, drawn later
def _load(file: Path, _changed: int, _size: int) -> tuple[ContextTable, ...]:
    """Read a file, unless it is the one that was read last."""
    try:
        content = FileContent(file)
    except (OSError, ValueError) as error:  # ValueError: a name with a null byte
        reason = (getattr(error, "strerror", None) or "").lower() or str(error)
        msg = f"{file}: {reason}; name a file of streets, green or water ({_FORMS})"
        raise InputError(msg, option="context", path=file) from None
    with errors_of(f"{file}: ", option="context", path=file):
        if not content.head.strip():
            msg = f"is empty; give lines or polygons as {_FORMS}"
            raise InputError(msg)
        tables = tuple(table for table in _tabulate(content, file) if len(table.lengths))
        if not tables:
            msg = f"holds no line and no polygon; give streets, green or water as {_FORMS}"
            raise InputError(msg)
        return tables


def _tabulate(content: FileContent, path: Path) -> list[ContextTable]:
    """Read the tables of a file, by its first bytes."""
    choices = ReadChoices()
    choices.budget.grow(path.resolve(), content.size)
    start = content.head.lstrip(b"\xef\xbb\xbf \t\r\n")
    if start.startswith(b"{"):
        return [_read_geojson(parse_documents(content.data, path), path.stem)]
    if start.startswith(b"SQLite format 3") or content.head[:4] == _SHAPEFILE:
        form = "GeoPackage" if start.startswith(b"SQLite") else FORMATS[".shp"]
        need("pyogrio", "gis", form)
        work: Any = VectorWork(str(path.absolute()), form, None)
        target = "umbra.readers.context_vectors:read_layers"
    elif path.suffix.lower() == ".dxf" or start.startswith(_DXF):
        form = "DXF"
        need("ezdxf", "dxf", form)
        work, target = str(path.absolute()), "umbra.readers.context_dxf:read_drawing"
    else:
        msg = f"is not a file of streets, green or water; give lines or polygons as {_FORMS}"
        raise InputError(msg)
    child = ReadingChild(target, work, choices.budget.limit_child())
    tables = list(child)
    if not child.is_done:
        error = child.make_error(form, "export it again")
        raise error
    return tables


def _read_geojson(documents: list[Any], stem: str) -> ContextTable:
    """Return the lines of parsed GeoJSON."""
    lines: list[tuple[Any, bool, int]] = []
    kinds: list[str] = []
    for document in documents:
        for feature in _list_features(document):
            row = len(kinds)
            try:
                found = list(_list_lines(feature.get("geometry"), row))
                for line, _, _ in found:
                    _ = line[0][1]
            except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
                msg = f"feature {row + 1} has damaged coordinates; repair it or export it again"
                raise InputError(msg, feature=row + 1) from error
            columns = feature.get("properties")
            lines += found
            kinds.append(name_context_kind(columns if isinstance(columns, dict) else {}, stem))
    named = documents[0].get("crs") if isinstance(documents[0], dict) else None
    properties = named.get("properties") if isinstance(named, dict) else None
    crs = name_crs(properties.get("name")) if isinstance(properties, dict) else None
    table = make_context_table(lines, kinds)
    is_guess = crs is None and not (np.abs(table.points) > [180.0, 90.0]).any()
    return ContextTable(
        table.points, table.lengths, table.is_ring, table.feature, table.kinds,
        _DEGREES if is_guess else crs, is_guess,
    )  # fmt: skip


def _list_features(document: Any) -> list[Any]:
    kind = document.get("type") if isinstance(document, dict) else None
    if kind == "FeatureCollection":
        features = document.get("features")
        if isinstance(features, list) and all(isinstance(one, dict) for one in features):
            return features
    elif kind == "Feature":
        return [document]
    elif str(kind).endswith(("Polygon", "LineString", "GeometryCollection")):
        return [{"type": "Feature", "geometry": document}]
    msg = "is JSON, but no GeoJSON; give lines or polygons in a FeatureCollection"
    raise InputError(msg)


def _list_lines(geometry: Any, row: int, depth: int = 0) -> Iterator[tuple[Any, bool, int]]:
    """List the lines and rings of a geometry; points are none."""
    if geometry is None or depth > _DEPTH:
        return
    kind = geometry["type"]
    if kind == "GeometryCollection":
        for one in geometry["geometries"]:
            yield from _list_lines(one, row, depth + 1)
    elif kind == "LineString":
        yield geometry["coordinates"], False, row
    elif kind == "MultiLineString":
        yield from ((line, False, row) for line in geometry["coordinates"])
    elif kind == "Polygon":
        yield from ((ring, True, row) for ring in geometry["coordinates"])
    elif kind == "MultiPolygon":
        yield from ((ring, True, row) for rings in geometry["coordinates"] for ring in rings)


Shape = tuple[str, list[NDArray[np.float64]], list[NDArray[np.float64]]]


def place_context(tables: tuple[ContextTable, ...], path: Path, scene: Scene) -> list[Shape]:
    """
    Bring a file's lines to a model's coordinates: the kind, rings and lines of each feature.

    Raises
    ------
    InputError
        If all lies away from the model, or in a CRS that cannot be brought to the model's.
    """
    low, high = scene.model_bounds()[:, :2]
    shapes: list[Shape] = []
    nearest = np.inf
    for table in tables:
        points = _bring(table, path, scene, (low, high))
        nearest = min(nearest, _measure_nearest(points, low, high))
        pieces = np.split(points, np.cumsum(table.lengths)[:-1])
        of: dict[int, Shape] = {}
        for piece, is_ring, feature in zip(
            pieces, table.is_ring.tolist(), table.feature.tolist(), strict=True
        ):
            _, rings, lines = of.setdefault(feature, (table.kinds[feature], [], []))
            (rings if is_ring else lines).append(piece)
        shapes += of.values()
    if not nearest <= FARTHEST:
        msg = (
            f"{path}: all of it lies {nearest / 1000:,.0f} km from the model; give streets, green "
            "and water of this place, in the model's coordinates or in degrees"
        )
        raise InputError(msg, option="context", distance=nearest)
    return shapes


def _bring(
    table: ContextTable,
    path: Path,
    scene: Scene,
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> NDArray[np.float64]:
    """Return a table's points in a model's coordinates; they are degrees if those are at it."""
    points = table.points
    if table.crs is None:
        return points
    is_near = table.is_guess and _measure_nearest(points, *box) <= FARTHEST
    try:
        move = find_move(table.crs, scene, path.name, "context")
        moved = points if move is None else move(points)
    except InputError:
        if is_near:
            return points
        raise
    return points if is_near and not _measure_nearest(moved, *box) <= FARTHEST else moved


def _measure_nearest(
    points: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> float:
    """Return the distance of the nearest point from a rectangle; infinite if none is finite."""
    away = np.hypot(*np.maximum(np.maximum(low - points, points - high), 0).T)
    return float(np.nanmin(away)) if np.isfinite(away).any() else float("inf")
