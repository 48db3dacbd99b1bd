"""
IFC: every element that has a shape becomes parts, one for each of its surface styles.

A part bears the name and the class of the whole it belongs to, so that a curtain wall
or a stair is chosen as one; what it is itself (own name and class, storey, type,
materials, styles) are its tags. Openings are cut by ifcopenshell's geometry engine.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.readers.georeference import find_plan_unit, to_metres
from umbra.readers.ifc_child import IfcHarvest, harvest
from umbra.readers.ifc_engine import IfcFacts, IfcShape, check_whole, find_schema
from umbra.readers.ifc_facts import IfcWords
from umbra.readers.model import FileModel, FilePlace
from umbra.readers.placement import turn_up
from umbra.scene import Material, Mesh, Part
from umbra.scene.mesh import transform_points

__all__ = ["read_ifc"]


def read_ifc(data: bytes, path: Path, up: str | None = None) -> FileModel:
    """Read an IFC file in metres: 2x3, 4, 4x3 and its drafts; on the map if it has one."""
    find_schema(data)
    check_whole(data)
    facts, found = harvest(str(path.absolute()))
    parts = tuple(
        part
        for number in sorted(found.shapes)
        for part in _make_parts(facts.elements[number], found.shapes[number])
    )
    place, crs = facts.place, facts.crs
    if facts.matrix is not None and crs is not None:
        # The map's plan may be in feet; heights are metres.
        scale = np.diag([1 / find_plan_unit(crs)] * 2 + [1, 1])
        moved = tuple(_move(part, scale @ facts.matrix) for part in parts)
        parts, crs = to_metres(moved, crs, is_high_in_metres=True)
        place = FilePlace(place.latitude, place.longitude, place.elevation)
    place = replace(place, ground=_find_ground(parts))
    notes = (*facts.notes, *_tell_losses(facts, found))
    return FileModel(f"IFC ({facts.schema})", turn_up(parts, up), crs, notes, place=place)


def _tell_losses(facts: IfcFacts, found: IfcHarvest) -> list[str]:
    """Say how many elements have no shape, why, and which is the first."""
    missing = set(range(len(facts.elements))) - set(found.shapes)
    hung, ended = missing & found.hung, missing & found.ended - found.hung
    useless = missing - hung - ended
    unread = set() if found.is_whole else useless
    reasons = [
        ("elements at which the geometry engine ends left out", ended),
        ("elements that take the geometry engine too long left out", hung),
        ("elements after those not read any more", unread),
        ("elements without a usable shape left out", useless - unread),
    ]
    return [
        f"{reason}: {len(which)} (first: {_show(facts.elements[min(which)])})"
        for reason, which in reasons
        if which
    ]


def _show(words: IfcWords) -> str:
    return f"{words.own_kind} '{words.own_name}'"


def _make_parts(words: IfcWords, shape: IfcShape) -> list[Part]:
    # An element repeats a style for each of its pieces: one part for each style.
    looks = list(dict.fromkeys(shape.styles))
    look = np.array([looks.index(one) for one in shape.styles] + [-1], np.int32)[shape.style]
    parts = []
    for number in np.unique(look).tolist():
        name, material = looks[number] if number >= 0 else ("", Material())
        tags = words.tags if not name or name in words.tags else (*words.tags, name)
        mesh = Mesh(shape.vertices, shape.faces[look == number])
        parts.append(Part(words.name, words.kind, mesh, material=material, tags=tags))
    return parts


def _find_ground(parts: Sequence[Part]) -> float | None:
    """Give the height of the site's own body, if its top is level and it has no other slope."""
    site = [part for part in parts if part.kind == "IfcSite"]
    if not site:
        return None
    corners = np.concatenate([part.mesh.vertices[part.mesh.faces] for part in site])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    # Roundly level or upright: anything between is terrain, of which no height is the ground.
    level = np.abs(normals[:, 2]) > 0.9999 * length
    upright = np.abs(normals[:, 2]) < 1e-4 * length
    top = float(corners[..., 2].max())
    upper = level & (normals[:, 2] > 0)
    if not (level | upright | (length == 0)).all() or not upper.any():
        return None
    heights = corners[upper][..., 2]
    area = length[upper][np.abs(heights - top).max(1) < 0.01].sum()
    return top if area > 0.5 * length[upper].sum() else None


def _move(part: Part, matrix: NDArray[np.float64]) -> Part:
    mesh = part.mesh
    return Part(
        part.name, part.kind, mesh.moved(transform_points(matrix, mesh.vertices)),
        material=part.material, tags=part.tags,
    )  # fmt: skip
