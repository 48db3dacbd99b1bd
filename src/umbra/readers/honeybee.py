"""Honeybee models (HBJSON): rooms with faces, apertures and doors; shades; in metres."""

from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.readers.budget import Budget
from umbra.readers.checks import Losses, list_counts
from umbra.readers.cityjson import SurfaceList, find_material
from umbra.readers.model import FileModel, ReadChoices, UniqueNames, turn_up
from umbra.scene import Part

__all__ = ["read_honeybee"]

UNITS = {"Meters": 1.0, "Millimeters": 0.001, "Centimeters": 0.01, "Feet": 0.3048, "Inches": 0.0254}
KINDS = {
    "Wall": "WallSurface", "RoofCeiling": "RoofSurface", "Floor": "GroundSurface",
    "Aperture": "Window",
}  # fmt: skip
"""Kinds whose material is that of CityJSON's."""

Rings = list[list[Any]]


def read_honeybee(model: dict[str, Any], choices: ReadChoices) -> FileModel:
    """Read a parsed model; parts are rooms by the kinds of their faces, and shades."""
    if "buildings" in model:
        msg = (
            "is a Dragonfly model (DFJSON), which is not read; translate it to Honeybee "
            "(dragonfly translate model-to-honeybee FILE)"
        )
        raise InputError(msg)
    unit = model.get("units", "Meters")
    if unit not in UNITS:
        msg = f"has the unit {str(unit)[:40]!r}; convert it to one of {', '.join(UNITS)}"
        raise InputError(msg, unit=unit)
    reader = _HoneybeeReader(choices.budget)
    for room in model.get("rooms") or ():
        reader.add_room(room)
    orphans = {"Face": "orphaned_faces", "Aperture": "orphaned_apertures",
               "Door": "orphaned_doors", "Shade": "orphaned_shades"}  # fmt: skip
    for kind, key in orphans.items():
        for item in model.get(key) or ():
            reader.add_orphan(item, kind)
    for item in model.get("shade_meshes") or ():
        reader.add_mesh(item)
    parts = reader.make_parts(UNITS[unit])
    notes = list(list_counts(reader.counts))
    if unit != "Meters":
        notes.append(f"coordinates were converted from {unit.lower()} to metres")
    return FileModel("HBJSON", turn_up(parts, choices.up), notes=tuple(notes))


class _HoneybeeReader:
    """Collects the surfaces of a model."""

    def __init__(self, budget: Budget) -> None:
        self.counts = Losses()
        self._surfaces = SurfaceList(budget)
        self._unique = UniqueNames()
        self._points: list[Any] = []

    def add_room(self, room: dict[str, Any]) -> None:
        """Add a room's faces and shades."""
        name = self._name(room)
        self._add_shades(room)
        for face in room["faces"]:
            self._add_face(face, name)

    def add_orphan(self, item: dict[str, Any], kind: str) -> None:
        """Add a face, an aperture, a door or a shade that belongs to no room."""
        name = self._name(item)
        if kind == "Face":
            self._add_face(item, name)
        else:
            self._add(name, _kind_of(item, kind), [_rings_of(item)])
            self._add_shades(item)

    def add_mesh(self, mesh: dict[str, Any]) -> None:
        """Add a shade of many triangles and quadrilaterals."""
        points = mesh["geometry"]["vertices"]
        faces = mesh["geometry"]["faces"]
        if any(not 0 <= index < len(points) for face in faces for index in face):
            msg = f"shade mesh '{_label(mesh)}' names a vertex that it lacks; export it again"
            raise InputError(msg)
        self._add(self._name(mesh), "Shade", [[[points[i] for i in face]] for face in faces])

    def make_parts(self, scale: float) -> tuple[Part, ...]:
        """Cut all surfaces into triangles; coordinates times ``scale`` are metres."""
        try:
            points = np.array(self._points, np.float64).reshape(-1, 3) * scale
        except ValueError as error:
            msg = "has a corner that is not three numbers; export it again"
            raise InputError(msg) from error
        self._surfaces.close(points)
        meshes = self._surfaces.cut(self.counts)
        return tuple(
            Part(name, kind, mesh, material=find_material(KINDS.get(kind, kind)))
            for (name, kind), mesh in meshes.items()
        )

    def _name(self, item: dict[str, Any]) -> str:
        return self._unique.add(_label(item))

    def _add_face(self, face: dict[str, Any], room: str) -> None:
        """Add a face, its openings as its holes, and the openings."""
        openings = [(aperture, "Aperture") for aperture in face.get("apertures") or ()]
        openings += [(door, "Door") for door in face.get("doors") or ()]
        kind = str(face.get("face_type", "Wall"))
        if kind == "AirBoundary":
            self.counts.add("air boundaries left out (open)", _label(face))
        else:
            holes = [_rings_of(opening)[0] for opening, _ in openings]
            self._add(room, kind, [[*_rings_of(face), *holes]])
        for opening, word in openings:
            self._add(room, _kind_of(opening, word), [_rings_of(opening)])
            self._add_shades(opening)
        self._add_shades(face)

    def _add_shades(self, owner: dict[str, Any]) -> None:
        for shade in owner.get("outdoor_shades") or ():
            self._add(self._name(shade), "Shade", [_rings_of(shade)])
        inside = owner.get("indoor_shades")
        if inside:
            self.counts.add("shades left out (indoors)", _label(owner), len(inside))

    def _add(self, name: str, kind: str, surfaces: list[Rings]) -> None:
        """Add surfaces of places: each corner becomes a vertex."""
        numbered = [[self._number(ring) for ring in rings] for rings in surfaces]
        self._surfaces.add(name, numbered, [kind] * len(numbered))

    def _number(self, ring: list[Any]) -> list[int]:
        start = len(self._points)
        self._points += ring
        return list(range(start, len(self._points)))


def _label(item: dict[str, Any]) -> str:
    return str(item.get("display_name") or item.get("identifier") or item.get("type", "object"))


def _kind_of(opening: dict[str, Any], kind: str) -> str:
    """Return the kind of an opening: a glass door is an aperture for light."""
    return "Aperture" if kind == "Door" and opening.get("is_glass") else kind


def _rings_of(item: dict[str, Any]) -> Rings:
    """Return the rings of an object's polygon, its outside first."""
    geometry = item["geometry"]
    return [list(geometry["boundary"]), *map(list, geometry.get("holes") or ())]
