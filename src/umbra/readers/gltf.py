"""glTF 2.0 and GLB: nodes with transforms; instances share one mesh."""

from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.gltf_buffers import Buffers, split_glb
from umbra.readers.model import Model
from umbra.readers.turn import turning
from umbra.scene import Material, Mesh, Part
from umbra.scene.material import GREY

__all__ = ["read_gltf", "read_gltf_tree"]

# Extensions that change geometry; any other may be ignored without harm.
GEOMETRY_EXTENSIONS = {
    "KHR_draco_mesh_compression": "decompress it (gltf-transform draco is one tool)",
    "EXT_meshopt_compression": "decompress it (gltfpack without -c writes it plain)",
    "KHR_meshopt_compression": "decompress it (gltfpack without -c writes it plain)",
    "EXT_mesh_gpu_instancing": "write its instances as nodes",
}

TRIANGLES, STRIP, FAN = 4, 5, 6

Primitive = tuple[str, tuple[float, float, float], Mesh]


def read_gltf(data: bytes, path: Path, up: str | None = None) -> Model:
    """
    Read a GLB file.

    Parameters
    ----------
    data : bytes
    path : Path
        Buffers in other files are looked for beside it.
    up : {'x', 'y', 'z'}, optional
        y if None, as glTF says.

    Returns
    -------
    model : Model
        A part for each node and material.

    Raises
    ------
    InputError
        If the file is damaged, or compressed in a way that is not read.
    """
    text, binary = split_glb(data)
    try:
        tree = orjson.loads(text)
    except orjson.JSONDecodeError as error:
        msg = f"its JSON chunk is broken at byte {error.pos} ({error.msg}); export it again"
        raise InputError(msg) from error
    if not isinstance(tree, dict):
        msg = "its JSON chunk holds no glTF; export it again"
        raise InputError(msg)
    return read_gltf_tree(tree, binary, path, up)


def read_gltf_tree(
    tree: dict[str, Any], binary: bytes | None, path: Path, up: str | None = None
) -> Model:
    """Read parsed glTF with the binary chunk of a GLB, if it is one; see `read_gltf`."""
    version = str(tree.get("asset", {}).get("version", "2.0"))
    if not version.startswith("2"):
        msg = f"is glTF {version}; umbra reads 2.0, convert it (gltf-pipeline is one tool)"
        raise InputError(msg, version=version)
    for name in tree.get("extensionsUsed", ()):
        if name in GEOMETRY_EXTENSIONS:
            msg = f"uses {name}, which is not read; {GEOMETRY_EXTENSIONS[name]}"
            raise InputError(msg, extension=name)
    buffers = Buffers(tree, binary, path)
    counts: dict[str, int] = {}
    meshes: dict[int, list[Primitive]] = {}
    parts: list[Part] = []
    nodes = tree.get("nodes", [])
    for index, transform in _place_nodes(tree, turning(up or "y")):
        node = nodes[index]
        if "mesh" not in node:
            continue
        mesh = node["mesh"]
        if mesh not in meshes:
            meshes[mesh] = _read_mesh(tree, mesh, buffers, counts)
        if "skin" in node:
            what = "skinned nodes read in their rest pose"
            counts[what] = counts.get(what, 0) + 1
        name = str(node.get("name") or _item(tree, "meshes", mesh).get("name") or f"node {index}")
        parts += [
            Part(name, kind, piece, transform, Material(color))
            for kind, color, piece in meshes[mesh]
        ]
    notes = tuple(f"{what}: {count}" for what, count in counts.items())
    form = "GLB" if binary is not None else "glTF"
    return Model(f"{form} {version}", tuple(parts), notes=notes, companions=buffers.sources)


def _item(tree: dict[str, Any], key: str, index: Any) -> Any:
    items = tree.get(key, [])
    if type(index) is not int or not 0 <= index < len(items):
        msg = f"names {key}[{index}], but there are {len(items)}; export it again"
        raise InputError(msg)
    return items[index]


def _place_nodes(
    tree: dict[str, Any], base: NDArray[np.float64]
) -> list[tuple[int, NDArray[np.float64]]]:
    """Give the nodes of the scene, parents first, with their transforms to the scene."""
    nodes = tree.get("nodes", [])
    if tree.get("scenes"):
        roots = _item(tree, "scenes", tree.get("scene", 0)).get("nodes", [])
    else:
        children = {child for node in nodes for child in node.get("children", ())}
        roots = [index for index in range(len(nodes)) if index not in children]
    placed: list[tuple[int, NDArray[np.float64]]] = []
    seen: set[int] = set()
    stack = [(root, base) for root in reversed(roots)]
    while stack:
        index, parent = stack.pop()
        node = _item(tree, "nodes", index)
        if index in seen:
            msg = f"node {index} stands in two places of the tree; export it again"
            raise InputError(msg, node=index)
        seen.add(index)
        transform = parent @ _local_transform(node)
        placed.append((index, transform))
        stack += [(child, transform) for child in reversed(node.get("children", ()))]
    return placed


def _local_transform(node: dict[str, Any]) -> NDArray[np.float64]:
    if "matrix" in node:
        # Column by column in the file.
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64).reshape(4)
    norm = x * x + y * y + z * z + w * w
    if norm > 0:
        s = 2 / norm
        matrix[:3, :3] = [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    matrix[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), np.float64).reshape(3)
    matrix[:3, 3] = np.array(node.get("translation", (0, 0, 0)), np.float64).reshape(3)
    return matrix


def _read_mesh(
    tree: dict[str, Any], index: int, buffers: Buffers, counts: dict[str, int]
) -> list[Primitive]:
    pieces: list[Primitive] = []
    for number, primitive in enumerate(_item(tree, "meshes", index)["primitives"]):
        mode = primitive.get("mode", TRIANGLES)
        if mode not in {TRIANGLES, STRIP, FAN} or "POSITION" not in primitive["attributes"]:
            what = "primitives without triangles (points or lines) left out"
            counts[what] = counts.get(what, 0) + 1
            continue
        where = f"mesh {index}, primitive {number}"
        vertices = buffers.read_accessor(primitive["attributes"]["POSITION"], where)
        if vertices.shape[1] != 3:
            msg = f"{where}: positions have {vertices.shape[1]} coordinates; export it again"
            raise InputError(msg)
        if "indices" in primitive:
            corners = buffers.read_accessor(primitive["indices"], where).ravel()
        else:
            corners = np.arange(len(vertices))
        if len(corners) and not 0 <= corners.min() <= corners.max() < len(vertices):
            bad = int(((corners < 0) | (corners >= len(vertices))).sum())
            msg = (
                f"{where} names vertex {int(corners.max())}, but has {len(vertices)} vertices "
                f"({bad} such corners in all); export it again"
            )
            raise InputError(msg, count=bad)
        kind, color = "", GREY
        if "material" in primitive:
            material = _item(tree, "materials", primitive["material"])
            kind = str(material.get("name") or f"material {primitive['material']}")
            factor = material.get("pbrMetallicRoughness", {}).get("baseColorFactor", (1, 1, 1, 1))
            color = (float(factor[0]), float(factor[1]), float(factor[2]))
        faces = _join_corners(corners.astype(np.int64), mode)
        pieces.append((kind, color, Mesh(vertices.astype(np.float64), faces.astype(np.int32))))
    return pieces


def _join_corners(corners: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """Give triangles (n, 3) of a list, a strip or a fan of corners."""
    if mode == TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if len(corners) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == FAN:
        return np.stack([np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]], axis=1)
    strip = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    strip[1::2] = strip[1::2, [1, 0, 2]]  # every other one is wound the other way
    # Exporters join strips with triangles that repeat a corner.
    a, b, c = strip.T
    return strip[(a != b) & (b != c) & (c != a)]
