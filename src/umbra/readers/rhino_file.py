"""
rhino3dm on one file: its layers and blocks, then one object after another.

This runs in a child process (`umbra.readers.rhino`), as openNURBS may end the process, or
never end, on damaged files. All that is yielded here is arrays and plain values.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.triangulate import triangulate

__all__ = ["Color", "RhinoFacts", "RhinoObject", "read_objects"]

_PIECES = 64
"""Straight pieces of a curved profile."""
_ROUNDS = 3
"""Times that the control net of a SubD is divided: it is then near the smooth surface."""

Color = tuple[int, ...]


@dataclass(frozen=True)
class RhinoFacts:
    """The contents of a file besides its objects."""

    version: int  # of the archive, as 7 for Rhino 7; 0 if unknown
    unit: str  # as ``Millimeters``
    layers: tuple[tuple[str, str, Color, bool], ...]  # name, full name, colour, whether shown
    blocks: dict[str, tuple[str, tuple[str, ...]]]  # by id: name, ids of objects


@dataclass(frozen=True, eq=False)
class RhinoObject:
    """An object: triangles and quadrilaterals, a block's instance, or neither."""

    id: str
    name: str
    kind: str  # as ``Brep``
    layer: int
    is_hidden: bool
    is_of_block: bool
    color: Color | None  # if it has one of its own
    vertices: NDArray[np.float64] | None = None  # (n, 3)
    faces: NDArray[np.int64] | None = None  # (m, 4): of a triangle the third corner twice
    block: str = ""
    matrix: NDArray[np.float64] | None = None  # (4, 4): of an instance


def read_objects(path: str) -> Iterator[RhinoFacts | RhinoObject]:
    """Read a file: its facts, then its objects."""
    rhino = need("rhino3dm", "cad", "Rhino's 3DM")
    file = rhino.File3dm.FromByteArray(Path(path).read_bytes())
    if file is None:
        msg = "is damaged 3DM, or of a Rhino newer than rhino3dm; save it again as Rhino 7"
        raise InputError(msg)
    layers = list(file.Layers)
    by_id = {str(layer.Id): layer for layer in layers}
    shown = tuple(
        (str(layer.Name), str(layer.FullPath), tuple(layer.Color), _is_shown(layer, by_id))
        for layer in layers
    )
    blocks = {
        str(definition.Id): (str(definition.Name), tuple(map(str, definition.GetObjectIds())))
        for definition in file.InstanceDefinitions
    }
    unit = str(file.Settings.ModelUnitSystem).rpartition(".")[2]
    yield RhinoFacts(int(file.ArchiveVersion or 0), unit, shown, blocks)
    for item in file.Objects:
        yield _read(rhino, item)


def _is_shown(layer: Any, by_id: dict[str, Any]) -> bool:
    """Return whether a layer and all above it are on."""
    for _ in range(len(by_id) + 1):
        if layer is None or not layer.Visible:
            return layer is None
        layer = by_id.get(str(layer.ParentLayerId))
    return True


def _read(rhino: Any, item: Any) -> RhinoObject:
    geometry, attributes = item.Geometry, item.Attributes
    kind = type(geometry).__name__
    has_color = str(attributes.ColorSource).endswith("ColorFromObject")
    facts = (
        str(attributes.Id), str(attributes.Name or ""), kind, int(attributes.LayerIndex),
        not attributes.Visible, bool(attributes.IsInstanceDefinitionObject),
        tuple(attributes.ObjectColor) if has_color else None,
    )  # fmt: skip
    if kind == "InstanceReference":
        form = geometry.Xform
        matrix = [[getattr(form, f"M{row}{col}") for col in range(4)] for row in range(4)]
        block = str(geometry.ParentIdefId)
        return RhinoObject(*facts, block=block, matrix=np.array(matrix, np.float64))
    vertices, faces = _mesh(rhino, geometry, kind)
    return RhinoObject(*facts, vertices=vertices, faces=faces)


def _mesh(
    rhino: Any, geometry: Any, kind: str
) -> tuple[NDArray[np.float64] | None, NDArray[np.int64] | None]:
    """Return the triangles and quadrilaterals of an object; None without a mesh."""
    any_mesh = rhino.MeshType.Any
    if kind == "Mesh":
        meshes = [geometry]
    elif kind == "Extrusion":
        meshes = [geometry.GetMesh(any_mesh)]
    elif kind == "Brep":
        meshes = [geometry.Faces[k].GetMesh(any_mesh) for k in range(len(geometry.Faces))]
    elif kind == "SubD":
        geometry.Subdivide(_ROUNDS)
        meshes = [rhino.Mesh.CreateFromSubDControlNet(geometry)]
    else:
        return None, None
    meshes = [mesh for mesh in meshes if mesh is not None and len(mesh.Faces)]
    if not meshes:
        return _extrude(geometry) if kind == "Extrusion" else (None, None)
    points, corners, count = [], [], 0
    for mesh in meshes:
        vertices = [(point.X, point.Y, point.Z) for point in mesh.Vertices]
        points.append(np.array(vertices, np.float64).reshape(-1, 3))
        indices = [mesh.Faces[k] for k in range(len(mesh.Faces))]
        corners.append(np.array(indices, np.int64).reshape(-1, 4) + count)
        count += len(vertices)
    return np.concatenate(points), np.concatenate(corners)


def _extrude(geometry: Any) -> tuple[NDArray[np.float64] | None, NDArray[np.int64] | None]:
    """Return the walls and caps of an extrusion that was never shaded."""
    low, high = ([_sample(geometry.Profile3d(k, end)) for k in range(geometry.ProfileCount)]
                 for end in (0.0, 1.0))  # fmt: skip
    if not low or any(len(a) != len(b) or len(a) < 2 for a, b in zip(low, high, strict=True)):
        return None, None
    lengths = np.array([len(ring) for ring in low], np.int64)
    count = int(lengths.sum())
    points = np.concatenate([*low, *high])
    closed = bool(geometry.Profile3d(0, 0.0).IsClosed)
    quads = []
    for start, n in zip(np.cumsum(lengths) - lengths, lengths, strict=True):
        here = start + np.arange(n if closed else n - 1)
        there = start + (np.arange(n if closed else n - 1) + 1) % n
        quads.append(np.column_stack([here, there, there + count, here + count]))
    caps = []
    ends = ((geometry.IsCappedAtBottom, 0), (geometry.IsCappedAtTop, count))
    for is_capped, first in ends:
        if is_capped and closed:
            cut = triangulate(points, np.arange(count) + first, lengths, np.array([len(lengths)]))
            faces = cut.faces[:, ::-1] if first == 0 else cut.faces
            caps.append(faces[:, [0, 1, 2, 2]])
    return points, np.concatenate([*quads, *caps]).astype(np.int64)


def _sample(curve: Any) -> NDArray[np.float64]:
    """Return the corners (n, 3) of a profile, those of a closed one once."""
    if curve.IsPolyline():
        points = [(point.X, point.Y, point.Z) for point in curve.TryGetPolyline()]
    else:
        begin, end = curve.Domain.T0, curve.Domain.T1
        samples = (curve.PointAt(at) for at in np.linspace(begin, end, _PIECES + 1).tolist())
        points = [(point.X, point.Y, point.Z) for point in samples]
    return np.array(points[:-1] if curve.IsClosed else points, np.float64).reshape(-1, 3)
