"""
Casters: the shells of a scene, each with one shadow volume, in contiguous arrays.

A *body* is a mesh with its adjacency and all its instances. Its triangles fall into
*shells*, which share no edge, so each has its own closed silhouette and can be
classified and culled separately. All shells are processed at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from umbra.gl.convexity import Balls, PosedShape, find_balls, find_welds, measure_shape
from umbra.gl.geometry import Geometry, Group, find_mirrored
from umbra.kernels import kernel
from umbra.rays.eye_count import FaceBlocks
from umbra.scene import Scene
from umbra.volume.adjacency import Caster, make_caster, make_planes
from umbra.volume.bounds import move_boxes

__all__ = ["Body", "make_bodies", "make_level_body"]

_STILL = np.eye(4)
MOST_SHELLS = 4096
"""More are put together, neighbour with neighbour, in one body."""


@dataclass(eq=False)
class Body:
    """
    A casting mesh and its instances.

    Parameters
    ----------
    caster : Caster
        In the mesh's own frame; edges in the order of their shells.
    faces : (n_faces,) int
        Faces of the caster in the order of their shells.
    face_starts : (n_shells + 1,) int
        Shell k owns ``faces[face_starts[k]:face_starts[k + 1]]``.
    edge_shell : (n_edges,) int32
    component_shell : (n_components,) int
    groups : list of Group
        The instances.
    soup : (n, 3) int32
        The source faces of the caster.
    is_ball : (n_components,) bool
        Closed surface of genus 0.

    Attributes
    ----------
    bounds : (n_shells, 2, 3) float64
        In the mesh's own frame [m].
    component_bounds : (n_components, 2, 3) float64
    edge_starts : (n_shells + 1,) int
        Shell k owns the edges from ``edge_starts[k]`` to ``edge_starts[k + 1]``.
    is_inward : (n_components,) bool
        Closed, but wound inward.
    is_convex : (n_components,) bool
        No ray meets two of its lit faces.
    first : (n_instances,) int64
        Number of each instance's first point.
    size : float
        The longest side of the mesh's bounding box [m].
    stretch : float
        Upper bound on the scale from the mesh's frame to the scene's.
    mirrored : (n_instances,) bool
    transforms : (n_instances, 4, 4) float64
        To the scene's frame.
    none_opened : (n_instances, n_components) bool
        False: no component is open.
    most : (n_shells,) int64
        Largest count that each shell adds, while no component is open.
    n_faces : (n_components,) int
    poses : int
        Number of poses so far: data of earlier poses is stale.
    """

    caster: Caster
    faces: NDArray[np.intp]
    face_starts: NDArray[np.intp]
    edge_shell: NDArray[np.int32]
    component_shell: NDArray[np.intp]
    groups: list[Group]
    soup: NDArray[np.int32]
    is_ball: NDArray[np.bool_]
    poses: int = field(init=False, default=0)
    bounds: NDArray[np.float64] = field(init=False)
    blocks: FaceBlocks = field(init=False)
    component_bounds: NDArray[np.float64] = field(init=False)
    edge_starts: NDArray[np.intp] = field(init=False)
    is_inward: NDArray[np.bool_] = field(init=False)
    any_inward: bool = field(init=False)
    is_convex: NDArray[np.bool_] = field(init=False)
    first: NDArray[np.int64] = field(init=False)
    mirrored: NDArray[np.bool_] = field(init=False)
    stretch: float = field(init=False)
    size: float = field(init=False)
    transforms: NDArray[np.float64] = field(init=False)
    most: NDArray[np.int64] = field(init=False)
    none_opened: NDArray[np.bool_] = field(init=False)
    n_faces: NDArray[np.intp] = field(init=False)
    _world_bounds: NDArray[np.float64] | None = field(init=False, default=None)
    _radii: NDArray[np.float64] | None = field(init=False, default=None)
    _welds: NDArray[np.int64] | None = field(init=False, default=None)
    _balls: Balls = field(init=False)
    _shell_order: NDArray[np.intp] = field(init=False)
    _shell_starts: NDArray[np.intp] = field(init=False)

    def __post_init__(self) -> None:
        self.n_faces = np.bincount(self.caster.component)
        n_shells = len(self.face_starts) - 1
        self.edge_starts = np.searchsorted(self.edge_shell, np.arange(n_shells + 1))
        self._shell_order = np.argsort(self.component_shell, kind="stable")
        self._shell_starts = np.searchsorted(
            self.component_shell[self._shell_order], np.arange(n_shells)
        )
        self._balls = Balls.of(self.caster, self.is_ball)
        self._take(measure_shape(self.caster, self.caster.vertices, self._balls))
        self.first = np.array([group.first for group in self.groups], np.int64)
        transforms = [group.transform for group in self.groups]
        self.place(np.array([_STILL if t is None else t for t in transforms]))

    def place(self, transforms: NDArray[np.float64]) -> None:
        """Move the instances (n, 4, 4), in the order of the groups."""
        self.transforms = transforms
        self.mirrored = find_mirrored(self.transforms)
        lengths = np.sqrt((self.transforms[:, :3, :3] ** 2).sum((1, 2)))
        self.stretch = 1.0 if self.is_still else float(lengths.max())
        self._world_bounds = None
        self.none_opened = np.zeros((len(transforms), len(self.component_shell)), np.bool_)

    def _take(self, shape: PosedShape) -> None:
        """Store the geometry of posed shells and components."""
        self.blocks = FaceBlocks(shape.blocks)
        self.is_inward = (shape.volumes < 0) & self.caster.is_closed
        self.any_inward = bool(self.is_inward.any())
        self.is_convex = shape.is_convex
        self.component_bounds = shape.bounds
        ordered = shape.bounds[self._shell_order]
        self.bounds = np.stack(
            [
                np.minimum.reduceat(ordered[:, 0], self._shell_starts),
                np.maximum.reduceat(ordered[:, 1], self._shell_starts),
            ],
            1,
        )
        self._radii = None
        whole = self.bounds[:, 1].max(0) - self.bounds[:, 0].min(0)
        self.size = float(whole.max())
        adds = np.where(self.is_convex, 1, self.n_faces)
        self.most = np.bincount(self.component_shell, adds, self.n_shells).astype(np.int64)

    def can_bend(self, vertices: NDArray[np.float64]) -> bool:
        """
        Return whether the adjacency still holds with these vertices.

        Where separate corners coincide, the two borders there throw the same sides with
        opposite signs, so counts stay right. Where coincident corners separate, or a face
        was left out as flat, adjacency must be rebuilt.
        """
        if len(self.caster.faces) < len(self.soup):
            return False
        if self._welds is None:
            self._welds = find_welds(self.caster, self.soup)
        return np.array_equal(vertices[self._welds[:, 0]], vertices[self._welds[:, 1]])

    def bend(self, groups: list[Group]) -> None:
        """Replace the vertices by those of groups (see ``can_bend``); adjacency is kept."""
        self.groups = groups
        vertices = groups[0].vertices
        if vertices is not self.caster.vertices:
            shape = measure_shape(self.caster, vertices, self._balls)
            self.caster = replace(self.caster, vertices=vertices, planes=shape.planes)
            self._take(shape)
            self._world_bounds = None
            self.poses += 1

    @property
    def n_shells(self) -> int:
        """Number of shells of one instance."""
        return len(self.face_starts) - 1

    @property
    def radii(self) -> NDArray[np.float64]:
        """How far each shell reaches from the middle of its box, (n_shells,) [m], in its frame."""
        if self._radii is None:
            self._radii = _find_radii(
                self.caster.vertices, self.caster.faces, self.faces, self.face_starts,
                self.bounds.mean(1),
            )  # fmt: skip
        return self._radii

    def list_faces(self, shells: NDArray[np.intp]) -> NDArray[np.intp]:
        """List the faces of some shells."""
        spans = zip(self.face_starts[shells], self.face_starts[shells + 1], strict=True)
        return np.concatenate([self.faces[:0], *(self.faces[first:end] for first, end in spans)])

    def list_components(self, shells: NDArray[np.intp]) -> NDArray[np.intp]:
        """List the components of some shells."""
        ends = np.append(self._shell_starts, len(self._shell_order))
        spans = zip(ends[shells].tolist(), ends[shells + 1].tolist(), strict=True)
        lists = (self._shell_order[first:end] for first, end in spans)
        return np.concatenate([self._shell_order[:0], *lists])

    @property
    def is_still(self) -> bool:
        """Whether this is a single instance in the scene's frame."""
        return len(self.groups) == 1 and self.groups[0].transform is None

    def to_mesh(self, instance: int, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform homogeneous points (..., 4) of the scene to an instance's frame."""
        if self.is_still:
            return points
        return np.linalg.solve(self.transforms[instance], points.T).T

    def split(self, shells: NDArray[np.intp]) -> list[tuple[int, NDArray[np.intp]]]:
        """Split instances and shells (n, 2) by instance."""
        if self.is_still:
            return [(0, shells[:, 1])] if len(shells) else []
        return [(k, shells[shells[:, 0] == k, 1]) for k in np.unique(shells[:, 0]).tolist()]

    def lights(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform a light, relative to the scene's origin, to every instance's frame, (n, 4)."""
        if self.is_still:
            return light[None]
        repeated = np.broadcast_to(light[:, None], (len(self.groups), 4, 1))
        inside = np.linalg.solve(self.transforms, repeated)[..., 0].astype(np.float64)
        inside[:, 3] = light[3]
        return inside

    def world_bounds(self) -> NDArray[np.float64]:
        """Return the bounds of all instances' shells, (n_instances * n_shells, 2, 3)."""
        if self.is_still:
            return self.bounds
        if self._world_bounds is None:
            self._world_bounds = move_boxes(self.transforms, self.bounds).reshape(-1, 2, 3)
        return self._world_bounds


@kernel
def _find_radii(vertices, faces, order, starts, middles):
    """Find how far the corners of each shell reach from a point, (n_shells,)."""
    radii = np.zeros(len(middles))
    for shell in range(len(middles)):
        x, y, z = middles[shell]
        most = 0.0
        for i in range(starts[shell], starts[shell + 1]):
            for corner in faces[order[i]]:
                point = vertices[corner]
                most = max(most, (point[0] - x) ** 2 + (point[1] - y) ** 2 + (point[2] - z) ** 2)
        radii[shell] = np.sqrt(most)
    return radii


def make_bodies(
    scene: Scene,
    geometry: Geometry,
    casters: Sequence[int] | None = None,
    before: Sequence[Body] = (),
) -> list[Body]:
    """
    Make the casters of a scene.

    Parts without a transform form one body, as on the CPU; a group with a transform
    forms its own, once for all its instances. ``before`` are bodies of the same parts
    in another pose, whose adjacency is kept where it holds.
    """
    known = {tuple(group.parts for group in body.groups): body for body in before}
    chosen = set(range(len(scene.parts)) if casters is None else casters)
    names = scene.groups()
    alike: dict[tuple, list[Group]] = {}
    for group in geometry.groups:
        members = [position for position, index in enumerate(group.parts) if index in chosen]
        key = (id(group.vertices), *(id(scene.parts[group.parts[p]].mesh.faces) for p in members))
        if members:
            alike.setdefault(key, []).append(group)
    bodies: list[Body] = []
    for groups in alike.values():
        group = groups[0]
        lists, owners = [], []
        for index, offset in zip(group.parts, group.offsets, strict=True):
            if index in chosen:
                lists.append(scene.parts[index].mesh.faces + offset)
                owners.append(np.full(len(lists[-1]), names[index]))
        faces = np.concatenate(lists).astype(np.int32, copy=False)
        last = known.get(tuple(group.parts for group in groups))
        if last is not None and np.array_equal(faces, last.soup) and last.can_bend(group.vertices):
            body = replace(last, caster=_pose(last.caster, group.vertices), groups=groups)
        else:
            caster = make_caster(group.vertices, faces, np.concatenate(owners))
            if not len(caster.faces):
                continue
            body = _make_body(caster, groups, faces)
        bodies.append(body)
    return bodies


def _pose(caster: Caster, vertices: NDArray[np.float64]) -> Caster:
    """Return a caster with other vertices and the same adjacency."""
    return replace(caster, vertices=vertices, planes=make_planes(vertices, caster.faces))


def make_level_body(
    body: Body, faces: NDArray[np.int32], shell: NDArray[np.int32]
) -> tuple[Body | None, NDArray[np.intp], NDArray[np.intp]]:
    """
    Make the body of a coarser mesh on the points of another.

    Parameters
    ----------
    body : Body
    faces : (n, 3) int32
    shell : (n,) int32
        The body's shell that each face belongs to.

    Returns
    -------
    made : Body or None
        None if there is no face.
    shells : (n_shells,) int
        The shell that each shell of the made body belongs to.
    merged : (n,) int
        Shells that were left out, as edges join them now.
    """
    merged = np.zeros(0, np.intp)
    while len(faces):
        caster = make_caster(body.caster.vertices, faces, shell, is_welded=True)
        owner = shell[caster.source]
        first = np.zeros(len(caster.is_closed), np.int32)
        first[caster.component] = owner
        mixed = first[caster.component] != owner
        if not mixed.any():
            shells, component_shell = np.unique(first, return_inverse=True)
            made = _make_body(caster, body.groups, faces, component_shell.ravel())
            made.place(body.transforms)
            return made, shells.astype(np.intp), merged
        bad = np.unique(np.concatenate([owner[mixed], first[caster.component][mixed]]))
        merged = np.concatenate([merged, bad])
        is_good = ~np.isin(shell, bad)
        faces, shell = faces[is_good], shell[is_good]
    return None, np.zeros(0, np.intp), merged


def _make_body(
    caster: Caster,
    groups: list[Group],
    soup: NDArray[np.int32],
    component_shell: NDArray[np.intp] | None = None,
) -> Body:
    component_shell = _find_shells(caster) if component_shell is None else component_shell
    shell = component_shell[caster.component]
    edge_shell = shell[caster.edge_faces[:, 0]].astype(np.int32)
    order = np.argsort(edge_shell, kind="stable")
    caster = replace(
        caster,
        edges=np.ascontiguousarray(caster.edges[order]),
        edge_faces=np.ascontiguousarray(caster.edge_faces[order]),
        turn=caster.turn[order],
        weight=caster.weight[order],
    )
    n_shells = int(component_shell.max()) + 1
    return Body(
        caster=caster,
        faces=np.argsort(shell, kind="stable"),
        face_starts=np.append(0, np.cumsum(np.bincount(shell, minlength=n_shells))),
        edge_shell=edge_shell[order],
        component_shell=component_shell,
        groups=groups,
        soup=soup,
        is_ball=find_balls(caster),
    )


def _find_shells(caster: Caster) -> NDArray[np.intp]:
    """Return the shell of each component: components joined by an edge share one."""
    n = len(caster.is_closed)
    shell = np.arange(n)
    a, b = caster.component[caster.edge_faces].T
    joined = np.unique(np.stack([a, b], 1)[a != b], axis=0)
    while len(joined):  # propagate labels along the pairs until they agree
        low = np.minimum(shell[joined[:, 0]], shell[joined[:, 1]])
        before = shell.copy()
        np.minimum.at(shell, joined[:, 0], low)
        np.minimum.at(shell, joined[:, 1], low)
        if (shell == before).all():
            break
    # Faces are in the order of a space-filling curve: shells in that order are neighbours.
    first = np.full(n, len(caster.faces))
    np.minimum.at(first, shell[caster.component], np.arange(len(caster.faces)))
    numbers = np.unique(shell)
    rank = np.zeros(n, np.intp)
    rank[numbers[np.argsort(first[numbers])]] = np.arange(len(numbers))
    return rank[shell] // -(-len(numbers) // MOST_SHELLS)
