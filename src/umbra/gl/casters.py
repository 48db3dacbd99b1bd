"""
Casters: the shells of a scene that throw one shadow volume each, side by side in arrays.

A *body* is a mesh with its adjacency and all its instances. Its triangles fall into
*shells*, which share no edge, so each has a closed silhouette of its own and can be
placed and culled by itself. Work on shells is done for all of them at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from umbra.gl.geometry import Geometry, Group, is_mirrored
from umbra.rays.eye_count import FaceBlocks
from umbra.scene import Scene
from umbra.volume.adjacency import Caster, make_caster, make_planes
from umbra.volume.bounds import find_box_points

__all__ = ["Body", "make_bodies"]

MOST_SHELLS = 4096
"""More are put together, neighbour with neighbour, in one body."""


@dataclass(eq=False)
class Body:
    """
    A mesh that casts, and its instances.

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
    bounds : (n_shells, 2, 3) float64
        In the mesh's own frame [m].
    groups : list of Group
        The instances.
    soup : (n, 3) int32
        The faces of which the caster was made.
    is_ball : (n_components,) bool
        Faces join as on a ball's surface.

    Attributes
    ----------
    component_bounds : (n_components, 2, 3) float64
    edge_starts : (n_shells + 1,) int
        Shell k owns the edges from ``edge_starts[k]`` to ``edge_starts[k + 1]``.
    is_inward : (n_components,) bool
        Closed, but wound inward.
    is_convex : (n_components,) bool
        No ray meets two of its lit faces.
    first : (n_instances,) int64
        Number of each instance's first point.
    mirrored : (n_instances,) bool
    transforms : (n_instances, 4, 4) float64
        To the scene's frame.
    most : (n_shells,) int64
        How much each shell adds to a count at most, while nothing is opened.
    n_faces : (n_components,) int
    """

    caster: Caster
    faces: NDArray[np.intp]
    face_starts: NDArray[np.intp]
    edge_shell: NDArray[np.int32]
    component_shell: NDArray[np.intp]
    bounds: NDArray[np.float64]
    groups: list[Group]
    soup: NDArray[np.int32]
    is_ball: NDArray[np.bool_]
    blocks: FaceBlocks = field(init=False)
    component_bounds: NDArray[np.float64] = field(init=False)
    edge_starts: NDArray[np.intp] = field(init=False)
    is_inward: NDArray[np.bool_] = field(init=False)
    any_inward: bool = field(init=False)
    is_convex: NDArray[np.bool_] = field(init=False)
    first: NDArray[np.int64] = field(init=False)
    mirrored: NDArray[np.bool_] = field(init=False)
    transforms: NDArray[np.float64] = field(init=False)
    most: NDArray[np.int64] = field(init=False)
    n_faces: NDArray[np.intp] = field(init=False)
    _world_bounds: NDArray[np.float64] | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        caster = self.caster
        self.blocks = FaceBlocks.of(caster)
        corners = caster.vertices[caster.faces]
        self.edge_starts = np.searchsorted(self.edge_shell, np.arange(self.n_shells + 1))
        self.is_inward = caster.is_inward & caster.is_closed
        self.any_inward = bool(self.is_inward.any())
        self.is_convex = self.is_ball & ~_find_dented(caster)
        self.component_bounds = _bound(corners, caster.component, len(caster.is_closed))
        self.n_faces = np.bincount(caster.component)
        adds = np.where(self.is_convex, 1, self.n_faces)
        self.most = np.bincount(self.component_shell, adds, self.n_shells).astype(np.int64)
        self.first = np.array([group.first for group in self.groups], np.int64)
        self.place([group.transform for group in self.groups])

    def place(self, transforms: Sequence[NDArray[np.float64] | None]) -> None:
        """Move the instances, in the order of the groups."""
        self.mirrored = np.array([is_mirrored(transform) for transform in transforms])
        self.transforms = np.array([np.eye(4) if t is None else t for t in transforms])
        self._world_bounds = None

    def pose(self, soup: NDArray[np.int32], groups: list[Group]) -> "Body | None":
        """
        Give the mesh other vertices, and keep which faces meet; None where that holds no longer.

        Adjacency is that of the first pose. Where corners that were apart come to one place,
        the two borders there throw the same sides with opposite signs, so counts stay right.
        Where corners that were at one place part, faces must be joined anew. ``soup`` (n, 3) are
        the faces of the parts that cast, ``groups`` those with the new vertices.
        """
        vertices, caster = groups[0].vertices, self.caster
        if not np.array_equal(soup, self.soup) or len(caster.faces) < len(soup):
            return None
        if not np.array_equal(vertices[soup[caster.source]], vertices[caster.faces]):
            return None
        planes = make_planes(vertices, caster.faces)
        shell = self.component_shell[caster.component]
        return replace(
            self,
            caster=replace(caster, vertices=vertices, planes=planes),
            bounds=_bound(vertices[caster.faces], shell, self.n_shells),
            groups=groups,
        )

    @property
    def n_shells(self) -> int:
        """Shells of one instance."""
        return len(self.bounds)

    def lights(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Take a light, relative to the scene's origin, into every instance's own frame, (n, 4)."""
        if len(self.groups) == 1 and self.groups[0].transform is None:
            return light[None]
        repeated = np.broadcast_to(light[:, None], (len(self.groups), 4, 1))
        inside = np.linalg.solve(self.transforms, repeated)[..., 0].astype(np.float64)
        inside[:, 3] = light[3]
        return inside

    def world_bounds(self) -> NDArray[np.float64]:
        """Give boxes around the shells of all instances, (n_instances * n_shells, 2, 3)."""
        if len(self.groups) == 1 and self.groups[0].transform is None:
            return self.bounds
        if self._world_bounds is None:
            corners = find_box_points(self.bounds)
            moved = np.einsum("nij,tkj->ntki", self.transforms[:, :3], corners)
            self._world_bounds = np.stack([moved.min(2), moved.max(2)], 2).reshape(-1, 2, 3)
        return self._world_bounds


def make_bodies(
    scene: Scene,
    geometry: Geometry,
    casters: Sequence[int] | None = None,
    before: Sequence[Body] = (),
) -> list[Body]:
    """
    Make the casters of a scene.

    Parts that stand still are judged together, as on the CPU; a group that a transform
    moves is judged alone, once for all its instances. ``before`` are bodies of the same parts
    in another pose, whose adjacency is kept where it holds.
    """
    known = {tuple(group.parts for group in body.groups): body for body in before}
    chosen = set(range(len(scene.parts)) if casters is None else casters)
    names = scene.groups()
    alike: dict[tuple, list[Group]] = {}
    for group in geometry.groups:
        mine = [place for place, index in enumerate(group.parts) if index in chosen]
        key = (id(group.vertices), *(id(scene.parts[group.parts[p]].mesh.faces) for p in mine))
        if mine:
            alike.setdefault(key, []).append(group)
    bodies = []
    for groups in alike.values():
        group = groups[0]
        lists, owners = [], []
        for index, offset in zip(group.parts, group.offsets, strict=True):
            if index in chosen:
                lists.append(scene.parts[index].mesh.faces + offset)
                owners.append(np.full(len(lists[-1]), names[index]))
        faces = np.concatenate(lists).astype(np.int32, copy=False)
        last = known.get(tuple(group.parts for group in groups))
        body = None if last is None else last.pose(faces, groups)
        if body is None:
            caster = make_caster(group.vertices, faces, np.concatenate(owners))
            body = _make_body(caster, groups, faces) if len(caster.faces) else None
        if body is not None:
            bodies.append(body)
    return bodies


def _make_body(caster: Caster, groups: list[Group], soup: NDArray[np.int32]) -> Body:
    component_shell = _find_shells(caster)
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
        bounds=_bound(caster.vertices[caster.faces], shell, n_shells),
        groups=groups,
        soup=soup,
        is_ball=_find_balls(caster),
    )


def _find_shells(caster: Caster) -> NDArray[np.intp]:
    """Give the shell of each component: components that pair across an edge are one."""
    n = len(caster.is_closed)
    shell = np.arange(n)
    a, b = caster.component[caster.edge_faces].T
    joined = np.unique(np.stack([a, b], 1)[a != b], axis=0)
    while len(joined):  # labels spread along the pairs until they agree
        low = np.minimum(shell[joined[:, 0]], shell[joined[:, 1]])
        before = shell.copy()
        np.minimum.at(shell, joined[:, 0], low)
        np.minimum.at(shell, joined[:, 1], low)
        if (shell == before).all():
            break
    # Faces lie along a curve through space: shells that come first together are neighbours.
    first = np.full(n, len(caster.faces))
    np.minimum.at(first, shell[caster.component], np.arange(len(caster.faces)))
    found = np.unique(shell)
    rank = np.zeros(n, np.intp)
    rank[found[np.argsort(first[found])]] = np.arange(len(found))
    return rank[shell] // -(-len(found) // MOST_SHELLS)


def _bound(corners: NDArray[np.float64], owner: NDArray, n: int) -> NDArray[np.float64]:
    """Give the boxes around triangles (n_faces, 3, 3) of each owner, (n, 2, 3)."""
    order = np.argsort(owner, kind="stable")
    starts = np.searchsorted(owner[order], np.arange(n))
    a, b, c = corners[order].transpose(1, 0, 2)  # thrice as fast as the least along an axis of 3
    low = np.minimum.reduceat(np.minimum(np.minimum(a, b), c), starts)
    high = np.maximum.reduceat(np.maximum(np.maximum(a, b), c), starts)
    return np.stack([low, high], 1)


def _find_balls(caster: Caster) -> NDArray[np.bool_]:
    """Tell which components are closed and join as on a ball's surface."""
    n = len(caster.is_closed)
    a, b = caster.edge_faces.T
    corner = caster.component[:, None] * np.int64(len(caster.vertices)) + caster.faces
    vertices = np.bincount(np.unique(corner) // len(caster.vertices), minlength=n)
    edges = np.bincount(caster.component[a], minlength=n)
    faces = np.bincount(caster.component, minlength=n)
    # An edge of four faces stands here twice: solids that touch along it pass as one ball.
    ends = np.sort(caster.edges, axis=1).astype(np.int64)
    _, same, times = np.unique(
        ends[:, 0] * len(caster.vertices) + ends[:, 1], return_inverse=True, return_counts=True
    )
    shared = (times > 1)[same.ravel()] | (caster.component[a] != caster.component[b])
    bad = np.bincount(caster.component[a], shared, n)
    return np.asarray(caster.is_closed & (vertices - edges + faces == 2) & (bad == 0))


def _find_dented(caster: Caster) -> NDArray[np.bool_]:
    """Tell which components bend inward at any edge."""
    a, b = caster.edge_faces.T
    across = caster.faces[b].sum(1) - caster.edges.sum(1)  # the corner that is not on the edge
    across = np.clip(across, 0, len(caster.vertices) - 1)
    height = np.einsum("ji,ij->i", caster.planes[:3, a], caster.vertices[across])
    height += caster.planes[3, a]
    size = np.linalg.norm(caster.planes[:3, a], axis=0) * np.abs(caster.vertices).max(initial=1.0)
    bent = height > 1e-6 * size  # files in float32 dent what was meant flat
    return np.asarray(np.bincount(caster.component[a], bent, len(caster.is_closed)) > 0)
