"""COLLADA, alone or packed (.zae): nodes with their matrices, instances sharing one mesh."""

import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.budget import Budget
from umbra.readers.checks import Losses, find_reason, list_counts
from umbra.readers.content import ZIP, BoundedStream, open_archive
from umbra.readers.model import FileModel, ReadChoices, UniqueNames, turn_up
from umbra.readers.triangulate import cut_faces
from umbra.scene import Material, Mesh, Part
from umbra.scene.material import GREY

__all__ = ["read_collada"]

_TREE = 8  # memory of the tree for each byte of XML
_DEEPEST = 200  # nodes in nodes; instances may lead back to themselves
_UPS = {"X_UP": "x", "Y_UP": "y", "Z_UP": "z"}
_BLANK = b"\xef\xbb\xbf\xff\xfe \t\r\n"
_ENCODING = re.compile(rb"<\?xml[^>]*?\bencoding\s*=\s*[\"']([^\"']*)")
_KNOWN = re.compile(r"utf-?8|utf-?16([lb]e)?|us-ascii", re.IGNORECASE)

Matrix = NDArray[np.float64]


def read_collada(data: bytes, _: Path, choices: ReadChoices) -> FileModel:
    """Read COLLADA 1.4 and 1.5; y is up and lengths are metres unless the file says otherwise."""
    library = need("collada", "cad", "COLLADA")
    budget = choices.budget
    if data.startswith(ZIP):
        data = _unpack(data, budget)
    # The parser would follow entities, also in encodings in which these bytes are others.
    _check_encoding(data)
    if b"<!DOCTYPE" in data.replace(b"\x00", b""):
        msg = "declares a document type, which COLLADA does not need; remove it"
        raise InputError(msg)
    try:
        budget.spend(_TREE * len(data), "the XML tree")
        document = library.Collada(
            io.BytesIO(data), ignore=[library.common.DaeError], aux_file_loader=_load_nothing
        )
    except library.common.DaeError as error:
        reason = find_reason(error, 160)
        msg = f"is damaged COLLADA ({reason}); export it again"
        raise InputError(msg) from error
    except SyntaxError as error:  # of either parser
        msg = f"is damaged XML ({find_reason(error)}); export it again"
        raise InputError(msg) from error
    if document.scene is None:
        msg = "has no scene; export it again with its objects"
        raise InputError(msg)
    reader = _ColladaReader(budget)
    for index, node in enumerate(document.scene.nodes):
        reader.add_node(node, np.eye(4), f"node {index}", 0)
    if document.errors:
        reader.counts["pieces left out that are damaged or not supported"] += len(document.errors)
    up = choices.up or _UPS.get(str(document.assetInfo.upaxis), "y")
    unit = _find_unit(document.assetInfo)
    parts = tuple(_scale(part, unit) for part in reader.parts)
    return FileModel("COLLADA", turn_up(parts, up), notes=list_counts(reader.counts))


def _check_encoding(data: bytes) -> None:
    """Refuse all encodings of XML but UTF-8 and UTF-16, in which all letters of tags are ASCII."""
    match = _ENCODING.match(data[:400].replace(b"\x00", b"").lstrip(_BLANK))
    named = match[1].decode("ascii", "replace") if match else "UTF-8"
    wide = data.startswith((b"\x00\x00\xfe\xff", b"\xff\xfe\x00\x00"))
    if wide or not _KNOWN.fullmatch(named):
        msg = f"is XML in the encoding {'UTF-32' if wide else named[:40]}; save it as UTF-8"
        raise InputError(msg, encoding=named)


class _ColladaReader:
    """Collects parts from the nodes of a scene."""

    def __init__(self, budget: Budget) -> None:
        self.parts: list[Part] = []
        self.counts = Losses()
        self._budget = budget
        self._unique = UniqueNames()
        self._meshes: dict[int, list[tuple[str, Mesh]]] = {}

    def add_node(self, node: Any, matrix: Matrix, name: str, depth: int) -> None:
        """Add the geometries of a node and of its children; instances lead to other nodes."""
        self._budget.count("nodes and their instances")
        if depth > _DEEPEST:
            msg = f"nests more than {_DEEPEST} nodes; export it again"
            raise InputError(msg)
        target = getattr(node, "node", None)
        if target is not None:
            self.add_node(target, matrix, name, depth + 1)
            return
        own = getattr(node, "name", None) or getattr(node, "id", None) or name
        for transform in getattr(node, "transforms", None) or ():
            if hasattr(transform, "matrix"):
                matrix = matrix @ np.array(transform.matrix, np.float64)
        geometry = getattr(node, "geometry", None)
        if geometry is None and getattr(node, "controller", None) is not None:
            geometry = getattr(node.controller, "geometry", None)
            self.counts.add("bent geometries read at rest", own)
        if geometry is not None:
            self._add_geometry(geometry, node.materials or (), matrix, own)
        for child in getattr(node, "children", None) or ():
            self.add_node(child, matrix, own, depth + 1)

    def _add_geometry(self, geometry: Any, bound: Any, matrix: Matrix, name: str) -> None:
        if id(geometry) not in self._meshes:
            self._meshes[id(geometry)] = list(self._cut(geometry))
        targets = {binding.symbol: binding.target for binding in bound}
        if not self._meshes[id(geometry)]:
            return
        name = self._unique.add(name)
        for symbol, mesh in self._meshes[id(geometry)]:
            target = targets.get(symbol)
            kind = str(getattr(target, "name", None) or getattr(target, "id", None) or symbol)
            material = _find_material(target)
            self._budget.count("parts")
            self.parts.append(Part(name, kind, mesh, matrix, material))

    def _cut(self, geometry: Any) -> Iterator[tuple[str, Mesh]]:
        """Cut a geometry's primitives into triangles, each with its material's symbol."""
        label = str(geometry.name or geometry.id)
        for primitive in geometry.primitives:
            vertices = getattr(primitive, "vertex", None)
            corners = getattr(primitive, "vertex_index", None)
            if vertices is None or corners is None or not len(corners):
                continue
            corners = np.asarray(corners, np.int64)
            if hasattr(primitive, "vcounts"):
                lengths = np.asarray(primitive.vcounts, np.int64)
            elif corners.ndim == 2 and corners.shape[1] == 3:
                lengths = np.full(len(corners), 3)
            else:
                self.counts.add("lines left out", label)
                continue
            vertices = np.asarray(vertices, np.float64).reshape(-1, 3)
            corners = corners.ravel()
            wrong = (corners < 0) | (corners >= len(vertices))
            if wrong.any() or lengths.sum() != len(corners) or (lengths < 0).any():
                msg = (
                    f"geometry '{label[:60]}' names {int(wrong.sum())} vertices that it does not "
                    f"have, of {len(vertices)}; export it again"
                )
                raise InputError(msg, geometry=label)
            cut = cut_faces(vertices, corners, lengths, self._budget)
            self.counts.update(cut.losses)
            yield str(primitive.material or ""), Mesh(vertices, cut.faces)


def _find_material(target: Any) -> Material:
    """Return the plain diffuse colour of a material; grey for textures and none."""
    diffuse = getattr(getattr(target, "effect", None), "diffuse", None)
    if isinstance(diffuse, tuple) and len(diffuse) >= 3:
        red, green, blue = (min(max(float(value), 0.0), 1.0) for value in diffuse[:3])
        return Material((red, green, blue))
    return Material(GREY)


def _find_unit(asset: Any) -> float:
    unit = 1.0 if asset.unitmeter is None else float(asset.unitmeter)
    if not (np.isfinite(unit) and unit > 0):
        msg = f"has a unit of {unit:g} m; export it again"
        raise InputError(msg, unit=unit)
    return unit


def _scale(part: Part, unit: float) -> Part:
    """Place a part in metres; the shared mesh stays."""
    matrix = np.diag([unit, unit, unit, 1.0]) @ part.transform
    return Part(part.name, part.kind, part.mesh, matrix, part.material)


def _unpack(data: bytes, budget: Budget) -> bytes:
    """Return the first COLLADA file of an archive."""
    archive, models = open_archive(io.BytesIO(data), budget, _find_model)
    with archive, BoundedStream(archive.open(models[0]), budget) as file:
        return file.readall()


def _find_model(archive: ZipFile) -> list[str]:
    """Return the name of an archive's first COLLADA file."""
    return [name for name in archive.namelist() if name.lower().endswith(".dae")][:1]


def _load_nothing(name: str) -> bytes:
    """Refuse the files that a model names: textures are not read."""
    raise FileNotFoundError(name)
