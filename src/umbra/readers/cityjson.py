"""
CityJSON 1.0, 1.1, 2.0 and sequences of features, to parts of one object and surface type.

Each object's best geometry is read once: the highest level of detail, preferring a solid
to loose surfaces. A solid without semantics takes them from loose surfaces of the same
level with the same corners.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.budget import Budget
from umbra.readers.checks import list_counts
from umbra.readers.cityjson_choice import (
    DAMAGE,
    Choice,
    choose_geometries,
    damaged,
    find_kinds,
    flatten,
)
from umbra.readers.georeference import name_crs
from umbra.readers.model import FileModel, ReadChoices, UniqueNames, turn_up
from umbra.readers.triangulate import triangulate
from umbra.scene import Material, Mesh, Part
from umbra.scene.material import GREY
from umbra.scene.mesh import change, find_used

__all__ = ["Templates", "make_parts", "place_vertices", "read_cityjson"]


MOST_CORNERS = 250_000
"""Surfaces of a sequence's features are cut into triangles when they have more."""


def read_cityjson(documents: list[Any], choices: ReadChoices) -> FileModel:
    """Read parsed CityJSON: one object, or a sequence's header and its features."""
    head = documents[0]
    if head["type"] != "CityJSON":
        msg = "is a CityJSONFeature without a header line; put the CityJSON line first"
        raise InputError(msg)
    version = str(head.get("version", ""))
    if version.startswith("0"):
        msg = f"is CityJSON {version}; upgrade it (cjio FILE upgrade save OUT)"
        raise InputError(msg, version=version)

    counts: Counter[str] = Counter()

    def where(number: int) -> str:
        return f"line {number}: " if len(documents) > 1 else ""

    parts = make_parts(documents, Templates(None, choices.budget), counts, where)
    metadata = head.get("metadata")
    crs = metadata.get("referenceSystem") if isinstance(metadata, dict) else None
    form = "CityJSONSeq" if len(documents) > 1 else "CityJSON"
    return FileModel(
        f"{form} {version}".strip(), turn_up(parts, choices.up), name_crs(crs), list_counts(counts)
    )


def make_parts(
    documents: Iterable[Any],
    templates: "Templates",
    counts: Counter[str],
    where_of: Callable[[int], str],
) -> tuple[Part, ...]:
    """
    Make the parts of a city's documents, of each object the best geometry once.

    Parameters
    ----------
    documents : iterable of dict
        With ``CityObjects`` and ``vertices``; the transform and templates of a header stand.
    templates : Templates
        Templates of the header.
    counts : Counter
        Losses, added to.
    where_of : callable
        Returns the place of the n-th document, from 1, for errors.

    Returns
    -------
    parts : tuple of Part
        In the file's own coordinates.
    """
    surfaces = SurfaceList(templates.budget)
    parts: list[Part] = []
    instances: list[Part] = []
    tags: dict[str, tuple[str, ...]] = {}
    unique = UniqueNames()  # a sequence may repeat object names
    transform = None
    for number, document in enumerate(documents, 1):
        where = where_of(number)
        objects = document.get("CityObjects") if isinstance(document, dict) else None
        if not isinstance(objects, dict):
            msg = f"{where}holds no CityObjects; export the file again"
            raise InputError(msg, line=number)
        if document.get("type") == "CityJSON":
            transform = document.get("transform")
            templates = Templates(document.get("geometry-templates"), templates.budget)
        raw = document.get("vertices", [])
        vertices = place_vertices(raw, transform, where)
        chosen = choose_geometries(objects, templates.shapes, raw, counts, where)
        for name, choice in chosen.items():
            try:
                kind, own = str(objects[name]["type"]), unique.add(name)
                tags[own] = (kind,) if own == name else (kind, name)
                if choice.shape is not choice.geometry:
                    instances += templates.place(own, kind, choice.geometry, vertices, counts)
                else:
                    surfaces.add(own, flatten(choice.shape), find_kinds(choice, kind, raw))
            except DAMAGE as error:
                if isinstance(error, InputError):
                    raise
                raise damaged(name, error, where) from error
        surfaces.close(vertices, where)
        if surfaces.corners > MOST_CORNERS:
            parts += _make_parts(surfaces, tags, counts)
            surfaces = SurfaceList(templates.budget)
    parts += _make_parts(surfaces, tags, counts)
    counts["objects with a repeated id, numbered"] = unique.numbered
    return (*parts, *instances)


def _make_parts(
    surfaces: "SurfaceList", tags: dict[str, tuple[str, ...]], counts: Counter[str]
) -> list[Part]:
    """Make parts of whole objects, and clear their tags."""
    meshes = surfaces.cut(counts)
    parts = [
        Part(name, kind, mesh, material=find_material(kind), tags=tags[name])
        for (name, kind), mesh in meshes.items()
    ]
    tags.clear()
    return parts


def place_vertices(raw: Any, transform: Any, where: str) -> NDArray[np.float64]:
    """Return vertices (n, 3) in the file's own coordinates, scaled and moved in float64."""
    try:
        vertices = np.array(raw, np.float64).reshape(len(raw), 3)
    except (TypeError, ValueError) as error:
        wrong = _first_bad_vertex(raw)
        msg = f"{where}the vertices are not triples of numbers ({wrong}); export the file again"
        raise InputError(msg) from error
    if transform is None:
        return vertices
    try:
        scale = np.array(transform["scale"], np.float64).reshape(3)
        translate = np.array(transform["translate"], np.float64).reshape(3)
    except (KeyError, TypeError, ValueError) as error:
        msg = f"{where}the transform lacks three numbers for scale or translate; repair it"
        raise InputError(msg) from error
    return vertices * scale + translate


def _first_bad_vertex(raw: Any) -> str:
    if not isinstance(raw, list):
        return f"they are a {type(raw).__name__}"
    for index, vertex in enumerate(raw):
        if (
            not isinstance(vertex, list)
            or len(vertex) != 3
            or not all(isinstance(value, int | float) for value in vertex)
        ):
            return f"first: vertex {index}, {str(vertex)[:60]}"
    return "mixed"


class SurfaceList:
    """Surfaces by object and kind; a budget is charged for corners named again and again."""

    def __init__(self, budget: Budget | None = None) -> None:
        self._budget = budget
        self._parts: dict[tuple[str, str], int] = {}
        self._part: list[int] = []
        self._rings: list[int] = []
        self._ring_lengths: list[int] = []
        self._open: list[int] = []
        self._closed: list[NDArray[np.int64]] = []
        self._arrays: list[NDArray[np.float64]] = []
        self._vertices = 0
        self._first_ring = 0
        self.corners = 0
        """Number of corners of closed documents."""

    def add(self, name: str, surfaces: list[Any], kinds: list[str]) -> None:
        """Add an object's surfaces (lists of rings of the document's vertices), each of a kind."""
        parts, lengths, corners = self._parts, self._ring_lengths, self._open
        for surface, kind in zip(surfaces, kinds, strict=True):
            self._part.append(parts.setdefault((name, kind), len(parts)))
            self._rings.append(len(surface))
            for ring in surface:
                lengths.append(len(ring))
                corners += ring

    def close(self, vertices: NDArray[np.float64], where: str = "") -> None:
        """End a document: check the indices added since the last, of its vertices (n, 3)."""
        n_vertices = len(vertices)
        try:
            corners = np.array(self._open) if self._open else np.zeros(0, np.int64)
        except ValueError:  # ragged: an index is a list
            corners = np.array([None])
        if corners.dtype.kind != "i" or corners.ndim != 1:
            wrong = next((i for i, c in enumerate(self._open) if type(c) is not int), 0)
            owner, index = self._owner(wrong), self._open[wrong]
            msg = (
                f"{where}object '{owner}' has a vertex index that is not a whole number "
                f"({str(index)[:40]}); repair it or export the file again"
            )
            raise InputError(msg, object=owner, vertex=index)
        if len(corners) and (corners.min() < 0 or corners.max() >= n_vertices):
            bad = np.flatnonzero((corners < 0) | (corners >= n_vertices))
            owner, vertex = self._owner(int(bad[0])), int(corners[bad[0]])
            msg = (
                f"{where}object '{owner}' names vertex {vertex}, but there are {n_vertices} "
                f"vertices ({len(bad)} such corners in all); repair it or export the file again"
            )
            raise InputError(msg, object=owner, vertex=vertex, count=len(bad))
        self._closed.append(corners.astype(np.int64, copy=False) + self._vertices)
        self._arrays.append(vertices)
        self._vertices += n_vertices
        self.corners += len(corners)
        self._open.clear()
        self._first_ring = len(self._ring_lengths)

    def _owner(self, corner: int) -> str:
        """Find the object that a corner of the open document belongs to."""
        ring = np.searchsorted(np.cumsum(self._ring_lengths[self._first_ring :]), corner, "right")
        surface = np.searchsorted(np.cumsum(self._rings), ring + self._first_ring, "right")
        part = self._part[int(surface)]
        return next(name for (name, _), index in self._parts.items() if index == part)

    def cut(self, counts: Counter[str]) -> dict[tuple[str, str], Mesh]:
        """Cut all surfaces into triangles of shared vertices: a mesh by (name, kind)."""
        vertices = np.concatenate(self._arrays or [np.zeros((0, 3))])
        corners = np.concatenate(self._closed) if self._closed else np.zeros(0, np.int64)
        result = triangulate(
            vertices,
            corners,
            np.array(self._ring_lengths, np.int64),
            np.array(self._rings, np.int64),
            self._budget,
        )
        counts.update(result.losses)
        part = np.array(self._part, np.int64)[result.polygon]
        order = np.argsort(part, kind="stable")
        # Here once for all parts, which share their vertices; a scene would do it mesh by mesh.
        is_used = find_used(vertices, result.faces)
        number = np.cumsum(is_used, dtype=np.int32) - np.int32(1)
        vertices, faces = vertices[is_used], number.take(result.faces).take(order, axis=0)
        ends = np.cumsum(np.bincount(part, minlength=len(self._parts))).tolist()
        whole = Mesh(vertices, faces)  # checked once
        starts = [0, *ends]
        return {
            key: change(whole, faces=faces[start:end])
            for key, start, end in zip(self._parts, starts, ends)
        }


class Templates:
    """
    The geometry templates of one file; their vertices are plain coordinates.

    Parameters
    ----------
    data : dict, optional
        ``geometry-templates``.
    budget : Budget, optional
        Charged with a part for each surface type of a template, at each of its places.
    """

    def __init__(self, data: Any, budget: Budget | None = None) -> None:
        self.budget = budget
        self.shapes: list[dict[str, Any]] = data["templates"] if data else []
        self._raw: list[Any] = data["vertices-templates"] if data else []
        self._meshes: dict[int, dict[str, Mesh]] = {}

    def place(
        self,
        name: str,
        kind: str,
        instance: dict[str, Any],
        vertices: NDArray[np.float64],
        counts: Counter[str],
    ) -> list[Part]:
        """Place a template at a vertex (n, 3) of the document; the parts share its meshes."""
        index = instance["template"]
        if index not in self._meshes:
            self._meshes[index] = self._cut(index, counts)
        if self.budget is not None:
            self.budget.count("parts of geometry templates", len(self._meshes[index]))
        (anchor,) = instance["boundaries"]
        if not 0 <= anchor < len(vertices):
            msg = f"reference point {anchor} of {len(vertices)} vertices"
            raise IndexError(msg)
        matrix = instance.get("transformationMatrix")
        transform = np.eye(4) if matrix is None else np.array(matrix, np.float64).reshape(4, 4)
        transform[:3, 3] += vertices[anchor]
        return [
            Part(name, surface or kind, mesh, transform, find_material(surface or kind))
            for surface, mesh in self._meshes[index].items()
        ]

    def _cut(self, index: int, counts: Counter[str]) -> dict[str, Mesh]:
        vertices = np.array(self._raw, np.float64).reshape(-1, 3)
        shape = self.shapes[index]
        surfaces = SurfaceList(self.budget)
        kinds = find_kinds(Choice(shape, shape), "", self._raw)
        surfaces.add(f"geometry template {index}", flatten(shape), kinds)
        surfaces.close(vertices)
        return {kind: mesh for (_, kind), mesh in surfaces.cut(counts).items()}


# Diffuse reflectance, linear RGB; muted, so that shadows stay the subject.
COLORS = {
    "Bridge": (0.50, 0.48, 0.45),
    "Door": (0.28, 0.18, 0.11),
    "GroundSurface": (0.42, 0.40, 0.37),
    "LandUse": (0.44, 0.46, 0.33),
    "PlantCover": (0.22, 0.36, 0.14),
    "Road": (0.26, 0.26, 0.27),
    "RoofSurface": (0.52, 0.22, 0.14),
    "SolitaryVegetationObject": (0.20, 0.34, 0.12),
    "TINRelief": (0.44, 0.46, 0.33),
    "WallSurface": (0.76, 0.70, 0.58),
    "WaterBody": (0.18, 0.34, 0.46),
    "WaterSurface": (0.18, 0.34, 0.46),
    "Window": (0.20, 0.27, 0.32),
}


@cache
def find_material(kind: str) -> Material:
    """Return the material of a CityJSON object type or surface type; grey for others."""
    return Material(COLORS.get(kind, GREY))
