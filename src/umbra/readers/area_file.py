"""
Files of named areas: polygons with holes, of GeoJSON, GeoPackage, Shapefile or DXF.

GeoJSON says seldom in which coordinates it is: polygons that lie at the model when they are read as
the model's own coordinates are, unless they would be a few centimetres large; others are degrees.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.checks import errors_of, find_reason
from umbra.readers.child import ReadingChild
from umbra.readers.content import FileContent
from umbra.readers.footprint_files import tabulate_geojson, tabulate_vectors
from umbra.readers.footprint_table import IDS, NAMES, FootprintTable
from umbra.readers.footprints import to_shapes
from umbra.readers.formats import parse_documents
from umbra.readers.georeference import is_known_crs, is_same_plan, show_crs
from umbra.readers.model import ReadChoices
from umbra.scene import Scene
from umbra.scene.named_places import Area

__all__ = [
    "FARTHEST", "AreaFile", "check_polygon", "find_move", "load_areas", "place_areas",
    "read_areas",
]  # fmt: skip

FARTHEST = 2_000.0
"""Distance from the model beyond which an area is not of its place [m]."""
_SMALL = 0.1  # all areas in so few metres are degrees: of some 10 km
_DEGREES = "OGC:CRS84"
_FORMS = "GeoJSON, GeoPackage (.gpkg), Shapefile (.shp) or DXF"
_DRAWING = "DXF"
_DXF = (b"0\nSECTION", b"0\r\nSECTION", b"999")


@dataclass(frozen=True, eq=False)
class AreaFile:
    """
    Polygons of a file in its own coordinates.

    Parameters
    ----------
    path : Path
    areas : tuple of Area
    crs : str, optional
        That the file names.
    is_guess : bool
        Whether the CRS is taken only because the numbers could be degrees.
    notes : tuple of str
    """

    path: Path
    areas: tuple[Area, ...]
    crs: str | None
    is_guess: bool
    notes: tuple[str, ...] = ()


def read_areas(path: Path | str, scene: Scene) -> tuple[list[Area], list[str]]:
    """
    Read the named areas of a file, in the coordinates of a model.

    Parameters
    ----------
    path : path
        GeoJSON, GeoPackage, Shapefile or DXF.
    scene : Scene

    Returns
    -------
    areas : list of Area
    notes : list of str
        In which coordinates the file was taken, and what was left out.

    Raises
    ------
    InputError
        If it cannot be read, holds no polygon, two areas of one name or an invalid polygon, or
        lies elsewhere.
    """
    return place_areas(load_areas(path), scene)


def load_areas(path: Path | str) -> AreaFile:
    """Read the named areas of a file in its own coordinates, see `read_areas`."""
    file = Path(path)
    shapely = need("shapely", "gis", "areas")
    try:
        content = FileContent(file)
    except (OSError, ValueError) as error:  # ValueError: a name with a null byte
        reason = (getattr(error, "strerror", None) or "").lower() or str(error)
        msg = f"{file}: {reason}; name a file of areas ({_FORMS})"
        raise InputError(msg, option="areas", path=file) from None
    with errors_of(f"{file}: ", option="areas", path=file):
        if not content.head.strip():
            msg = f"is empty; give polygons as {_FORMS}"
            raise InputError(msg)
        table, is_guess = _tabulate(content, file)
        if not len(table.rings.feature):
            left = f" ({'; '.join(table.notes)})" if table.notes else ""
            msg = f"holds no polygon{left}; give areas as polygons"
            raise InputError(msg)
        areas = make_areas(shapely, table, file.name.partition(".")[0])
        # The coordinates in which the areas are taken are reported below.
        table_notes = (
            note for note in table.notes if "CRS" not in note and "not degrees" not in note
        )
        notes = tuple(note.replace("footprints", "areas") for note in table_notes)
        return AreaFile(file, areas, table.crs, is_guess, notes)


def _tabulate(content: FileContent, path: Path) -> tuple[FootprintTable, bool]:
    """Read the polygons and columns of a file; also whether its CRS is a guess."""
    choices = ReadChoices()
    choices.budget.grow(path.resolve(), content.size)
    start = content.head.lstrip(b"\xef\xbb\xbf \t\r\n")
    if start.startswith(b"{"):
        documents = parse_documents(content.data, path)
        head = documents[0]
        if not isinstance(head, dict) or str(head.get("type")) not in _GEOJSON:
            msg = "is JSON, but no GeoJSON; give polygons in a FeatureCollection"
            raise InputError(msg)
        table = tabulate_geojson(documents, choices.budget)
        return table, table.crs == _DEGREES and not isinstance(head.get("crs"), dict)
    if start.startswith(b"SQLite format 3") or content.head[:4] == b"\x00\x00\x27\x0a":
        table, _ = tabulate_vectors(content, path, choices)
        return table, False
    if path.suffix.lower() == ".dxf" or start.startswith(_DXF):
        need("ezdxf", "dxf", "DXF")
        child = ReadingChild(
            "umbra.readers.area_dxf:read_outlines", str(path.absolute()),
            choices.budget.limit_child(),
        )  # fmt: skip
        tables = list(child)
        if not child.is_done or not tables:
            error = child.make_error(_DRAWING, "save it again")
            raise error
        return tables[0], False
    msg = f"is not a file of areas; give polygons as {_FORMS}"
    raise InputError(msg)


_GEOJSON = {"FeatureCollection", "Feature", "GeometryCollection", "MultiPolygon", "Polygon"}


def make_areas(shapely: Any, table: FootprintTable, stem: str = "") -> tuple[Area, ...]:
    """Make an area of each feature of a table of a file; refuse invalid ones, and equal names."""
    rings = table.rings
    if not np.isfinite(rings.points).all():
        row = rings.feature[rings.polygon[np.repeat(  # of the ring of the first such corner
            np.arange(len(rings.lengths)), rings.lengths
        )[~np.isfinite(rings.points).all(1)][0]]]  # fmt: skip
        msg = f"feature {row + 1} has a corner that is not finite; correct it"
        raise InputError(msg, feature=int(row) + 1)
    short = np.flatnonzero(rings.lengths < 3)
    rows = np.unique(rings.feature).tolist()
    names = _name_areas(table, rows, stem)
    _refuse_twice(names, rows)
    if len(short):
        row = int(rings.feature[rings.polygon[short[0]]])
        msg = f"the area '{names[row]}' has a ring of fewer than three corners; correct it"
        raise InputError(msg, area=names[row])
    shapes = to_shapes(shapely, rings)
    areas = []
    for row in rows:
        parts = shapes[rings.feature == row]
        polygon = parts[0] if len(parts) == 1 else shapely.multipolygons(parts)
        check_polygon(shapely, names[row], polygon)
        given = {
            key: column[row] for key, column in table.columns.items() if column[row] is not None
        }
        areas.append(Area(names[row], polygon, given))
    return tuple(areas)


def check_polygon(shapely: Any, name: str, polygon: Any) -> None:
    """Refuse what is no polygon, one that crosses itself, or has no area."""
    if getattr(polygon, "geom_type", None) not in ("Polygon", "MultiPolygon"):
        msg = f"the area '{name}' is not a polygon; give shapely's Polygon or MultiPolygon"
        raise InputError(msg, option="areas", area=name)
    if not shapely.is_valid(polygon):
        reason = find_reason(Exception(shapely.is_valid_reason(polygon)))
        msg = (
            f"the area '{name}' is not a valid polygon ({reason}); repair it (QGIS: Fix "
            "geometries, shapely.make_valid)"
        )
        raise InputError(msg, option="areas", area=name, reason=reason)
    if not polygon.area > 0:
        msg = f"the area '{name}' has no area; give its corners around it"
        raise InputError(msg, option="areas", area=name)


def _name_areas(table: FootprintTable, rows: Sequence[int], stem: str) -> dict[int, str]:
    """
    Name each feature: by a column of names, the features' own ids, a column of ids, in order.

    A file's only feature without a name has the file's, its ``stem``.
    """
    columns = {column.casefold(): column for column in reversed(table.columns)}
    column = next((columns[word] for word in NAMES if word in columns), None)
    if column is None and not any(table.names):
        column = next((columns[word] for word in IDS if word in columns), None)
    words = table.names if column is None else table.columns[column]
    names = {}
    for n, row in enumerate(rows, 1):
        word = words[row]
        if isinstance(word, float) and word.is_integer():
            word = int(word)
        text = "" if word is None else str(word).strip().replace("\0", "\ufffd")
        names[row] = text or (stem if stem and len(rows) == 1 else f"area {n}")
    return names


def _refuse_twice(names: dict[int, str], rows: Sequence[int]) -> None:
    """Refuse two areas of one name."""
    counts = Counter(names.values())
    word, count = counts.most_common(1)[0]
    if count > 1:
        of = [str(row + 1) for row in rows if names[row] == word][:2]
        msg = (
            f"{count} areas are called '{word}' (first: features {' and '.join(of)}); give each a "
            "name of its own, or join them in one MultiPolygon"
        )
        raise InputError(msg, area=word, count=count)


def place_areas(file: AreaFile, scene: Scene) -> tuple[list[Area], list[str]]:
    """Bring the areas of a file to the coordinates of a model; refuse those that lie elsewhere."""
    shapely = need("shapely", "gis", "areas")
    name, bounds = file.path.name, scene.model_bounds()[:, :2]
    shapes = np.array([area.polygon for area in file.areas])
    plain = measure_distances(shapely, shapes, bounds)
    crs, notes = file.crs, list(file.notes)
    moved = None
    is_small = np.ptp(shapely.total_bounds(shapes).reshape(2, 2), axis=0).max() < _SMALL
    if crs is not None and not (file.is_guess and (plain <= FARTHEST).any() and not is_small):
        moved = _bring(shapely, shapes, crs, scene, name)
    if moved is None:
        notes.append(f"{name}: areas are taken in the model's own coordinates")
        shapes = shapes.copy()
    else:
        shapes = moved
        if scene.crs is None or not is_same_plan(str(crs), scene.crs):
            goal = show_crs(scene.crs) if scene.crs else "the model's plan about its site"
            axes = " (longitude and latitude, WGS 84)" if crs == _DEGREES else ""
            notes.append(f"{name}: areas are in {show_crs(str(crs))}{axes}, brought to {goal}")
    away = measure_distances(shapely, shapes, bounds)
    far = np.flatnonzero(~(away <= FARTHEST))
    if len(far):
        first = file.areas[far[0]].name
        which = (
            f"the area '{first}' lies"
            if len(far) == 1
            else (f"{len(far)} areas lie (first: '{first}')")
        )
        msg = (
            f"{file.path}: {which} {_tell_distance(away[far[0]])} from the model"
            f"{_tell_crs(file, scene)}; give areas of this place, in the model's coordinates or in "
            "degrees"
        )
        raise InputError(msg, option="areas", area=first, distance=float(away[far[0]]))
    areas = [replace(a, polygon=p) for a, p in zip(file.areas, shapes, strict=True)]
    return areas, notes


def measure_distances(
    shapely: Any, shapes: NDArray[Any], bounds: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distance of each polygon from a rectangle (2, 2) [m]."""
    (west, south), (east, north) = bounds
    return np.asarray(shapely.distance(shapes, shapely.box(west, south, east, north)))


def _bring(
    shapely: Any, shapes: NDArray[Any], crs: str, scene: Scene, name: str
) -> NDArray[Any] | None:
    """Return polygons in a model's coordinates; None if they are so already."""
    move = find_move(crs, scene, name)
    return None if move is None else np.asarray(shapely.transform(shapes, move))


def find_move(
    crs: str, scene: Scene, name: str, option: str = "areas"
) -> Callable[[NDArray[np.float64]], NDArray[np.float64]] | None:
    """
    Find what brings points (n, 2) of a CRS to a model's coordinates; None if they are so already.

    Parameters
    ----------
    crs : str
    scene : Scene
    name : str
        Of the file.
    option : str
        Which names it; its word in errors, which are raised where points cannot be brought.
    """
    if scene.crs is not None and is_same_plan(crs, scene.crs):
        return None
    if scene.crs is not None and is_known_crs(scene.crs):
        target, turn = scene.crs, 0.0
    elif scene.latitude is not None and scene.longitude is not None:
        # A model with a site and no CRS: its plan about the site, turned to its north.
        target = f"+proj=aeqd +lat_0={scene.latitude} +lon_0={scene.longitude} +datum=WGS84"
        turn = math.radians(scene.true_north or 0.0)
    else:
        msg = (
            f"{name}: {option} are in {show_crs(crs)} and the model names no CRS; name it with "
            f"crs=, or give {option} in the model's own coordinates"
        )
        raise InputError(msg, option=option, crs=crs)
    if not is_known_crs(crs):
        msg = (
            f"{name}: the CRS '{show_crs(crs)[:60]}' is not known; convert {option} to the model's"
        )
        raise InputError(msg, option=option, crs=crs)
    from pyproj import CRS, Transformer  # noqa: PLC0415 - 0.1 s, only with a CRS

    flat, goal = (CRS.from_user_input(system).to_2d() for system in (crs, target))
    there = Transformer.from_crs(flat, goal, always_xy=True)

    def move(points: NDArray[np.float64]) -> NDArray[np.float64]:
        east, north = there.transform(*points.T)
        cos, sin = math.cos(turn), math.sin(turn)
        moved = np.stack([cos * east + sin * north, cos * north - sin * east], 1)
        if not np.isfinite(moved).all():
            msg = f"{name}: {option} lie outside the area where {show_crs(target)} is used"
            raise InputError(msg, option=option, crs=(crs, target))
        return moved

    return move


def _tell_distance(away: float) -> str:
    return f"{away / 1000:,.0f} km" if away >= 10_000 else f"{away:,.0f} m"


def _tell_crs(file: AreaFile, scene: Scene) -> str:
    """Tell the coordinates of both."""
    own = show_crs(file.crs) if file.crs else "no CRS"
    return f" (its CRS: {own}; the model's: {show_crs(scene.crs) if scene.crs else 'none'})"
