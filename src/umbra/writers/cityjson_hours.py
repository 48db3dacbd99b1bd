"""
Hours as attributes of a CityJSON file: of its semantic surfaces, and of its city objects.

The file is written again with everything that it holds. Its polygons are cut into triangles as they
were for the study, and found again among the study's triangles by their corners. A surface's
figures are those of the flat surface that the study measured; a polygon that the study left out,
such as a floor, gets none.
"""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from umbra.errors import InputError
from umbra.readers.cityjson import Templates, place_vertices
from umbra.readers.cityjson_choice import (
    DEPTHS,
    Choice,
    choose_geometries,
    flatten,
    walk_values,
)
from umbra.readers.formats import parse_documents
from umbra.readers.model import UniqueNames
from umbra.readers.triangulate import triangulate
from umbra.scene import Source

__all__ = [
    "MeasuredObject",
    "add_hours",
    "check_source",
    "find_cityjson",
    "group_objects",
    "name_targets",
]

_NEAR = 1e-4
"""A corner of the study lies at most this far from the file's [m]."""
_DIGITS = {"azimuth": 2, "tilt": 2, "area": 3}


@dataclass(frozen=True, eq=False)
class MeasuredObject:
    """
    Surfaces that were measured on one object.

    Parameters
    ----------
    corners : (n, 3, 3) float64
        Triangles, in the file's own coordinates [m].
    surface : (n,) int
        Surface of each triangle.
    columns : mapping
        Figures of each surface by name: ``azimuth``, ``tilt``, ``area``, and hours that begin with
        ``mean``, ``least`` or ``most``.
    """

    corners: NDArray[np.float64]
    surface: NDArray[np.integer]
    columns: Mapping[str, NDArray]


_LONGEST = 200
"""Most bytes of a file's name without number and ending; file systems take 255 in all."""


def name_targets(sources: Sequence[Source]) -> list[str]:
    """Name the file of each source with hours by its layer; files that share one are numbered."""
    unique, names = UniqueNames(ignores_case=True), []
    for source in sources:
        stem = f"hours_{source.layer}" if source.layer else "hours"
        stem = re.sub(r'[\x00-\x1f/\\:*?"<>|]', "_", stem)
        stem = stem.encode("utf-8", "replace")[:_LONGEST].decode("utf-8", "ignore")
        ending = "jsonl" if source.format.startswith("CityJSONSeq") else "json"
        names.append(f"{unique.add(stem)}.city.{ending}")
    return names


def find_cityjson(sources: Sequence[Source]) -> list[Source]:
    """
    Find the files of a scene that can be written again with hours.

    Raises
    ------
    InputError
        If there is none.
    """
    named = [source for source in sources if not source.is_companion]
    writable = [source for source in named if source.format.startswith("CityJSON")]
    if not writable:
        first = f"{named[0].name} is {named[0].format}" if named else "there is no file"
        msg = (
            f"write='cityjson' adds hours to the CityJSON files of a study, and {first}; write "
            "'geoparquet' or '3dtiles', or convert the model to CityJSON first"
        )
        raise InputError(msg, option="write")
    return writable


def check_source(source: Source) -> Path:
    """
    Return the path of a file that was read; refuse one that has changed since.

    Raises
    ------
    InputError
    """
    path = Path(source.path)
    try:
        digest = sha256(path.read_bytes()).hexdigest() if source.path else ""
    except OSError:
        digest = ""
    if digest != source.sha256:
        msg = (
            f"{source.path or source.name} is gone, or not as it was when it was read, and "
            "write='cityjson' adds hours to it; put it back, or count again"
        )
        raise InputError(msg, option="write", path=path)
    return path


def group_objects(
    names: NDArray,
    corners: NDArray[np.float64],
    owner: NDArray[np.integer],
    columns: Mapping[str, NDArray],
) -> dict[str, MeasuredObject]:
    """
    Group surfaces by the objects that they belong to.

    Parameters
    ----------
    names : (n,) str
        Object of each surface.
    corners : (m, 3, 3) float64
    owner : (m,) int
        Surface of each triangle.
    columns : mapping
        Figures of each surface.
    """
    known, number = np.unique(names.astype(str), return_inverse=True)
    order = np.argsort(number, kind="stable")
    ends = np.cumsum(np.bincount(number, minlength=len(known)))
    position = np.zeros(len(number), np.int64)  # of a surface among its object's
    position[order] = np.arange(len(number)) - (ends - np.bincount(number))[number[order]]
    triangles = np.argsort(number[owner], kind="stable")
    lasts = np.cumsum(np.bincount(number[owner], minlength=len(known)))
    objects = {}
    for k, name in enumerate(known.tolist()):
        rows = order[ends[k - 1] if k else 0 : ends[k]]
        cut = triangles[lasts[k - 1] if k else 0 : lasts[k]]
        own = {key: values[rows] for key, values in columns.items()}
        objects[name] = MeasuredObject(corners[cut], position[owner[cut]], own)
    return objects


def add_hours(
    source: Path,
    target: Path,
    objects: Mapping[str, MeasuredObject],
    before: UniqueNames | None = None,
) -> list[str]:
    """
    Write a CityJSON file, or a sequence, again with hours as attributes.

    Parameters
    ----------
    source, target : Path
    objects : mapping
        By the names of the study's parts.
    before : UniqueNames, optional
        Names of the objects in earlier files of the layer, which the study's parts differ from.

    Returns
    -------
    notes : list of str
        What has no hours, and why.
    """
    documents = parse_documents(source.read_bytes(), source)
    counts: Counter[str] = Counter()
    own = UniqueNames()
    before = UniqueNames() if before is None else before
    transform, templates = None, Templates(None)
    for document in documents:
        if document.get("type") == "CityJSON":
            transform = document.get("transform")
            templates = Templates(document.get("geometry-templates"))
        _add_to_document(
            document, transform, templates, objects,
            lambda word: before.add(own.add(word)), counts,
        )  # fmt: skip
    with target.open("wb") as file:
        file.write(b"\n".join(map(orjson.dumps, documents)) + b"\n")
    return [f"{count:,} {what}" for what, count in counts.items()]


def _add_to_document(
    document: Any,
    transform: Any,
    templates: Templates,
    objects: Mapping[str, MeasuredObject],
    name_part: Callable[[str], str],
    counts: Counter[str],
) -> None:
    """Add attributes to the objects of a document."""
    raw = document.get("vertices", [])
    city_objects = document["CityObjects"]
    chosen = choose_geometries(city_objects, templates.shapes, raw, Counter())
    measured: list[tuple[Choice, MeasuredObject]] = []
    for name, choice in chosen.items():
        own = objects.get(name_part(name))
        if own is None:
            counts["objects were not measured"] += 1
            continue
        total = _sum_up(own.columns)
        city_objects[name].setdefault("attributes", {}).update(total)
        shape = choice.lender or choice.geometry  # that whose surfaces have meanings
        if shape.get("semantics"):
            measured.append((Choice(shape, shape), own))
        elif choice.shape is choice.geometry:
            counts["objects without semantic surfaces have hours of the whole object only"] += 1
        else:
            counts["objects of a template have hours of the whole object only"] += 1
    if measured:
        vertices = place_vertices(raw, transform, "")
        polygons = [polygon for choice, _ in measured for polygon in flatten(choice.shape)]
        matches = _match(vertices, polygons, measured)
        if not any(matches):
            what = "objects were read in other coordinates, and have hours of the whole object only"
            counts[what] += len(measured)
            return
        first = 0
        for choice, own in measured:
            count = len(flatten(choice.shape))
            _label(choice.geometry, matches[first : first + count], own.columns)
            first += count


def _match(
    vertices: NDArray[np.float64],
    polygons: Sequence[list[list[int]]],
    measured: Sequence[tuple[Choice, MeasuredObject]],
) -> list[tuple[int, ...]]:
    """Return the surfaces of each polygon, those of most of its triangles first."""
    rings = [ring for polygon in polygons for ring in polygon]
    cut = triangulate(
        vertices,
        np.array([corner for ring in rings for corner in ring], np.int64),
        np.array([len(ring) for ring in rings], np.int64),
        np.array([len(polygon) for polygon in polygons], np.int64),
    )
    places, vertex = np.unique(vertices, axis=0, return_inverse=True)
    counts = [len(flatten(choice.shape)) for choice, _ in measured]
    thing_of_polygon = np.repeat(np.arange(len(measured)), counts)
    theirs = _name(thing_of_polygon[cut.polygon], vertex.ravel()[cut.faces])
    corners = np.concatenate([own.corners for _, own in measured])
    _, near = cKDTree(places).query(corners.reshape(-1, 3), distance_upper_bound=_NEAR)
    number = np.repeat(np.arange(len(measured)), [len(own.corners) for _, own in measured])
    ours = _name(number, near.reshape(-1, 3))
    surface = np.concatenate([own.surface for _, own in measured])
    known = dict(zip(map(tuple, ours.tolist()), surface.tolist(), strict=True))
    votes: list[Counter[int]] = [Counter() for _ in polygons]
    for polygon, triangle in zip(cut.polygon.tolist(), map(tuple, theirs.tolist()), strict=True):
        if triangle in known:
            votes[polygon][known[triangle]] += 1
    return [tuple(which for which, _ in vote.most_common()) for vote in votes]


def _name(number: NDArray[np.integer], corners: NDArray[np.integer]) -> NDArray[np.int64]:
    """Name triangles by their object and their corners in any order, (n, 4)."""
    return np.concatenate([number[:, None], np.sort(corners, axis=1)], axis=1).astype(np.int64)


def _label(
    geometry: dict[str, Any], matches: Sequence[tuple[int, ...]], columns: Mapping[str, NDArray]
) -> None:
    """Give the meaning of each polygon of a geometry the figures of its surface."""
    semantics, depth = geometry["semantics"], DEPTHS[geometry["type"]]
    before = list(walk_values(semantics.get("values"), geometry["boundaries"], depth))
    originals = semantics["surfaces"]
    known, after = [dict(original) for original in originals], list(before)
    groups: dict[tuple[int, tuple[int, ...]], list[int]] = {}
    for k, (old, match) in enumerate(zip(before, matches, strict=True)):
        if old is not None:
            groups.setdefault((old, match), []).append(k)
    free = set(range(len(known))) - {old for old, match in groups if not match}
    for (old, match), members in groups.items():
        if not match:
            continue
        index = old
        if old in free:
            free.remove(old)
        else:  # polygons of other figures have this meaning, too
            index = len(known)
            known.append(dict(originals[old]))
            parent = known[index].get("parent")
            if parent is not None:
                known[parent]["children"] = [*known[parent].get("children", ()), index]
        matched = list(match)
        own = {name: values[matched] for name, values in columns.items()}
        known[index].update(_sum_up(own, is_surface=True))
        for member in members:
            after[member] = index
    values = _nest(iter(after), geometry["boundaries"], depth)
    geometry["semantics"] = {**semantics, "surfaces": known, "values": values}


def _nest(values: Any, boundaries: list[Any], depth: int) -> list[Any]:
    """Nest values of surfaces as a geometry's boundaries are."""
    if depth == 0:
        return [next(values) for _ in boundaries]
    return [_nest(values, inner, depth - 1) for inner in boundaries]


def _sum_up(columns: Mapping[str, NDArray], *, is_surface: bool = False) -> dict[str, float]:
    """Return the figures of several surfaces together: means by area, the least and the most."""
    figures: dict[str, float] = {}
    for name, values in columns.items():
        if name == "area":
            value = float(values.sum())
        elif name in {"azimuth", "tilt"}:
            if not is_surface or not np.isfinite(values[0]):
                continue
            value = float(values[0])
        elif name.startswith("least"):
            value = float(values.min())
        elif name.startswith("most"):
            value = float(values.max())
        else:
            value = float(np.average(values, weights=columns["area"]))
        key = {"area": "measured_area", "azimuth": "surface_azimuth", "tilt": "surface_tilt"}
        figures[key.get(name, name)] = round(value, _DIGITS.get(name, 4))
    return figures
