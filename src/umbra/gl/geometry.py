"""
A scene's points on the device; instances share one copy of a mesh.

Points are *numbered*: parts without a transform share one range, and each group of parts
that moves together has its own. Each block (64 numbers) of a range records where its
points are stored and which transform applies. So one index list can refer to any number
of instances, and one draw suffices for all.

The endless ground plane, behind a model's own floors in the same plane.
"""

import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device, release_all
from umbra.gl.programs import Program
from umbra.gl.projection import CameraProjection
from umbra.gl.resources import TextureBuffer
from umbra.gl.state import Pass, State
from umbra.scene import Scene
from umbra.scene.mesh import Mesh, transform_points

__all__ = [
    "BLOCK",
    "FIRST_UNIT",
    "RINGS",
    "Geometry",
    "Group",
    "PointTable",
    "draw_ground",
    "find_mirrored",
    "make_groups",
    "moves_as_wholes",
    "pose_groups",
]

RINGS = 28
"""Number of rings, ``RINGS`` in ``ground.vert.glsl``."""

_SURFACE = Pass(depth_test="less", depth_write=True, color_write=True)
# A floor's own triangles round differently: behind by a few steps of depth, they stay visible.
_STEPS, _STEPS_24_BITS = 8.0, 2.0  # 1e-6 of the distance; absolute with 24 bits


def draw_ground(
    state: State,
    program: Program,
    projection: CameraProjection,
    ground: float,
    uniforms: Mapping[str, object],
    how: Pass = _SURFACE,
) -> None:
    """
    Draw the plane z = ``ground``, relative to the scene's origin [m].

    The program is of ``ground.vert.glsl`` with ``RINGS`` defined; ``uniforms`` are its others.
    Its depths are the same in every pass.
    """
    steps = _STEPS if projection.reverses_depth else _STEPS_24_BITS
    state.use(replace(how, polygon_offset=(0.0, steps)))
    height = float(ground - projection.eye[2])
    program.set(projection=projection.uniforms["projection"], height=height)
    program.set(**uniforms)
    program.draw(4 * RINGS * 6)


BLOCK = 64
"""Numbers that share an entry, as in ``place.glsl``."""

_STILL = np.eye(4)

FIRST_UNIT = 8
"""Texture units 8, 9 and 10 hold points, blocks and transforms; those below are free."""


@dataclass(frozen=True, eq=False)
class Group:
    """
    Parts that share a transform.

    Parameters
    ----------
    parts : tuple of int
        Indices in ``Scene.parts``.
    offsets : tuple of int
        First vertex of each part within the group.
    arrays : tuple of (n, 3) float64
        Each part's vertices.
    vertices : (n, 3) float64
        In the group's frame; groups of the same meshes share the array.
    first : int
        Number of the group's first point.
    transform : (4, 4) float64, optional
        To the scene's frame; None is the identity.
    """

    parts: tuple[int, ...]
    offsets: tuple[int, ...]
    arrays: tuple[NDArray[np.float64], ...]
    vertices: NDArray[np.float64]
    first: int
    transform: NDArray[np.float64] | None


def make_groups(scene: Scene) -> list[Group]:
    """
    Group a scene's parts: those without a transform, and those of one name and transform.

    A singular transform has no inverse to take a light into its frame: it is applied
    to the vertices here.
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
        arrays = tuple(scene.parts[index].mesh.vertices for index in parts)
        key = tuple(map(id, arrays))
        if key not in shared:
            shared[key] = _combine(arrays)
        offsets, vertices = shared[key]
        transform = scene.parts[parts[0]].transform
        if transform is not None and is_flat(transform):
            vertices, transform = transform_points(transform, vertices), None
        groups.append(Group(tuple(parts), offsets, arrays, vertices, first, transform))
        first += -(-len(vertices) // BLOCK) * BLOCK
    return groups


def _combine(arrays: Sequence[NDArray]) -> tuple[tuple[int, ...], NDArray[np.float64]]:
    """Concatenate arrays, each only once; return where each begins."""
    places: dict[int, int] = {}
    distinct, count = [], 0
    for array in arrays:
        if id(array) not in places:
            places[id(array)] = count
            distinct.append(array)
            count += len(array)
    vertices = distinct[0] if len(distinct) == 1 else np.concatenate(distinct)
    return tuple(places[id(array)] for array in arrays), vertices


def find_posed(groups: Sequence[Group], before: Scene, after: Scene) -> list[Group] | None:
    """Find the bent groups of another pose, or None if geometry must be rebuilt."""
    if not moves_as_wholes(before, after, groups):
        return None
    if all(a.mesh is b.mesh for a, b in zip(before.parts, after.parts, strict=True)):
        return []
    return pose_groups(groups, after)


def pose_groups(groups: Sequence[Group], scene: Scene) -> list[Group] | None:
    """
    Find the groups of a scene of the same parts, some of them bent.

    Groups of the same meshes must still share an array, or None is returned.
    """
    known: dict[tuple[int, ...], tuple[tuple[int, ...], NDArray[np.float64]]] = {}
    became: dict[int, NDArray[np.float64]] = {}
    posed = []
    for group in groups:
        arrays = tuple(scene.parts[index].mesh.vertices for index in group.parts)
        pair = group.offsets, group.vertices
        if not all(map(operator.is_, arrays, group.arrays)):
            key = tuple(map(id, arrays))
            if key not in known:
                known[key] = _combine(arrays)
            pair = known[key]
        offsets, vertices = pair
        shares = became.setdefault(id(group.vertices), vertices) is vertices
        if not shares or offsets != group.offsets:
            return None
        posed.append(replace(group, arrays=arrays, vertices=vertices))
    return posed


class PointTable:
    """
    The points of a scene, and its triangles as index lists, in memory.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    groups : list of Group
    faces : (n_faces, 3) uint32
        Vertex numbers (twice the points'), in the order of ``scene.triangles()``,
        outward also where a transform mirrors.
    n_points : int
        Number of points, counting each instance's.
    n_stored : int
        Number of stored points: those of instances once.
    placed : (n_parts, 4, 4) float64
        From each part's stored points to the scene's frame.
    """

    def __init__(self, scene: Scene) -> None:
        self.groups = make_groups(scene)
        stored: dict[int, int] = {}
        count = 0
        self._moving = [group.parts[0] for group in self.groups if group.transform is not None]
        self._flat = [
            index
            for group in self.groups
            if group.transform is None
            for index in group.parts
            if scene.parts[index].transform is not None
        ]
        self._place(scene)
        for group in self.groups:
            if id(group.vertices) not in stored:
                stored[id(group.vertices)] = count
                count += len(group.vertices)
        self.n_points = sum(-(-len(group.vertices) // BLOCK) for group in self.groups) * BLOCK
        self.n_stored, self._stored = count, stored
        self.faces = self._number_faces(scene)

    def _place(self, scene: Scene) -> None:
        """Store the transforms of a scene's parts."""
        transforms = [part.transform for part in scene.parts]
        self.placed = np.array([_STILL if t is None else t for t in transforms]).reshape(-1, 4, 4)
        self.placed[self._flat] = _STILL
        self.transforms = self.placed[self._moving]

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
        """Yield each part and where its mesh's first vertex is stored."""
        for group in self.groups:
            for index, offset in zip(group.parts, group.offsets, strict=True):
                yield index, self._stored[id(group.vertices)] + offset

    def move(self, scene: Scene) -> None:
        """
        Update the transforms from a scene of the same parts.

        Parts without a transform must stay so, and no transform may change its handedness.
        """
        self._place(scene)

    def bend(self, groups: list[Group]) -> None:
        """Replace the vertices by those of groups from ``pose_groups``."""
        places = [self._stored[id(group.vertices)] for group in self.groups]
        self.groups = groups
        self._stored = dict(zip((id(group.vertices) for group in groups), places, strict=True))


class Geometry(PointTable):
    """
    The points of a scene on the device.

    Parameters
    ----------
    device : Device
    scene : Scene
    """

    def __init__(self, device: Device, scene: Scene) -> None:
        super().__init__(scene)
        points = np.zeros((self.n_stored, 4), np.float32)
        blocks, moving = [], 0
        for group in self.groups:
            first = self._stored[id(group.vertices)]
            points[first : first + len(group.vertices), :3] = group.vertices
            number = -1 if group.transform is None else moving
            moving += number >= 0
            entry = np.array((first - group.first, number), np.int32)
            blocks.append(np.tile(entry, (-(-len(group.vertices) // BLOCK), 1)))
        rows = self.transforms[:, :3].astype(np.float32)
        self._buffers = [
            TextureBuffer(device, points, "rgba32f"),
            TextureBuffer(device, np.concatenate(blocks), "rg32i"),
            TextureBuffer(device, rows if rows.size else np.zeros(4, np.float32), "rgba32f"),
        ]

    def move(self, scene: Scene) -> None:
        """Update the transforms, as `PointTable.move`, and those on the device."""
        super().move(scene)
        if self.transforms.size:
            self._buffers[2].write(self.transforms[:, :3].astype(np.float32))

    def bend(self, groups: list[Group]) -> None:
        """Replace the vertices, as `PointTable.bend`, and those on the device."""
        written: set[int] = set()
        for old, new in zip(self.groups, groups, strict=True):
            if new.vertices is old.vertices or id(old.vertices) in written:
                continue
            written.add(id(old.vertices))
            points = np.zeros((len(new.vertices), 4), np.float32)
            points[:, :3] = new.vertices
            self._buffers[0].write(points, self._stored[id(old.vertices)])
        super().bend(groups)

    def bind(self, program: Program) -> None:
        """Bind the points for a program that includes ``place.glsl``."""
        for unit, buffer in enumerate(self._buffers, FIRST_UNIT):
            buffer.bind(unit)
        program.set(points=FIRST_UNIT, blocks=FIRST_UNIT + 1, transforms=FIRST_UNIT + 2)

    def release(self) -> None:
        """Free the buffers."""
        release_all(*self._buffers)
        self._buffers = []


def is_flat(transform: NDArray[np.float64] | None) -> bool:
    """Return whether a transform is singular."""
    return transform is not None and bool(find_flat(np.asarray(transform, np.float64)[None])[0])


def find_flat(transforms: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Find the singular transforms among (n, 4, 4)."""
    linear = transforms[:, :3, :3]
    size = np.linalg.norm(linear, axis=1).prod(-1)
    return np.asarray(np.abs(np.linalg.det(linear)) <= 1e-9 * size)


def is_mirrored(transform: NDArray[np.float64] | None) -> bool:
    """Return whether a transform reverses the winding."""
    return transform is not None and bool(find_mirrored(np.asarray(transform)[None])[0])


def find_mirrored(transforms: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Find the transforms among (n, 4, 4) that reverse the winding."""
    return np.asarray(np.linalg.det(transforms[:, :3, :3]) < 0)


def moves_as_wholes(before: Scene, after: Scene, groups: Sequence[Group]) -> bool:
    """
    Return whether scenes of the same parts differ only by the transforms of whole groups.

    Vertices and normals may differ, too, if their number is the same: such parts bend.
    """
    if len(before) != len(after) or (before.origin != after.origin).any():
        return False
    pairs = list(zip(before.parts, after.parts, strict=True))
    if not all(
        a.material is b.material
        and (a.transform is None) == (b.transform is None)
        and (a.mesh is b.mesh or _is_bent(a.mesh, b.mesh))
        for a, b in pairs
    ):
        return False
    moving = [(a.transform, b.transform) for a, b in pairs if a.transform is not b.transform]
    if moving:
        old, new = (np.array(matrices, np.float64) for matrices in zip(*moving, strict=True))
        if (find_mirrored(old) != find_mirrored(new)).any() or find_flat(new).any():
            return False
    for group in groups:
        whole = after.parts[group.parts[0]].transform
        for index in group.parts[1:]:
            other = after.parts[index].transform
            if other is not whole and not np.array_equal(other, whole):  # type: ignore[arg-type]
                return False
    # Singular transforms were applied to the vertices.
    return all(group.transform is not None for group in groups if _has_transform(before, group))


def _has_transform(scene: Scene, group: Group) -> bool:
    """Return whether a group's parts have a transform, applied to its vertices or not."""
    return scene.parts[group.parts[0]].transform is not None


def _is_bent(before: Mesh, after: Mesh) -> bool:
    """Return whether a mesh differs from another in vertices or normals alone."""
    return (
        before.faces is after.faces
        and before.vertices.shape == after.vertices.shape
        and before.uv is after.uv
        and before.uv2 is after.uv2
        and before.colors is after.colors
        and before.alpha is after.alpha
        and before.tangents is after.tangents
        and (before.normals is None) == (after.normals is None)
    )
