"""
CityJSON 1.0, 1.1, 2.0 and sequences of features, to parts of one object and surface type.

Each object gives its best geometry once: the highest level of detail, and there a
solid rather than loose surfaces. A solid without semantics takes them from loose
surfaces of the same level that have the same corners.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.cityjson_choice import DAMAGE, choose_geometries, damaged, find_kinds, flatten
from umbra.readers.cityjson_colors import find_material
from umbra.readers.cityjson_templates import Templates
from umbra.readers.georeference import name_crs
from umbra.readers.model import Model
from umbra.readers.names import UniqueNames
from umbra.readers.surfaces import Surfaces
from umbra.readers.turn import turn_up
from umbra.scene import Part

__all__ = ["read_cityjson"]


def read_cityjson(documents: list[Any], up: str | None = None) -> Model:
    """
    Read parsed CityJSON.

    Parameters
    ----------
    documents : list of dict
        One CityJSON object, or a sequence's header and its features.
    up : {'x', 'y', 'z'}, optional
        z if None.

    Returns
    -------
    model : Model

    Raises
    ------
    InputError
        If the file is older than CityJSON 1.0 or an object in it is damaged (which).
    """
    head = documents[0]
    if head["type"] != "CityJSON":
        msg = "is a CityJSONFeature without a header line; put the CityJSON line first"
        raise InputError(msg)
    version = str(head.get("version", ""))
    if version.startswith("0"):
        msg = f"is CityJSON {version}; upgrade it (cjio FILE upgrade save OUT)"
        raise InputError(msg, version=version)

    counts: dict[str, int] = {}
    surfaces = Surfaces()
    templates = Templates(None)
    arrays: list[NDArray[np.float64]] = []
    instances: list[Part] = []
    tags: dict[str, tuple[str, ...]] = {}
    unique = UniqueNames()  # a sequence may name two objects alike, each in its line
    count, transform = 0, None
    for number, document in enumerate(documents, 1):
        where = f"line {number}: " if len(documents) > 1 else ""
        objects = document.get("CityObjects") if isinstance(document, dict) else None
        if not isinstance(objects, dict):
            msg = f"{where}holds no CityObjects; export the file again"
            raise InputError(msg, line=number)
        if document.get("type") == "CityJSON":
            transform = document.get("transform")
            templates = Templates(document.get("geometry-templates"))
        raw = document.get("vertices", [])
        vertices = _place_vertices(raw, transform, where)
        choices = choose_geometries(objects, templates.shapes, raw, counts, where)
        for name, choice in choices.items():
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
        surfaces.close(len(vertices), count, where)
        arrays.append(vertices)
        count += len(vertices)

    meshes = surfaces.cut(np.concatenate(arrays), counts)
    parts = [
        Part(name, kind, mesh, material=find_material(kind), tags=tags[name])
        for (name, kind), mesh in meshes.items()
    ]
    metadata = head.get("metadata")
    crs = metadata.get("referenceSystem") if isinstance(metadata, dict) else None
    counts["objects whose id is another's, numbered"] = unique.numbered
    notes = tuple(f"{what}: {n}" for what, n in counts.items() if n)
    form = "CityJSONSeq" if len(documents) > 1 else "CityJSON"
    return Model(
        f"{form} {version}".strip(), turn_up((*parts, *instances), up), name_crs(crs), notes
    )


def _place_vertices(raw: Any, transform: Any, where: str) -> NDArray[np.float64]:
    """Give vertices (n, 3) in the file's own coordinates, scaled and moved in float64."""
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
