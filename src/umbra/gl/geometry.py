"""
A scene's points on the device, numbered so that instances share one copy of a mesh.

Points have *numbers*: parts without a transform lie in one range, each group of parts
that moves together in a range of its own. A range says block by block (64 numbers) where
its points are stored and which transform moves them. So one index list can name the
points of any number of instances, and one draw is enough for all.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device, release_all
from umbra.gl.programs import Program
from umbra.gl.resources import TextureBuffer
from umbra.scene import Scene
from umbra.scene.mesh import transform_points

__all__ = [
    "BLOCK", "FIRST_UNIT", "Geometry", "Group", "make_groups", "moves_as_wholes",
]  # fmt: skip

BLOCK = 64
"""Numbers that share an entry, as in ``place.glsl``."""

FIRST_UNIT = 8
"""Texture units 8, 9 and 10 hold points, blocks and transforms; those below are free."""


@dataclass(frozen=True, eq=False)
class Group:
    """
    Parts that one transform moves.

    Parameters
    ----------
    parts : tuple of int
        Indices in ``Scene.parts``.
    offsets : tuple of int
        Of each part's vertices within the group's.
    vertices : (n, 3) float64
        In their own frame; groups of the same meshes share the array.
    first : int
        Number of the group's first point.
    transform : (4, 4) float64, optional
        To the scene's frame; None is the identity.
    """

    parts: tuple[int, ...]
    offsets: tuple[int, ...]
    vertices: NDArray[np.float64]
    first: int
    transform: NDArray[np.float64] | None


def make_groups(scene: Scene) -> list[Group]:
    """
    Group a scene's parts: those that stand still, and those of one name and transform.

    A transform that flattens cannot be undone, and no light taken into its frame: it is
    applied to the vertices at once.
    """
    members: dict[tuple, list[int]] = {}
    for index, part in enumerate(scene.parts):
        moves = part.transform is not None
        key: tuple = (part.name, np.asarray(part.transform).tobytes()) if moves else ()
        if is_flat(part.transform):
            key = (index,)
        members.setdefault(key, []).append(index)
    shared: dict[tuple, tuple[tuple[int, ...], NDArray[np.float64]]] = {}
    groups, first = [], 0
    for parts in members.values():
        arrays = [scene.parts[index].mesh.vertices for index in parts]
        key = tuple(map(id, arrays))
        if key not in shared:
            shared[key] = _combine(arrays)
        offsets, vertices = shared[key]
        transform = scene.parts[parts[0]].transform
        if transform is not None and is_flat(transform):
            vertices, transform = transform_points(transform, vertices), None
        groups.append(Group(tuple(parts), offsets, vertices, first, transform))
        first += -(-len(vertices) // BLOCK) * BLOCK
    return groups


def _combine(arrays: Sequence[NDArray]) -> tuple[tuple[int, ...], NDArray[np.float64]]:
    """Put arrays one after another, each only once; give where each begins."""
    places: dict[int, int] = {}
    distinct, count = [], 0
    for array in arrays:
        if id(array) not in places:
            places[id(array)] = count
            distinct.append(array)
            count += len(array)
    vertices = distinct[0] if len(distinct) == 1 else np.concatenate(distinct)
    return tuple(places[id(array)] for array in arrays), vertices


class Geometry:
    """
    The points of a scene, and its triangles as index lists.

    Parameters
    ----------
    device : Device
    scene : Scene

    Attributes
    ----------
    groups : list of Group
    faces : (n_faces, 3) uint32
        Vertex numbers (twice the points'), in the order of ``scene.triangles()``,
        outward also where a transform mirrors.
    n_points : int
        Numbers in use.
    n_stored : int
        Points stored: those of instances only once.
    """

    def __init__(self, device: Device, scene: Scene) -> None:
        self._device = device
        self.groups = make_groups(scene)
        stored: dict[int, int] = {}
        points, blocks, count = [], [], 0
        transforms: list[NDArray[np.float64]] = []
        for group in self.groups:
            if id(group.vertices) not in stored:
                stored[id(group.vertices)] = count
                points.append(group.vertices)
                count += len(group.vertices)
            number = -1 if group.transform is None else len(transforms)
            if group.transform is not None:
                transforms.append(group.transform)
            entry = (stored[id(group.vertices)] - group.first, number)
            blocks.append(np.tile(np.array(entry, np.int32), (-(-len(group.vertices) // BLOCK), 1)))
        self.transforms = np.array(transforms).reshape(-1, 4, 4)
        self.n_points = sum(map(len, blocks)) * BLOCK
        self.n_stored, self._stored = count, stored
        self.faces = self._number_faces(scene)
        padded = np.zeros((count, 4), np.float32)
        np.concatenate(points, out=padded[:, :3], casting="same_kind")
        rows = self.transforms[:, :3].astype(np.float32)
        self._buffers = [
            TextureBuffer(device, padded, "rgba32f"),
            TextureBuffer(device, np.concatenate(blocks), "rg32i"),
            TextureBuffer(device, rows if rows.size else np.zeros(4, np.float32), "rgba32f"),
        ]

    def _number_faces(self, scene: Scene) -> NDArray[np.uint32]:
        lists: list[NDArray] = [np.zeros((0, 3), np.uint32)] * len(scene.parts)
        for group in self.groups:
            turned = is_mirrored(group.transform)
            for index, offset in zip(group.parts, group.offsets, strict=True):
                faces = scene.parts[index].mesh.faces
                numbers = 2 * (faces.astype(np.uint32) + np.uint32(group.first + offset))
                lists[index] = numbers[:, ::-1] if turned else numbers
        return np.concatenate(lists)

    def places(self) -> Iterator[tuple[int, int]]:
        """Give each part, and where its mesh's first vertex is stored."""
        for group in self.groups:
            for index, offset in zip(group.parts, group.offsets, strict=True):
                yield index, self._stored[id(group.vertices)] + offset

    def move(self, scene: Scene) -> None:
        """
        Take new transforms from a scene of the same parts.

        Parts that had no transform must have none, and a transform that did not mirror must not.
        """
        found = [scene.parts[group.parts[0]].transform for group in self.groups]
        moving = [transform for transform in found if transform is not None]
        self.transforms = np.array(moving).reshape(self.transforms.shape)
        self._buffers[2].write(self.transforms[:, :3].astype(np.float32))

    def bind(self, program: Program) -> None:
        """Let a program that includes ``place.glsl`` find the points."""
        for unit, buffer in enumerate(self._buffers, FIRST_UNIT):
            buffer.bind(unit)
        program.set(points=FIRST_UNIT, blocks=FIRST_UNIT + 1, transforms=FIRST_UNIT + 2)

    def release(self) -> None:
        """Free the buffers."""
        release_all(*self._buffers)
        self._buffers = []


def is_flat(transform: NDArray[np.float64] | None) -> bool:
    """Tell whether a transform makes a solid flat, so that nothing can undo it."""
    if transform is None:
        return False
    linear = np.asarray(transform, np.float64)[:3, :3]
    size = np.linalg.norm(linear, axis=0).prod()
    return bool(np.abs(np.linalg.det(linear)) <= 1e-9 * size)


def is_mirrored(transform: NDArray[np.float64] | None) -> bool:
    """Tell whether a transform turns what is wound outward inward."""
    return transform is not None and bool(np.linalg.det(transform[:3, :3]) < 0)


def moves_as_wholes(before: Scene, after: Scene, groups: Sequence[Group]) -> bool:
    """Tell whether scenes of the same parts differ by the transforms of whole groups alone."""
    if (before.origin != after.origin).any() or any(
        a.mesh is not b.mesh
        or a.material is not b.material
        or is_mirrored(a.transform) != is_mirrored(b.transform)
        for a, b in zip(before.parts, after.parts, strict=True)
    ):
        return False
    for group in groups:
        found = [after.parts[index].transform for index in group.parts]
        if any((transform is None) != (group.transform is None) for transform in found):
            return False
        if is_flat(found[0]):
            return False
        if group.transform is not None and any((t != found[0]).any() for t in found):  # type: ignore[union-attr]
            return False
    return True
