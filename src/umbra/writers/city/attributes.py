"""Hours of a city's surfaces as attributes of its CityJSON files."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from umbra.folders.atomic import replace_file
from umbra.writers.city.surfaces import CitySurfaces, SurfaceRun, read_triangles
from umbra.writers.cityjson_hours import (
    MeasuredObject,
    add_hours,
    check_source,
    find_cityjson,
    group_objects,
    name_targets,
)

__all__ = ["write_city_attributes"]

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
    named = [replace(one.sources[0], layer=one.layer) for one in result.catalogue.files]
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
