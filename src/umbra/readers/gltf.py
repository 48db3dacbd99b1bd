"""glTF 2.0 and GLB: nodes with transforms, skins and animations; instances share one mesh."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from umbra.errors import InputError
from umbra.readers.checks import list_counts
from umbra.readers.gltf_buffers import Buffers, find_item, split_glb
from umbra.readers.gltf_earth import find_centre, put_on_earth
from umbra.readers.gltf_materials import Materials
from umbra.readers.gltf_meshes import Piece, read_mesh
from umbra.readers.gltf_nodes import (
    list_instances,
    read_animations,
    read_lights,
    read_nodes,
    read_skin,
)
from umbra.readers.model import FileModel, ReadChoices, UniqueNames, turning
from umbra.scene import Mesh, Part
from umbra.scene.making import place_part
from umbra.scene.rig import RigBinding, Shape, Skin

__all__ = ["read_gltf", "read_gltf_content", "read_gltf_tree"]

# Extensions needed to read geometry right; others only change looks.
PART = 1000  # [byte] of a part without its mesh
KNOWN = (
    "CESIUM_RTC",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture",
)


def read_gltf(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read a GLB file; y is up by default, as glTF says."""
    tree, binary = _parse_glb(data)
    return read_gltf_tree(tree, binary, path, choices)


def _parse_glb(data: bytes) -> tuple[dict[str, Any], bytes | None]:
    text, binary = split_glb(data)
    try:
        tree = orjson.loads(text)
    except orjson.JSONDecodeError as error:
        msg = f"its JSON chunk is broken at byte {error.pos} ({error.msg}); export it again"
        raise InputError(msg, byte=error.pos) from error
    if not isinstance(tree, dict):
        msg = "its JSON chunk holds no glTF; export it again"
        raise InputError(msg)
    return tree, binary


def read_gltf_content(data: bytes, path: Path, choices: ReadChoices) -> FileModel | None:
    """Read a tile's glTF, GLB or JSON, in its own coordinates; None if it begins as neither."""
    if data[:4] == b"glTF":
        return _read_tree(*_parse_glb(data), path, choices)
    if data.lstrip()[:1] == b"{":
        return _read_tree(orjson.loads(data), None, path, choices)
    return None


def read_gltf_tree(
    tree: dict[str, Any], binary: bytes | None, path: Path, choices: ReadChoices
) -> FileModel:
    """Read parsed glTF, with the binary chunk of a GLB, and where on the earth it lies."""
    return put_on_earth(_read_tree(tree, binary, path, choices), tree, choices)


def _read_tree(
    tree: dict[str, Any], binary: bytes | None, path: Path, choices: ReadChoices
) -> FileModel:
    """
    Read parsed glTF in its own coordinates.

    Skins and morph targets are posed by the file's nodes and weights, before any animation,
    as in viewers.
    """
    version = str(tree.get("asset", {}).get("version", "2.0"))
    if not version.startswith("2"):
        msg = (
            f"is glTF {version}; umbra reads 2.0, convert it (npx gltf-pipeline -i FILE -o OUT.glb)"
        )
        raise InputError(msg, version=version)
    companions = choices.companions_of(path)
    buffers = Buffers(tree, binary, companions, choices.budget)
    counts: Counter[str] = Counter()
    materials = Materials(tree, buffers, companions, counts)
    for name in tree.get("extensionsRequired", ()):
        if not name.startswith(KNOWN):
            counts[f"properties of the extension {name} left out"] += 1
    list_instances(tree, buffers)
    rig, slots, shown = read_nodes(tree, find_centre(tree) @ turning(choices.up or "y"))
    nodes = tree.get("nodes", [])
    places = [(nodes[index], index, slot) for index, slot in list(slots.items())[:shown]]
    meshes: dict[int, list[Piece]] = {}
    pieces: dict[int, list[Piece]] = {}  # by place in the rig
    for node, _, slot in places:
        if "mesh" in node:
            mesh = node["mesh"]
            if mesh not in meshes:
                meshes[mesh] = read_mesh(tree, mesh, buffers, materials, counts)
            pieces[slot] = meshes[mesh]
    many = sum(map(len, pieces.values()))
    buffers.budget.spend(PART * many, f"{many:,} parts, each primitive at each node that shows it")
    targets = {
        slot: len(piece.offsets)
        for slot, group in pieces.items()
        for piece in group
        if piece.offsets is not None
    }
    rig = read_animations(tree, rig, slots, targets, buffers, counts)
    placed = rig.place()
    shapes = _Shapes(tree, slots, buffers)
    bent: dict[tuple[int, int], Mesh] = {}
    parts: list[Part] = []
    unique = UniqueNames()
    for node, index, slot in places:
        if not pieces.get(slot):
            continue
        mesh_name = find_item(tree, "meshes", node["mesh"]).get("name")
        word = str(node.get("name") or mesh_name or f"node {index}")
        name = unique.add(word)
        tags = (word,) if name != word else ()
        for piece in pieces[slot]:
            surface = piece.surface
            part = Part(
                name, surface.kind, piece.mesh, placed[0][slot], surface.material, tags=tags
            )
            shape = shapes.find(node, piece)
            if shape is not None or rig.animations:
                binding = RigBinding(rig, slot, shape=shape)
                part = place_part(part, binding, placed, bent)
                part = replace(part, binding=binding) if rig.animations else part
            parts.append(part)
    lights = [
        light for node, _, slot in places for light in read_lights(tree, node, rig, slot, placed[0])
    ]
    counts["nodes with a repeated name, numbered"] += unique.numbered
    return FileModel(
        f"{'GLB' if binary is not None else 'glTF'} {version}",
        tuple(parts),
        notes=list_counts(counts),
        companions=buffers.sources,
        lights=tuple(lights),
    )


class _Shapes:
    """Bending shapes, shared by the nodes that show the same one."""

    def __init__(self, tree: dict[str, Any], slots: dict[int, int], buffers: Buffers) -> None:
        self._tree = tree
        self._slots = slots
        self._buffers = buffers
        self._skins: dict[int, Skin] = {}
        self._shapes: dict[tuple[int, int | None, tuple[float, ...]], Shape] = {}

    def find(self, node: dict[str, Any], piece: Piece) -> Shape | None:
        """Return a primitive's shape at a node; None if it moves as a whole."""
        number = node.get("skin") if piece.joints is not None else None
        if number is None and piece.offsets is None:
            return None
        given = node.get("weights", find_item(self._tree, "meshes", node["mesh"]).get("weights"))
        key = id(piece), number, tuple(map(float, given or ()))
        if key not in self._shapes:
            self._shapes[key] = self._make(piece, number, key[2])
        return self._shapes[key]

    def _make(self, piece: Piece, number: int | None, given: tuple[float, ...]) -> Shape:
        self._buffers.budget.spend(2 * piece.mesh.vertices.nbytes, piece.where)
        count = 0 if piece.offsets is None else len(piece.offsets)
        weights = np.zeros(count)
        weights[: len(given)] = given[:count]
        shape = Shape(piece.mesh, weights, piece.offsets, piece.normal_offsets)
        if number is None or piece.joints is None or piece.influences is None:
            return shape
        if number not in self._skins:
            self._skins[number] = read_skin(self._tree, number, self._slots, self._buffers)
        skin = self._skins[number]
        beyond = piece.joints >= len(skin.joints)
        wrong = beyond & (piece.influences != 0)
        if wrong.any():
            vertex, column = np.argwhere(wrong)[0]
            msg = (
                f"{piece.where}: {int(wrong.any(1).sum())} vertices use joints that skin "
                f"{number} does not have (first: vertex {vertex} on joint "
                f"{piece.joints[vertex, column]} of {len(skin.joints)}); export it again"
            )
            raise InputError(msg, vertex=int(vertex))
        return replace(
            shape, skin=skin, joints=np.where(beyond, 0, piece.joints), influences=piece.influences
        )
