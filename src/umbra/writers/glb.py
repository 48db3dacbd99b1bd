"""
Models as GLB, with surfaces coloured by hours in shadow.

Binary glTF 2.0 is one buffer, filled array by array, and the tree that describes the arrays.
"""

import json
import os
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from umbra.scene.material import find_linear
from umbra.study import Study, tell_dates
from umbra.writers.pixels import shade_ramp

__all__ = ["Glb", "list_corners", "make_legend", "turn_y_up", "write_model_glb"]

_VERTICES, _INDICES = 34962, 34963  # targets of buffer views
_TYPES = {"f": 5126, "B": 5121, "I": 5125}
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
MOST_TRIANGLES = 400_000
"""Most triangles of coloured surfaces."""
MOST_GROUND = 400
"""Cells along the longer side of the ground."""
GREY = (0.80, 0.80, 0.80)
_LEVEL = 0.1  # least z of the unit normal of a face coloured from above
_FLAT = 1e-6  # above the ground something stands [m]
_NEAR = 0.35  # largest difference between a cell's and its surface's height [m]


def turn_y_up(points: NDArray[np.float64]) -> NDArray[np.float32]:
    """Turn z up to glTF's y up, (n, 3) float32."""
    return np.ascontiguousarray(points[:, [0, 2, 1]] * (1, 1, -1), "<f4")


class Glb:
    """Builder of a GLB file, with its generator's name and extras."""

    def __init__(self, generator: str, extras: dict[str, object]) -> None:
        self.data = bytearray()
        self.views: list[dict[str, object]] = []
        self.accessors: list[dict[str, object]] = []
        self.nodes: list[dict[str, object]] = []
        self.meshes: list[dict[str, object]] = []
        self.materials: list[dict[str, object]] = []
        self.more: dict[str, object] = {}
        self.asset = {"version": "2.0", "generator": generator, "extras": extras}

    @classmethod
    def of_study(cls, study: Study, origin: NDArray[np.float64], most: float) -> Self:
        """Begin the file of a study about an origin (3,) [m]; ``most`` hours end the scale."""
        extras = {
            "origin": np.asarray(origin, np.float64).tolist(),
            "crs": study.facts.get("crs"),
            "date": tell_dates(study),
            "hours_of_darkest": most,
            "legend": make_legend(most),
        }
        return cls(f"umbra {study.facts['umbra_version']}", extras)

    def add_material(self, *, lit: bool = True, **more: object) -> int:
        """
        Add a rough material that is seen from both sides; return its index.

        If it is not lit, viewers show its colours as they are, without light and shade.
        """
        rough = {"metallicFactor": 0, "roughnessFactor": 1, **more}
        material: dict[str, object] = {"pbrMetallicRoughness": rough, "doubleSided": True}
        if not lit:
            material["extensions"] = {"KHR_materials_unlit": {}}
            self.use("KHR_materials_unlit")
        self.materials.append(material)
        return len(self.materials) - 1

    def use(self, *extensions: str) -> None:
        """List extensions that the file uses."""
        known = self.more.setdefault("extensionsUsed", [])
        assert isinstance(known, list)
        known += [name for name in extensions if name not in known]

    def add_texture(self, png: bytes) -> int:
        """Add a picture whose pixels stay sharp squares; return its texture's index."""
        view = self.add_bytes(png)
        self.more["images"] = [{"bufferView": view, "mimeType": "image/png"}]
        nearest, clamped = 9728, 33071
        self.more["samplers"] = [
            {"magFilter": nearest, "minFilter": nearest, "wrapS": clamped, "wrapT": clamped}
        ]
        self.more["textures"] = [{"source": 0, "sampler": 0}]
        return 0

    def add_mesh(
        self,
        name: str,
        faces: NDArray[np.unsignedinteger],
        material: int,
        extras: dict[str, object] | None = None,
        **attributes: NDArray,
    ) -> None:
        """
        Add a node with a mesh of its own: faces (n, 3), and by name arrays of its vertices.

        ``POSITION`` is float32, ``COLOR_0`` uint8, ``TEXCOORD_0`` float32; extras are the node's.
        """
        accessors = {key: self._add(array, _VERTICES, key) for key, array in attributes.items()}
        indices = self._add(np.ascontiguousarray(faces, "<u4").reshape(-1, 1), _INDICES)
        primitive = {"attributes": accessors, "indices": indices, "material": material}
        self.meshes.append({"name": name, "primitives": [primitive]})
        node: dict[str, object] = {"name": name, "mesh": len(self.meshes) - 1}
        self.nodes.append(node | ({"extras": extras} if extras else {}))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the file."""
        tree = {
            "asset": self.asset,
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self.nodes)))}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.data)}],
            **self.more,
        }
        text = json.dumps(tree).encode()
        text += b" " * (-len(text) % 4)
        with Path(path).open("wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(self.data)))
            file.write(struct.pack("<I4s", len(text), b"JSON") + text)
            file.write(struct.pack("<I4s", len(self.data), b"BIN\0") + self.data)

    def add_bytes(self, data: bytes, **more: object) -> int:
        """Add bytes, which begin at a multiple of 8; return the index of their view."""
        self.data.extend(b"\0" * (-len(self.data) % 8))
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more}
        self.views.append(view)
        self.data.extend(data)
        self.data.extend(b"\0" * (-len(self.data) % 4))
        return len(self.views) - 1

    def _add(self, array: NDArray, target: int, key: str = "") -> int:
        accessor: dict[str, object] = {
            "bufferView": self.add_bytes(array.tobytes(), target=target),
            "componentType": _TYPES[array.dtype.char],
            "count": len(array),
            "type": _KINDS[array.shape[1]],
        }
        if key == "POSITION":
            accessor |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        if array.dtype == np.uint8:
            accessor["normalized"] = True
        self.accessors.append(accessor)
        return len(self.accessors) - 1


@dataclass(frozen=True, eq=False)
class _Mesh:
    """A node of the file: triangles in the model's axes and colours of their corners."""

    name: str
    positions: NDArray[np.float64]
    colors: NDArray[np.float32]
    faces: NDArray[np.uint32]


def write_model_glb(
    path: str | os.PathLike[str], study: Study, most_hours: float | None = None
) -> None:
    """
    Write a plan's model and ground; its colours are as in ``hours.png``, walls are grey.

    With the topmost surfaces as receivers, faces seen from above are divided to about a
    cell's size and each corner takes the colour of its cell. The ground lies below them. Where
    several files share a scale, ``most_hours`` is its end [h].
    """
    most = study.up_hours if most_hours is None else most_hours
    soup = study.model.soup
    own = study.model.scene.list_own()
    faces = soup.faces
    if own is not None and study.kind.lies_under_roofs:  # cells make the ground
        faces = faces[np.isin(soup.part, own)]
    corners = soup.vertices[faces]
    meshes = []
    if not study.kind.lies_under_roofs:
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1)
        is_seen = np.abs(normal[:, 2]) > _LEVEL * np.maximum(length, 1e-12)
        side = max(study.grid.dx, study.grid.dy)
        divided = _divide(corners[is_seen], side)
        meshes.append(_colored("surfaces", divided, _sample(study, divided, most)))
        corners = corners[~is_seen]
    meshes.append(_colored("model", corners, None))
    meshes.append(_make_ground(study, most))
    origin = np.array([study.x[0] - study.grid.x0, study.y[0] - study.grid.y0])
    _write(path, [mesh for mesh in meshes if len(mesh.faces)], study, origin, most)


def _find_ground(study: Study) -> float:
    """Return z of the ground in the model's local frame [m]."""
    return float(study.model.ground or 0.0)


def _colored(name: str, corners: NDArray[np.float64], colors: NDArray | None) -> _Mesh:
    """Make a mesh whose triangles have corners of their own, so that edges stay sharp."""
    flat = corners.reshape(-1, 3)
    if colors is None:
        colors = np.broadcast_to(np.array(GREY, np.float32), flat.shape)
    return _Mesh(name, flat, colors, list_corners(flat))


def list_corners(points: NDArray) -> NDArray[np.uint32]:
    """Return faces (n, 3) whose corners are their own, of points (3 n, 3)."""
    return np.arange(len(points), dtype=np.uint32).reshape(-1, 3)


def _divide(corners: NDArray[np.float64], side: float) -> NDArray[np.float64]:
    """Halve triangles at their longest edges until none is longer than ``side``, or enough."""
    if not len(corners):
        return corners
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    side = max(side, np.sqrt(area.sum() / MOST_TRIANGLES) * 2)
    done = []
    while len(corners):
        edges = np.linalg.norm(np.roll(corners, -1, 1) - corners, axis=2)
        is_long = edges.max(1) > side
        done.append(corners[~is_long])
        corners, edges = corners[is_long], edges[is_long]
        if len(corners) * 2 + sum(map(len, done)) > 2 * MOST_TRIANGLES:
            done.append(corners)
            break
        # Turn the longest edge to the front, then cut it in the middle.
        order = (edges.argmax(1)[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(corners, order[..., None], 1).transpose(1, 0, 2)
        middle = (a + b) / 2
        corners = np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
    return np.concatenate(done)


def _sample(study: Study, corners: NDArray[np.float64], most: float) -> NDArray[np.float32]:
    """Take each corner's colour from the raster; grey where another surface is on top."""
    middle = corners.mean(1, keepdims=True)
    inward = (corners + 1e-3 * (middle - corners)).reshape(-1, 3)  # off the edge, into its face
    grid = study.grid
    col = np.rint((inward[:, 0] - grid.x0) / grid.dx).astype(int)
    row = np.rint((inward[:, 1] - grid.y0) / grid.dy).astype(int)
    is_in = (col >= 0) & (col < grid.cols) & (row >= 0) & (row < grid.rows)
    col, row = np.clip(col, 0, grid.cols - 1), np.clip(row, 0, grid.rows - 1)
    colors = _find_colors(study.shadow_hours[row, col], most)
    height = study.heights[row, col] - (study.ground - _find_ground(study))
    # A slope's cell centre lies up to a cell from the corner.
    reach = _NEAR + np.repeat(np.ptp(corners[..., 2], axis=1), 3) + max(grid.dx, grid.dy)
    colors[~is_in | (np.abs(height - inward[:, 2]) > reach)] = GREY
    return colors


def _find_colors(hours: NDArray[np.float32], most: float) -> NDArray[np.float32]:
    """Colour hours as the sheet does, in linear light as glTF wants vertex colours."""
    linear = find_linear(shade_ramp())
    share = np.nan_to_num(hours) / max(most, 1e-9)
    colors = linear[np.clip(share * (len(linear) - 1) + 0.5, 0, len(linear) - 1).astype(np.intp)]
    colors[np.isnan(hours)] = GREY
    return colors.astype(np.float32)


def _make_ground(study: Study, most: float) -> _Mesh:
    """Lay a grid under the model, each corner coloured by its cell."""
    grid = study.grid
    stride = max(1, -(-max(grid.rows, grid.cols) // MOST_GROUND))
    rows, cols = np.arange(0, grid.rows, stride), np.arange(0, grid.cols, stride)
    hours = study.shadow_hours[np.ix_(rows, cols)]
    x, y = np.meshgrid(grid.x[cols], grid.y[rows])
    ground = _find_ground(study)
    z = np.full(x.shape, ground)
    if study.kind.lies_under_roofs and not study.kind.is_level:
        kind: Any = study.kind
        heights = kind.find_receiver_z(study.laid)[np.ix_(rows, cols)]
        z = heights - (study.ground - ground)
    points = np.stack([x, y, z], -1).reshape(-1, 3)
    index = np.arange(x.size, dtype=np.uint32).reshape(x.shape)
    a, b = index[:-1, :-1], index[:-1, 1:]
    c, d = index[1:, 1:], index[1:, :-1]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], 2).reshape(-1, 3)
    faces = faces[np.isfinite(points[faces, 2]).all(1)]
    points = np.nan_to_num(points)
    colors = _find_colors(hours.ravel(), most)
    if not study.kind.lies_under_roofs:
        height = study.heights[np.ix_(rows, cols)].ravel() - study.ground
        colors[height > _FLAT] = GREY
    return _Mesh("ground", points, colors, faces)


def _write(
    path: str | os.PathLike[str],
    meshes: Sequence[_Mesh],
    study: Study,
    origin: NDArray,
    most: float,
) -> None:
    """Pack meshes into a GLB about the plan's middle; glTF's y is up."""
    bounds = np.concatenate([[mesh.positions.min(0), mesh.positions.max(0)] for mesh in meshes])
    middle = np.round((bounds.min(0) + bounds.max(0)) / 2)
    middle[2] = _find_ground(study)
    glb = Glb.of_study(study, np.array([*(middle[:2] + origin), study.ground]), most)
    material = glb.add_material(lit=False)
    for mesh in meshes:
        colors = np.full((len(mesh.positions), 4), 255, np.uint8)
        colors[:, :3] = np.rint(mesh.colors * 255)
        points = turn_y_up(mesh.positions - middle)
        glb.add_mesh(mesh.name, mesh.faces, material, POSITION=points, COLOR_0=colors)
    glb.write(path)


def make_legend(up_hours: float) -> list[dict[str, object]]:
    """Return the colours of hours in shadow at even steps, sRGB in hex."""
    ramp = np.rint(shade_ramp() * 255).astype(int)
    return [
        {
            "shadow_hours": round(share * up_hours, 3),
            "color": "#{:02x}{:02x}{:02x}".format(*ramp[round(share * (len(ramp) - 1))]),
        }
        for share in np.linspace(0, 1, 9).tolist()
    ]
