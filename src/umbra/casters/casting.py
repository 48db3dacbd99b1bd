"""Casters of a study, prepared for any receivers."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.errors import InputError
from umbra.rays.disc_marks import FaceEdges, make_face_edges
from umbra.rays.face_tree import FaceTree, make_face_tree
from umbra.rays.hidden import find_hidden
from umbra.scene import Scene, Triangles
from umbra.scene.derived import derive
from umbra.scene.grid import Places
from umbra.volume.adjacency import Caster, find_caster, make_caster

__all__ = ["Casting", "prepare_casting", "select_casters", "select_replaced"]


@dataclass(frozen=True, eq=False)
class Casting:
    """Casters of a study, for any receivers."""

    scene: Scene
    soup: Triangles  # all visible triangles
    caster: Caster  # all casters, canopies as if they were opaque
    threads: int
    canopy: Canopy | None = field(default=None, kw_only=True)  # casters that transmit light

    @cached_property
    def tree(self) -> FaceTree:
        """Bounding volume hierarchy over the casting faces."""
        return self._make_tree(self.caster)

    @cached_property
    def edges(self) -> FaceEdges:
        """Edges of the faces of the tree."""
        tree = self.tree
        return derive(self.caster, "edges", tree.tolerance, lambda: make_face_edges(tree))

    def _make_tree(self, caster: Caster) -> FaceTree:
        farthest = float(np.abs(self.scene.whole.bounds()).max())
        return derive(caster, "tree", farthest, lambda: make_face_tree(caster, farthest))

    def find_tree_without(self, kinds: Collection[str]) -> FaceTree:
        """Return the tree of the casting faces but for those of parts of some kinds, made once."""
        scene = self.scene
        left = [k for k, part in enumerate(scene.parts) if part.kind in kinds]
        soup = scene.triangles(left) if left else None
        if soup is None or not len(soup.faces):
            return self.tree

        def make() -> FaceTree:
            caster = self.caster  # it does not say which parts it is of: equal corners do
            own, theirs = (_name_corners(mesh.vertices[mesh.faces]) for mesh in (caster, soup))
            is_left = ~np.isin(own, theirs)
            rest = make_caster(caster.vertices, caster.faces[is_left], caster.component[is_left])
            return self._make_tree(rest)

        return derive(self.caster, "tree without", (id(scene), *left), make)

    @cached_property
    def solid(self) -> Self:
        """The same without the canopies."""
        parts = () if self.canopy is None else self.canopy.solid
        return self if self.canopy is None else self.with_casters(parts)

    def with_casters(self, parts: Sequence[int]) -> Self:
        """Return the same with other casters, all opaque: parts of ``scene.whole``."""
        return replace(self, caster=_make_caster(self.scene, parts), canopy=None)

    @cached_property
    def _trees(self) -> dict[int, tuple[Caster, FaceTree]]:
        return {}

    def find_cast(
        self, places: Places, caster: Caster, suns: NDArray[np.float64]
    ) -> tuple[NDArray[np.intp], NDArray[np.uint8]]:
        """
        Find the shadows of one of ``make_casters`` alone on some points, without attached shadow.

        Returns the k points that the shadows of n suns (n, 3) can reach, and masks (n, k) on them.
        """
        corners = caster.vertices[caster.faces.ravel()]
        which = places.find_reached(corners.min(0), corners.max(0), suns)
        masks = find_hidden(
            self.find_tree(caster), places.points[which], places.normals[which], suns,
            self.threads, attached=False,
        )  # fmt: skip
        return which, masks

    def find_tree(self, caster: Caster) -> FaceTree:
        """Return the tree of one of ``make_casters``, made once."""
        key = id(caster)  # which stays its own, since the caster is kept beside the tree
        if key not in self._trees:
            self._trees[key] = caster, self._make_tree(caster)
        return self._trees[key][1]

    def find_pieces(self, pieces: Sequence[Sequence[int]]) -> NDArray[np.int32]:
        """Return the piece of each casting face; the pieces hold all casting parts."""
        scene = self.scene.whole
        of_part = np.full(len(scene.groups()), -1, np.int32)
        for k, parts in enumerate(pieces):
            of_part[list(parts)] = k
        soup = scene.triangles(np.flatnonzero(of_part >= 0).tolist())
        return of_part[soup.part[self.caster.source]]

    def make_casters(self, pieces: Sequence[Sequence[int]]) -> list[Caster]:
        """Make casters of some parts each, as if they stood alone."""
        return [_make_caster(self.scene, parts) for parts in pieces]


def _name_corners(corners: NDArray[np.float64]) -> NDArray[np.bytes_]:
    """Return a name of each triangle (n, 3, 3), the same whichever corner comes first."""
    order = np.lexsort(tuple(corners[:, :, axis] for axis in (2, 1, 0)), axis=1)
    whole = np.take_along_axis(corners, order[:, :, None], 1).reshape(-1, 9) + 0.0
    return np.ascontiguousarray(whole).view("V72").ravel()


def prepare_casting(
    scene: Scene, casters: Sequence[int], threads: int, canopy: Canopy | None = None
) -> Casting:
    """Find the adjacency of the casters, indices of parts of ``scene.whole``, for any receivers."""
    soup = derive(scene, "soup", None, scene.triangles)
    caster = find_caster(scene.whole, casters)
    if canopy is not None:
        seen = np.ones(len(scene.parts), np.bool_)
        seen[list(canopy.parts)] = False
        soup = scene.triangles(np.flatnonzero(seen).tolist())
    return Casting(scene, soup, caster, threads, canopy=canopy)


def _make_caster(scene: Scene, parts: Sequence[int]) -> Caster:
    soup = scene.whole.triangles(parts)
    return make_caster(soup.vertices, soup.faces, scene.whole.groups()[soup.part])


def select_casters(scene: Scene, cast: Sequence[str], no_cast: Sequence[str]) -> list[int]:
    """Return the indices of the parts that cast; there must be one."""
    casters = [part for part in scene.whole.select(cast, no_cast) if part < len(scene.parts)]
    if not casters:
        msg = "no part is left to cast a shadow; remove a no_cast= pattern"
        raise InputError(msg, option="no_cast")
    return casters


def select_replaced(scene: Scene, cast: Sequence[str], no_cast: Sequence[str]) -> list[int]:
    """Return those that cast of what a proposal replaces, as indices of ``scene.whole``."""
    if not scene.replaced:
        return []
    return [part for part in scene.whole.select(cast, no_cast) if part >= len(scene.parts)]
