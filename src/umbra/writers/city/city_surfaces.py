"""
The surfaces of a study in tiles: results of the store, and shapes of the tiles' pieces.

Hours of a city's surfaces as attributes of its CityJSON files.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.folders.atomic import replace_file
from umbra.tiles.city_catalogue import Catalogue, read_catalogue
from umbra.tiles.sealed import read_sealed
from umbra.tiles.surface_pieces import SurfacePieces, name_objects
from umbra.writers.city.store_window import make_damage, open_store, read_stored_array
from umbra.writers.cityjson_hours import (
    MeasuredObject,
    add_hours,
    check_source,
    find_cityjson,
    group_objects,
    name_targets,
)
from umbra.writers.vectors.surface_table import (
    ROWS,
    list_figures,
    pack_triangles,
    write_surface_table,
)

__all__ = [
    "CitySurfaces",
    "SurfaceRun",
    "cut_runs",
    "read_triangles",
    "write_city_attributes",
    "write_surfaces",
]


@dataclass(frozen=True)
class SurfaceRun:
    """
    A run of whole parts.

    Parameters
    ----------
    parts, samples, surfaces, triangles : slice
        Rows of each, in the order of files and parts.
    """

    parts: slice
    samples: slice
    surfaces: slice
    triangles: slice


class CitySurfaces:
    """
    Surfaces of a study in tiles.

    Parameters
    ----------
    folder : Path
        With the store, the catalogue, and the tiles' pieces.

    Raises
    ------
    InputError
        If it holds no such study, or not all tiles are done.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.group: Any = open_store(folder)
        self.facts = dict(self.group.attrs)
        known = read_sealed(folder / "city.json", orjson.OPT_INDENT_2)
        if known is None:
            raise make_damage(folder / "city.json")
        self.origin = np.array(known["frame"]["origin"])
        self.bounds = np.array(known["frame"]["bounds"])

    @cached_property
    def catalogue(self) -> Catalogue:
        """The city's files."""
        return read_catalogue(self.folder / "catalogue")

    @cached_property
    def folders(self) -> list[Path]:
        """Folders of the tiles that hold surfaces."""
        return sorted(path for path in (self.folder / "tiles").glob("[0-9]*") if path.is_dir())

    @cached_property
    def pieces(self) -> SurfacePieces:
        """SurfacePieces of all tiles."""
        return SurfacePieces(self.folders)

    @cached_property
    def days(self) -> NDArray[np.datetime64]:
        """Dates by which results are kept; none if only sums are."""
        if "surface_mean_sun_hours_by_day" not in self.group:
            return np.zeros(0, "datetime64[us]")
        return read_stored_array(self.group, "day").astype("datetime64[us]")

    @cached_property
    def times(self) -> NDArray[np.datetime64]:
        """Instants in UTC."""
        return read_stored_array(self.group, "time").astype("datetime64[us]")

    @cached_property
    def up_hours(self) -> float:
        """Time with the sun up in the whole period [h]."""
        hours = (
            read_stored_array(self.group, name, slice(1)) for name in ("shadow_hours", "sun_hours")
        )
        return sum(float(times[0]) for times in hours)

    def name_parts(self, pieces: SurfacePieces, parts: slice) -> NDArray:
        """Return the name of the object of each part."""
        objects, own = np.unique(pieces.owner[parts], return_inverse=True)
        return name_objects(self.catalogue, pieces.objects[objects])[own.ravel()]

    def list_rows(self, pieces: SurfacePieces, run: SurfaceRun) -> dict[str, NDArray]:
        """Return the columns of a run's surfaces: part, kind and figures."""
        names = np.repeat(self.name_parts(pieces, run.parts), pieces.keys[run.parts, 4])
        kinds = pieces.read("surface_kind", run.surfaces.start, run.surfaces.stop)
        columns = {"part": names.astype(object), "kind": kinds.astype(object)}
        return columns | self.list_figures(pieces, run)

    def list_figures(self, pieces: SurfacePieces, run: SurfaceRun) -> dict[str, NDArray]:
        """Return the figures of a run's surfaces."""
        surfaces = run.surfaces
        return list_figures(
            lambda name: pieces.read(name, surfaces.start, surfaces.stop), self.days, self.facts
        )


def cut_runs(pieces: SurfacePieces, most: int, axis: str = "surface") -> Iterator[SurfaceRun]:
    """
    Cut the parts of pieces into runs.

    Parameters
    ----------
    pieces : SurfacePieces
    most : int
        Rows of a run along an axis, unless one part has more.
    axis : {'sample', 'surface', 'triangle'}
    """
    columns = {"sample": 3, "surface": 4, "triangle": 5}
    ends = {name: np.cumsum(pieces.keys[:, column]) for name, column in columns.items()}
    first, count = 0, len(pieces.keys)
    while first < count:
        begin = {name: int(end[first - 1]) if first else 0 for name, end in ends.items()}
        after = int(np.searchsorted(ends[axis], begin[axis] + most, "right"))
        stop = max(first + 1, after)
        rows = {name: slice(begin[name], int(end[stop - 1])) for name, end in ends.items()}
        yield SurfaceRun(slice(first, stop), rows["sample"], rows["surface"], rows["triangle"])
        first = stop


def write_surfaces(result: CitySurfaces) -> Path:
    """Write ``surfaces.parquet``: a row for each surface, as for a study in memory."""
    path = result.folder / "surfaces.parquet"
    with replace_file(path) as beside:
        write_surface_table(beside, _find_groups(result), result.facts.get("crs"), result.facts)
    return path


def _find_groups(result: CitySurfaces) -> Iterator[tuple[dict[str, NDArray], list[bytes]]]:
    """Yield columns and geometries of some surfaces at a time."""
    pieces = result.pieces
    for run in cut_runs(pieces, ROWS):
        corners, starts = read_triangles(pieces, run)
        packed = pack_triangles(corners + result.origin, starts)
        yield result.list_rows(pieces, run), packed


def read_triangles(
    pieces: SurfacePieces, run: SurfaceRun
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return corners (n, 3, 3) in the local frame [m], and the first triangle of each surface."""
    span = run.triangles.start, run.triangles.stop
    corners = pieces.read("triangle_corners", *span)
    owner = pieces.read("surface_of_triangle", *span)
    surfaces = np.arange(run.surfaces.start, run.surfaces.stop + 1)
    return corners, np.searchsorted(owner, surfaces)


_FOLDER = "cityjson"


def write_city_attributes(
    result: CitySurfaces, say: Callable[[str], object] = lambda _line: None
) -> list[Path]:
    """
    Write each CityJSON file of a city again with hours, one file in memory at a time.

    Parameters
    ----------
    result : CitySurfaces
    say : callable
        Called with what has no hours, and why.

    Returns
    -------
    paths : list of Path
    """
    # Each was read alone, and so without its layer.
    named = [replace(file.sources[0], layer=file.layer) for file in result.catalogue.files]
    files = dict(zip(map(id, named), result.catalogue.files, strict=True))
    written = []
    sources = find_cityjson(named)
    for source, name in zip(sources, name_targets(sources), strict=True):
        file = files[id(source)]
        path = result.folder / _FOLDER / name
        with replace_file(path) as beside:
            notes = add_hours(check_source(source), beside, _find_objects(result, file.number))
        for note in notes:
            say(f"note: {path.name}: {note}")
        written.append(path)
    return written


def _find_objects(result: CitySurfaces, number: int) -> dict[str, MeasuredObject]:
    """Return what was measured on the objects of a file."""
    pieces = result.pieces
    keys = pieces.keys
    parts = slice(*np.searchsorted(keys[:, 0], [number, number + 1]).tolist())
    if parts.start == parts.stop:
        return {}
    ends = np.cumsum(keys[:, 3:], axis=0)
    begins = ends - keys[:, 3:]
    samples, surfaces, triangles = (
        slice(int(begins[parts.start, k]), int(ends[parts.stop - 1, k])) for k in range(3)
    )
    run = SurfaceRun(parts, samples, surfaces, triangles)
    known = np.array(result.catalogue.files[number].words["names"])
    names = np.repeat(known[keys[parts, 1]], keys[parts, 4])
    corners, starts = read_triangles(pieces, run)
    owner = np.repeat(np.arange(len(names)), np.diff(starts))
    return group_objects(names, corners + result.origin, owner, result.list_figures(pieces, run))
