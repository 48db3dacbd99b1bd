"""Binary glTF 2.0: one buffer, filled array by array, and the tree that names what lies where."""

import json
import os
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["Glb", "turn_up"]

_VERTICES, _INDICES = 34962, 34963  # targets of buffer views
_TYPES = {"f": 5126, "B": 5121, "I": 5125}
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


def turn_up(points: NDArray[np.float64]) -> NDArray[np.float32]:
    """Turn z up to glTF's y up, (n, 3) float32."""
    return np.ascontiguousarray(points[:, [0, 2, 1]] * (1, 1, -1), "<f4")


class Glb:
    """
    A file in the making.

    Parameters
    ----------
    generator : str
        What writes it.
    extras : dict
        Said of the whole file.
    """

    def __init__(self, generator: str, extras: dict[str, object]) -> None:
        self.data = bytearray()
        self.views: list[dict[str, object]] = []
        self.accessors: list[dict[str, object]] = []
        self.nodes: list[dict[str, object]] = []
        self.meshes: list[dict[str, object]] = []
        self.materials: list[dict[str, object]] = []
        self.more: dict[str, object] = {}
        self.asset = {"version": "2.0", "generator": generator, "extras": extras}

    def add_material(self, *, lit: bool = True, **more: object) -> int:
        """
        Add a rough material that is seen from both sides; give its index.

        If it is not lit, viewers show its colours as they are, without light and shade.
        """
        rough = {"metallicFactor": 0, "roughnessFactor": 1, **more}
        material: dict[str, object] = {"pbrMetallicRoughness": rough, "doubleSided": True}
        if not lit:
            material["extensions"] = {"KHR_materials_unlit": {}}
            self.more["extensionsUsed"] = ["KHR_materials_unlit"]
        self.materials.append(material)
        return len(self.materials) - 1

    def add_texture(self, png: bytes) -> int:
        """Add a picture whose pixels stay sharp squares; give its texture's index."""
        view = self._add_bytes(png)
        self.more["images"] = [{"bufferView": view, "mimeType": "image/png"}]
        self.more["samplers"] = [
            {
                "magFilter": 9728,
                "minFilter": 9728,
                "wrapS": 33071,
                "wrapT": 33071,
            }  # nearest, clamped
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
        found = {key: self._add(array, _VERTICES, key) for key, array in attributes.items()}
        indices = self._add(np.ascontiguousarray(faces, "<u4").reshape(-1, 1), _INDICES)
        primitive = {"attributes": found, "indices": indices, "material": material}
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

    def _add_bytes(self, data: bytes, **more: object) -> int:
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more}
        self.views.append(view)
        self.data.extend(data)
        self.data.extend(b"\0" * (-len(self.data) % 4))
        return len(self.views) - 1

    def _add(self, array: NDArray, target: int, key: str = "") -> int:
        accessor: dict[str, object] = {
            "bufferView": self._add_bytes(array.tobytes(), target=target),
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
