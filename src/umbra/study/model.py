"""A scene made ready for study: who casts, who receives, and how that is counted."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.height_field import HeightFieldSweep
from umbra.cpu.plane import PlaneSweep
from umbra.cpu.sweep import Sweep
from umbra.rays.face_tree import FaceTree, make_face_tree
from umbra.rays.hidden import find_hidden
from umbra.scene import Scene, Triangles
from umbra.scene.grid import ASIDE, Grid
from umbra.study.beneath import BeneathSweep
from umbra.study.canopy import Canopy
from umbra.study.receivers import Places, Surface, find_surface
from umbra.volume.adjacency import Caster, make_caster

__all__ = ["Casting", "Model", "PlanTile", "prepare_casting", "prepare_model"]


@dataclass(frozen=True, eq=False)
class Casting:
    """
    What casts in a study, whatever receives.

    Parameters
    ----------
    scene : Scene
    soup : Triangles
        All that is seen.
    caster : Caster
        What casts, canopies as if they were solid.
    threads : int
    canopy : Canopy, optional
        What of it lets light through.
    """

    scene: Scene
    soup: Triangles
    caster: Caster
    threads: int
    canopy: Canopy | None = field(default=None, kw_only=True)

    @cached_property
    def tree(self) -> FaceTree:
        """What casts, for ways that start anywhere."""
        return make_face_tree(self.caster, self._farthest)

    @property
    def _farthest(self) -> float:
        return float(np.abs(self.scene.bounds()).max())

    @cached_property
    def solid(self) -> Self:
        """The same without the canopies."""
        parts = () if self.canopy is None else self.canopy.solid
        return self if self.canopy is None else self.with_casters(parts)

    def with_casters(self, parts: Sequence[int]) -> Self:
        """Give the same receivers with other parts casting, all of them solid."""
        return replace(self, caster=_make_caster(self.scene, parts), canopy=None)

    @cached_property
    def _trees(self) -> dict[int, tuple[Caster, FaceTree]]:
        return {}

    def find_cast(
        self, places: Places, caster: Caster, suns: NDArray[np.float64]
    ) -> tuple[NDArray[np.intp], NDArray[np.uint8]]:
        """
        Find the shadows of one caster alone on some points, without attached shadow.

        Parameters
        ----------
        places : Places
        caster : Caster
            One of ``make_casters``.
        suns : (n, 3) float64

        Returns
        -------
        which : (k,) int
            Points that they can reach.
        masks : (n, k) uint8
            Of those.
        """
        corners = caster.vertices[caster.faces.ravel()]
        which = places.find_reached(corners.min(0), corners.max(0), suns)
        masks = find_hidden(
            self.find_tree(caster), places.points[which], places.normals[which], suns,
            self.threads, attached=False,
        )  # fmt: skip
        return which, masks

    def find_tree(self, caster: Caster) -> FaceTree:
        """Give the tree of one of ``make_casters``, made once."""
        key = id(caster)  # which stays its own, since the caster is kept beside the tree
        if key not in self._trees:
            self._trees[key] = caster, make_face_tree(caster, self._farthest)
        return self._trees[key][1]

    def make_casters(self, pieces: Sequence[Sequence[int]]) -> list[Caster]:
        """Make casters of some parts each, as if they stood alone."""
        return [_make_caster(self.scene, parts) for parts in pieces]


@dataclass(frozen=True, eq=False)
class Model(Casting):
    """
    Casters and receivers of a plan.

    Parameters
    ----------
    scene, soup, caster, threads
        As in ``Casting``.
    receivers : {'ground', 'top'}
    ground : float
        z of the ground, local frame [m].
    has_end : bool
        Whether nothing receives beside what is seen, as there is no ground plane.
    """

    receivers: str
    ground: float
    has_end: bool = field(default=False, kw_only=True)

    def make_sweep(self, grid: Grid) -> tuple[Surface, Sweep | BeneathSweep]:
        """
        Look at a raster from above and make ready to count on it.

        Parameters
        ----------
        grid : Grid
            Local frame.

        Returns
        -------
        surface : Surface
        sweep : Sweep
        """
        tile = self.make_tile(grid)
        return tile.surface, tile.make_counter()

    def make_tile(self, grid: Grid) -> "PlanTile":
        """Look at a raster from above."""
        # What lies in the plane is seen if there is no plane.
        floor = self.ground - self.has_end
        surface = find_surface(self.soup, grid, floor, self.threads, has_end=self.has_end)
        beneath = surface.rim
        if self.canopy is not None and self.receivers == "top":
            crowns = self.scene.triangles(self.canopy.casting)
            above = find_surface(crowns, grid, floor, self.threads)
            beneath = np.union1d(beneath, np.flatnonzero(above.heights > surface.heights))
        return PlanTile(self, grid, surface, beneath)


@dataclass(frozen=True, eq=False)
class PlanTile:
    """
    Receivers on a plan: the ground plane, or the topmost surface.

    Parameters
    ----------
    model : Model
    grid : Grid
        Local frame.
    surface : Surface
        Of the grid.
    beneath : (n,) int
        Flat indices of the cells over which canopies hang, and of those on the surface's rim.
    """

    model: Model
    grid: Grid
    surface: Surface
    beneath: NDArray[np.intp]

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns."""
        return self.grid.rows, self.grid.cols

    @property
    def tree(self) -> FaceTree:
        """What casts, for ways that start anywhere."""
        return self.model.tree

    @property
    def nothing(self) -> NDArray[np.bool_]:
        """Where nothing receives, (rows, cols) bool."""
        return (self.surface.face < 0) & self.model.has_end

    @property
    def axes(self) -> NDArray[np.float64]:
        """The directions of columns and rows, (2, 3) float64."""
        return np.eye(3)[:2]

    @property
    def relief(self) -> NDArray[np.float64]:
        """What stands above the ground, (rows, cols) float64 [m]."""
        return np.maximum(self.surface.heights - self.model.ground, 0.0)

    def make_counter(self) -> Sweep | BeneathSweep:
        """Make ready to count: on a plane by crossings, on anything else by spans."""
        model, surface = self.model, self.surface
        if model.receivers == "ground":
            return PlaneSweep(model.caster, self.grid, model.ground, model.threads)
        return self.with_rays(
            HeightFieldSweep(
                model.caster, self.grid, surface.heights, model.threads, surface.slopes
            )
        )

    def with_rays(self, sweep: Any) -> Any:
        """Let rays count where a sweep, on any device, cannot."""
        if not len(self.beneath):
            return sweep
        model, places = self.model, self._place(self.beneath)
        return BeneathSweep(sweep, self.beneath, model.tree, places, model.threads)

    def find_cast(
        self, caster: Caster, suns: NDArray[np.float64]
    ) -> tuple[tuple[slice, ...], NDArray[np.uint8]]:
        """
        Find the shadows of one caster alone, without attached shadow.

        Parameters
        ----------
        caster : Caster
        suns : (n, 3) float64

        Returns
        -------
        window : tuple of slice
            Rows and columns that hold all of them.
        masks : (n, rows, cols) uint8
            Of the window.
        """
        model = self.model
        is_plane = model.receivers == "ground"
        heights = self.surface.heights
        floor = model.ground if is_plane else float(heights.min())
        window, grid = _crop(self.grid, caster, suns, floor)
        if grid.rows < 1 or grid.cols < 1:
            return window, np.zeros((len(suns), max(grid.rows, 0), max(grid.cols, 0)), np.uint8)
        if is_plane:
            return window, PlaneSweep(caster, grid, floor, model.threads).masks(suns)
        sweep = HeightFieldSweep(caster, grid, heights[window], model.threads)
        inside = np.zeros(self.shape, np.bool_)
        inside.ravel()[self.beneath] = True
        if not inside[window].any():
            return window, sweep.masks(suns)
        places = self._place(np.flatnonzero(inside & _fill(self.shape, window)))
        cells, tree = np.flatnonzero(inside[window]), model.find_tree(caster)
        return window, BeneathSweep(
            sweep, cells, tree, places, model.threads, attached=False
        ).masks(suns)

    def _place(self, cells: NDArray[np.intp]) -> Places:
        """Give some cells' centres."""
        return Places(self.places.points[cells], self.places.normals[cells])

    @cached_property
    def places(self) -> Places:
        """The cells' centres on the receiver, as far beside them as it was looked at."""
        x, y = np.meshgrid(self.grid.x, self.grid.y)
        is_ground = self.model.receivers == "ground"
        aside = np.tile(ASIDE, (x.size, 1))
        if not is_ground:
            aside[self.surface.rim] = self.surface.inward
        x += (aside[:, 0] * self.grid.dx).reshape(x.shape)
        y += (aside[:, 1] * self.grid.dy).reshape(x.shape)
        z = np.full(x.shape, self.model.ground) if is_ground else self.surface.heights
        normals = np.zeros((x.size, 3))
        normals[:, 2] = 1.0
        if not is_ground:
            slopes = self.surface.slopes
            normals[slopes.cells] = slopes.planes[:3, slopes.face].T
        return Places(np.stack([x, y, z], -1).reshape(-1, 3), normals)

    def with_casters(self, parts: Sequence[int] | None = None) -> "PlanTile":
        """Give the same receivers with other parts casting; all but canopies by default."""
        model = self.model.solid if parts is None else self.model.with_casters(parts)
        return replace(self, model=model)

    def find_canopies(self) -> NDArray[np.bool_]:
        """Tell which cells canopies hang over, (rows, cols), whatever receives there."""
        model = self.model
        if model.canopy is None:
            return np.zeros(self.shape, np.bool_)
        crowns = model.scene.triangles(model.canopy.parts)
        return find_surface(crowns, self.grid, model.ground, model.threads).face >= 0

    def find_parts(self) -> NDArray[np.intp]:
        """Give the part that is topmost in each cell, (rows, cols); -1 on the ground."""
        face = self.surface.face
        return np.where(face < 0, -1, self.model.soup.part[np.maximum(face, 0)])


def prepare_model(
    scene: Scene,
    casters: list[int],
    receivers: str,
    ground: float,
    threads: int,
    canopy: Canopy | None = None,
    *,
    has_end: bool = False,
) -> Model:
    """
    Find the adjacency of what casts.

    Parameters
    ----------
    scene : Scene
    casters : list of int
        Indices of the parts that cast.
    receivers : {'ground', 'top'}
    ground : float
        Local frame [m].
    threads : int
    canopy : Canopy, optional
    has_end : bool
        Whether nothing receives beside what is seen.
    """
    cast = prepare_casting(scene, casters, threads, canopy)
    return Model(
        scene, cast.soup, cast.caster, threads, receivers, ground, canopy=canopy, has_end=has_end
    )


def prepare_casting(
    scene: Scene, casters: list[int], threads: int, canopy: Canopy | None = None
) -> Casting:
    """Find the adjacency of what casts, for any receivers; same parameters."""
    soup = scene.triangles()
    caster = _make_caster(scene, casters, soup if len(casters) == len(scene.parts) else None)
    if canopy is not None:
        seen = np.ones(len(scene.parts), np.bool_)
        seen[list(canopy.parts)] = False
        soup = scene.triangles(np.flatnonzero(seen).tolist())
    return Casting(scene, soup, caster, threads, canopy=canopy)


def _make_caster(scene: Scene, parts: Sequence[int], soup: Triangles | None = None) -> Caster:
    soup = scene.triangles(parts) if soup is None else soup
    return make_caster(soup.vertices, soup.faces, scene.groups()[soup.part])


def _fill(shape: tuple[int, ...], window: tuple[slice, ...]) -> NDArray[np.bool_]:
    """Give where a window lies among all cells."""
    where = np.zeros(shape, np.bool_)
    where[window] = True
    return where


def _crop(
    grid: Grid, caster: Caster, suns: NDArray[np.float64], floor: float
) -> tuple[tuple[slice, slice], Grid]:
    """Give the part of a raster that a caster's shadows can reach, down to the lowest receiver."""
    corners = caster.vertices[caster.faces.ravel()]
    low, high = grid.to_cells(np.stack([corners.min(0), corners.max(0)]))
    drop = max(high[2] - floor, 0.0)
    reach = -suns[:, :2] / suns[:, 2:] * (drop / grid.dx, drop / grid.dy)
    reach = np.concatenate([np.zeros((1, 2)), reach])
    first = np.floor(low[:2] + reach.min(0)) - 1
    last = np.ceil(high[:2] + reach.max(0)) + 2
    col, row = (int(v) for v in np.clip(first, 0, (grid.cols, grid.rows)))
    cols, rows = (int(v) for v in np.clip(last, 0, (grid.cols, grid.rows)))
    if drop == 0.0:
        cols, rows = col, row
    part = Grid(
        grid.x0 + col * grid.dx, grid.y0 + row * grid.dy, grid.dx, grid.dy, cols - col, rows - row
    )
    return (slice(row, max(rows, row)), slice(col, max(cols, col))), part
