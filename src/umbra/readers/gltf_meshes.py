"""
glTF's meshes: triangles of lists, strips and fans, and vertex attributes.

Tangents of meshes for normal maps, as MikkTSpace defines them.

glTF's normal maps are made for the tangents in the file or, if it has none, for those of
MikkTSpace: each face's direction of growing u, averaged by angle over the faces around a point
with one position, normal and texture coordinate that are not mirrored against each other.

Source: M. Mikkelsen, Simulation of Wrinkled Surfaces Revisited, 2008; glTF 2.0, 3.7.2.1.
"""

from collections import Counter
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.checks import find_reason
from umbra.readers.gltf_buffers import Buffers, find_item
from umbra.readers.gltf_materials import GltfSurface, Materials, TextureTransform
from umbra.scene import Mesh

__all__ = ["Piece", "find_tangents", "read_mesh"]


def find_tangents(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    normals: NDArray[np.float32],
    uv: NDArray[np.float32],
) -> NDArray[np.float32]:
    """
    Find the tangents of a mesh with normals.

    Points whose faces are mirrored against each other get none, so that each side's tangents are
    those of its other corners.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    normals : (n, 3) float32
    uv : (n, 2) float32
        v grows downward in the image.

    Returns
    -------
    tangents : (n, 4) float32
        Unit vectors along u, and 1 or -1, by which the product of normal and tangent points up
        in the image; all 0 where there are none.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    (u1, v1), (u2, v2) = ((uv[faces[:, k]] - uv[faces[:, 0]]).T.astype(np.float64) for k in (1, 2))
    area = u1 * v2 - u2 * v1  # with v downward: below 0 where the image is not mirrored
    along = np.sign(area)[:, None] * ((b - a) * v2[:, None] - (c - a) * v1[:, None])

    rows = np.ascontiguousarray(np.column_stack([vertices, normals, uv]).astype(np.float64))
    _, point = np.unique(rows.view(f"V{rows.strides[0]}").ravel(), return_inverse=True)
    total = np.zeros((point.max(initial=-1) + 1, 3))
    hands = np.zeros((2, len(total)), np.bool_)
    for k in range(3):
        here = faces[:, k]
        normal = normals[here].astype(np.float64)
        to_next, to_last = (
            _project(vertices[faces[:, (k + step) % 3]] - vertices[here], normal) for step in (1, 2)
        )
        angle = np.arccos(np.clip(np.einsum("ij,ij->i", to_next, to_last), -1.0, 1.0))
        for axis in range(3):
            total[:, axis] += np.bincount(
                point[here], angle * _project(along, normal)[:, axis], len(total)
            )
        for hand, is_mine in enumerate((area > 0, area < 0)):
            hands[hand, point[here[is_mine]]] = True
    total[hands.all(0)] = 0.0
    tangents = np.zeros((len(vertices), 4), np.float32)
    tangents[:, :3] = _unit(total)[point]
    has_one = tangents.any(1)
    tangents[has_one, 3] = np.where(hands[0], -1.0, 1.0)[point[has_one]]
    return tangents


def _project(ways: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit vectors across normals, (n, 3); 0 where there is no such direction."""
    return _unit(ways - normals * np.einsum("ij,ij->i", ways, normals)[:, None])


def _unit(ways: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.linalg.norm(ways, axis=1, keepdims=True)
    return ways / np.where(length > 0, length, 1.0)


DRACO = "KHR_draco_mesh_compression"
TRIANGLES, STRIP, FAN = 4, 5, 6
ODD = "normals, texture coordinates or colours that do not fit their vertices, left out"


@dataclass(frozen=True, eq=False)
class Piece:
    """A primitive: the triangles of one mesh with one material."""

    where: str  # for errors
    surface: GltfSurface
    mesh: Mesh  # unposed
    offsets: NDArray[np.float32] | None = None  # (n_targets, n_vertices, 3): of morph targets
    # (n_targets, n_vertices, 3): of morph targets
    normal_offsets: NDArray[np.float32] | None = None
    joints: NDArray[np.int64] | None = None  # (n_vertices, n_influences)
    # (n_vertices, n_influences): each vertex's sum to 1
    influences: NDArray[np.float64] | None = None


def read_mesh(
    tree: dict[str, Any], index: int, buffers: Buffers, materials: Materials, counts: Counter[str]
) -> list[Piece]:
    """Read a mesh."""
    pieces: list[Piece] = []
    for number, primitive in enumerate(find_item(tree, "meshes", index)["primitives"]):
        mode, attributes = primitive.get("mode", TRIANGLES), primitive["attributes"]
        if mode not in {TRIANGLES, STRIP, FAN} or "POSITION" not in attributes:
            counts["primitives without triangles (points or lines) left out"] += 1
            continue
        where = f"mesh {index}, primitive {number}"
        unpacked = _unpack_draco(primitive, buffers, where)
        if unpacked is not None:
            mode = TRIANGLES
            for name in unpacked[1].keys() & attributes.keys():
                buffers.hold(attributes[name], unpacked[1][name])
        vertices = _read_vectors(buffers, attributes["POSITION"], where, "positions")
        if unpacked is not None:
            corners = unpacked[0]
        elif "indices" in primitive:
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
        # In float64, with corners of int64 on the way.
        buffers.budget.spend(24 * len(vertices) + 12 * len(corners), where)
        surface = materials.find(primitive.get("material"))
        faces = _join_corners(corners.astype(np.int64), mode)
        shown = {
            name: _read_shown(buffers, attributes.get(key), where, len(vertices), width, counts)
            for name, key, width in (("normals", "NORMAL", 3), ("colors", "COLOR_0", 3))
        }
        for name, placing in zip(
            ("uv", "uv2"), surface.placings or (TextureTransform(),), strict=False
        ):
            key = attributes.get(f"TEXCOORD_{placing.coordinates}")
            uv = _read_shown(buffers, key, where, len(vertices), 2, counts)
            shown[name] = None if uv is None else placing.transform(uv)
        if surface.material.alpha_mode != "opaque":
            key = attributes.get("COLOR_0")
            shown["alpha"] = _read_alpha(buffers, key, where, len(vertices))
        targets = primitive.get("targets", ())
        mesh = Mesh(vertices.astype(np.float64), faces.astype(np.int32), **shown)
        # Of a mesh that deforms they are found from its faces in each pose.
        deforms = targets or "JOINTS_0" in attributes
        bumps = surface.material.normal_image
        uv = None if bumps is None or deforms else mesh.find_uv(bumps)
        if uv is not None:
            mesh = _add_tangents(mesh, uv, buffers, attributes.get("TANGENT"), where, counts)
        joints, influences = None, None
        if tree.get("skins") and "JOINTS_0" in attributes and "WEIGHTS_0" in attributes:
            joints, influences = _read_influences(buffers, attributes, where, len(vertices))
        pieces.append(
            Piece(
                where,
                surface,
                mesh,
                _read_targets(buffers, targets, "POSITION", where, len(vertices)),
                _read_targets(buffers, targets, "NORMAL", where, len(vertices)),
                joints,
                influences,
            )
        )
    return pieces


def _add_tangents(
    mesh: Mesh,
    uv: NDArray[np.float32],
    buffers: Buffers,
    index: int | None,
    where: str,
    counts: Counter[str],
) -> Mesh:
    """Return a mesh with the file's tangents or, without any, those that glTF prescribes."""
    if mesh.normals is None:
        return mesh
    tangents = _read_shown(buffers, index, where, len(mesh.vertices), 4, counts)
    if tangents is None:
        tangents = find_tangents(mesh.vertices, mesh.faces, mesh.normals, uv)
    return replace(mesh, tangents=tangents)


def _read_vectors(buffers: Buffers, index: int, where: str, what: str) -> NDArray[Any]:
    vectors = buffers.read_accessor(index, where)
    if vectors.shape[1] != 3:
        msg = f"{where}: {what} have {vectors.shape[1]} coordinates; export it again"
        raise InputError(msg, where=where, count=vectors.shape[1])
    return vectors


def _read_shown(
    buffers: Buffers,
    index: int | None,
    where: str,
    count: int,
    width: int,
    counts: Counter[str] | None = None,
) -> NDArray[np.floating] | None:
    """Read an attribute that only pictures need; leave it out, and count it, if damaged."""
    if index is None:
        return None
    try:
        values = buffers.read_accessor(index, where)
    except (InputError, LookupError, TypeError, ValueError):
        values = np.zeros((0, 0))
    if len(values) != count or values.shape[1] < width:
        if counts is not None:
            counts[ODD] += 1
        return None
    return values[:, :width].astype(np.float32, copy=False)


def _read_alpha(
    buffers: Buffers, index: int | None, where: str, count: int
) -> NDArray[np.floating] | None:
    """Read the opacities of vertices, (n, 1); None where all are opaque."""
    colors = _read_shown(buffers, index, where, count, 4)
    return None if colors is None or (colors[:, 3] >= 1).all() else colors[:, 3:]


def _read_targets(
    buffers: Buffers, targets: Any, key: str, where: str, count: int
) -> NDArray[np.float32] | None:
    """Read the morph targets' offsets; zeros if absent."""
    if not any(key in target for target in targets):
        return None
    buffers.budget.spend(len(targets) * count * 12, where)
    offsets = np.zeros((len(targets), count, 3), np.float32)
    for number, target in enumerate(targets):
        if key not in target:
            continue
        moved = _read_vectors(buffers, target[key], where, "morph targets")
        if len(moved) != count:
            msg = (
                f"{where}: morph target {number} has {len(moved)} vertices, the mesh {count}; "
                "export it again"
            )
            raise InputError(msg, where=where, target=number)
        offsets[number] = moved
    return offsets


def _read_influences(
    buffers: Buffers, attributes: dict[str, int], where: str, count: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Read each vertex's joints and weights."""
    joints, weights = [], []
    for number in range(8):
        if f"JOINTS_{number}" not in attributes or f"WEIGHTS_{number}" not in attributes:
            break
        joints.append(buffers.read_accessor(attributes[f"JOINTS_{number}"], where))
        weights.append(buffers.read_accessor(attributes[f"WEIGHTS_{number}"], where))
        if not len(joints[-1]) == len(weights[-1]) == count:
            msg = (
                f"{where}: {len(joints[-1])} rows of joints and {len(weights[-1])} of weights "
                f"for {count} vertices; export it again"
            )
            raise InputError(msg, where=where, count=count)
    pulled = np.concatenate(weights, axis=1).astype(np.float64)
    total = np.zeros(count)
    for column in pulled.T:  # in one order, so that equal rows have equal sums
        total += column
    pulled[total == 0, 0] = 1.0
    return (
        np.concatenate(joints, axis=1).astype(np.int64),
        pulled / np.where(total == 0, 1.0, total)[:, None],
    )


def _join_corners(corners: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """Return triangles (n, 3) of a list, a strip or a fan of corners."""
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


def _unpack_draco(
    primitive: dict[str, Any], buffers: Buffers, where: str
) -> tuple[NDArray[np.int64], dict[str, NDArray[Any]]] | None:
    """
    Unpack a primitive of KHR_draco_mesh_compression: corners (3 n,), and arrays by glTF's names.

    None if it is not packed so, or has its arrays plain, too.
    """
    packed = primitive.get("extensions", {}).get(DRACO)
    if packed is None or buffers.has_bytes(primitive["attributes"].get("POSITION")):
        return None
    draco = need("DracoPy", "gltf", f"glTF with {DRACO}")
    data = buffers.read_bytes(packed["bufferView"], where)
    try:
        mesh = draco.decode(data)
    except (
        draco.FileTypeException,
        AssertionError,
        MemoryError,
        RuntimeError,
        ValueError,
    ) as error:
        msg = f"{where}: its Draco data is damaged ({find_reason(error, 80)}); export it again"
        raise InputError(msg, where=where) from error
    attributes = {}
    for name, number in packed["attributes"].items():
        attribute = mesh.get_attribute_by_unique_id(number)
        if attribute is None:
            msg = f"{where}: its Draco data has no attribute {number} ({name}); export it again"
            raise InputError(msg, where=where, attribute=number)
        values = np.asarray(attribute["data"])
        buffers.budget.spend(values.nbytes, where)
        attributes[name] = values.reshape(len(values), -1)
    faces = getattr(mesh, "faces", None)
    if faces is None:
        msg = f"{where}: its Draco data is a cloud of points; export it as a mesh"
        raise InputError(msg, where=where)
    return np.asarray(faces, np.int64).ravel(), attributes
