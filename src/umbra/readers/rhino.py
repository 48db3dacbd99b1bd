"""Rhino's 3DM: meshes, and the render meshes of bodies; blocks become instances."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import require
from umbra.readers.budget import Budget
from umbra.readers.checks import Losses, list_counts
from umbra.readers.child import ReadingChild
from umbra.readers.model import FileModel, ReadChoices, UniqueNames, turn_up
from umbra.readers.rhino_file import Color, RhinoFacts, RhinoObject
from umbra.scene import Material, Mesh, Part
from umbra.scene.material import GREY, find_linear

__all__ = ["read_rhino"]

SECONDS = 5.0
"""Processor time that one object may take [s]."""
UNITS = {
    "Microns": 1e-6, "Millimeters": 1e-3, "Centimeters": 0.01, "Decimeters": 0.1, "Meters": 1.0,
    "Dekameters": 10.0, "Hectometers": 100.0, "Kilometers": 1000.0, "Inches": 0.0254,
    "Feet": 0.3048, "Yards": 0.9144, "Miles": 1609.344,
}  # fmt: skip
_BODIES = ("Brep", "Extrusion", "SubD")
_DEEPEST = 50  # blocks in blocks


def read_rhino(_: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read a Rhino file; layers are kinds, and what is hidden is left out."""
    require(["rhino3dm"], "cad", "Rhino's 3DM")
    child = ReadingChild(
        "umbra.readers.rhino_file:read_objects", str(path.resolve()),
        choices.budget.limit_child(SECONDS),
    )  # fmt: skip
    facts: RhinoFacts | None = None
    objects: list[RhinoObject] = []
    for piece in child:
        if isinstance(piece, RhinoFacts):
            facts = piece
        else:
            objects.append(piece)
    if facts is None or not child.is_done:
        error = child.make_error("3DM", "save it again")
        raise error
    reader = _RhinoReader(facts, objects, choices.budget)
    unit = UNITS.get(facts.unit, 1.0)
    matrix = np.diag([unit, unit, unit, 1.0])
    for item in objects:
        if not item.is_of_block:
            reader.add(item, matrix, "", 0)
    if facts.unit not in UNITS:
        reader.notes.append(f"its unit is {facts.unit[:40]}, so coordinates are taken as metres")
    notes = (*reader.notes, *list_counts(reader.counts))
    return FileModel("Rhino 3DM", turn_up(tuple(reader.parts), choices.up), notes=notes)


class _RhinoReader:
    """Collects parts from objects and from instances of blocks."""

    def __init__(self, facts: RhinoFacts, objects: list[RhinoObject], budget: Budget) -> None:
        self._facts, self._budget = facts, budget
        self._by_id = {item.id: item for item in objects}
        self._meshes: dict[str, Mesh] = {}
        self._unique = UniqueNames()
        self.parts: list[Part] = []
        self.counts = Losses()
        self.notes: list[str] = []

    def add(self, item: RhinoObject, matrix: NDArray[np.float64], name: str, depth: int) -> None:
        """Add an object where a matrix (4, 4) puts it; ``name``: of the block that it is in."""
        self._budget.count("objects and instances of blocks")
        layer, full, color, is_shown = self._find_layer(item.layer)
        label = item.name or name or layer or item.kind
        if item.is_hidden or not is_shown:
            self.counts.add("hidden objects left out", label)
        elif item.matrix is not None:
            self._add_block(item, matrix @ item.matrix, label, depth)
        elif item.vertices is None or item.faces is None:
            if item.kind in _BODIES:
                what = "bodies left out that have no render mesh (shade a view and save again)"
                self.counts.add(what, label)
            else:
                self.counts.add("curves, points and texts left out", label)
        else:
            if item.id not in self._meshes:
                self._meshes[item.id] = _make_mesh(item, label)
            mesh = self._meshes[item.id]
            tags = tuple(dict.fromkeys(w for w in (full, item.name, name, item.kind) if w))
            material = _make_material(item.color or color)
            own = self._unique.add(label)
            self.parts.append(Part(own, layer, mesh, matrix, material, tags=tags))

    def _find_layer(self, index: int) -> tuple[str, str, Color, bool]:
        layers = self._facts.layers
        return layers[index] if 0 <= index < len(layers) else ("", "", (), True)

    def _add_block(
        self, instance: RhinoObject, matrix: NDArray[np.float64], name: str, depth: int
    ) -> None:
        if depth > _DEEPEST:
            msg = f"nests more than {_DEEPEST} blocks (first: '{name[:60]}'); save it again"
            raise InputError(msg)
        block, members = self._facts.blocks.get(instance.block, ("", ()))
        contents = list(self._list_members(members))
        if not contents:
            self.counts.add("blocks left out whose objects the file does not hold", name)
        for member in contents:
            self.add(member, matrix, instance.name or block or name, depth + 1)

    def _list_members(self, members: tuple[str, ...]) -> Iterator[RhinoObject]:
        return (self._by_id[member] for member in members if member in self._by_id)


def _make_mesh(item: RhinoObject, label: str) -> Mesh:
    """Divide quadrilaterals as Rhino does, by the diagonal from the first corner."""
    assert item.vertices is not None and item.faces is not None  # noqa: PT018
    wrong = (item.faces < 0) | (item.faces >= len(item.vertices))
    if wrong.any():
        msg = (
            f"object '{label[:60]}' names {int(wrong.sum())} vertices that it does not have, of "
            f"{len(item.vertices)}; repair its mesh"
        )
        raise InputError(msg, object=label)
    is_quad = item.faces[:, 2] != item.faces[:, 3]
    faces = np.concatenate([item.faces[:, :3], item.faces[is_quad][:, [0, 2, 3]]])
    return Mesh(item.vertices, faces.astype(np.int32))


def _make_material(color: Color) -> Material:
    """Return a colour's material; grey for black, the colour of layers without one."""
    if len(color) < 3 or not any(color[:3]):
        return Material(GREY)
    srgb = np.clip(np.array(color[:3], np.float64) / 255, 0, 1)
    red, green, blue = find_linear(srgb).tolist()
    return Material((red, green, blue))
