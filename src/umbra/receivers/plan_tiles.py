"""Tiles of plans, and their shadow counters."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.cpu.height_field import HeightFieldSweep
from umbra.cpu.plane import PlaneSweep
from umbra.cpu.raster_sweep import Sweep
from umbra.rays.face_tree import FaceTree
from umbra.receivers.covered import CoveredSweep
from umbra.receivers.zenith import Surface, find_surface
from umbra.scene.derived import derive
from umbra.scene.grid import ASIDE, Grid, Places
from umbra.scene.mesh import ADDED_GROUND, ASSUMED_UNDER
from umbra.volume.adjacency import Caster

__all__ = ["PlanModel", "PlanTile", "PlaneTile", "ThroughTile", "TopmostTile"]

_KEPT = 1 << 22  # most cells of a surface kept for the next study, 80 MB


@dataclass(frozen=True, eq=False)
class PlanModel(Casting):
    """
    Casters and receivers of a plan.

    Parameters
    ----------
    scene, soup, caster, threads, canopy
        As in ``Casting``.
    ground : float
        z of the ground, local frame [m].
    tile : type
        Whether the plane or the topmost surface receives.
    has_end : bool
        Whether there is no ground plane, so that only the visible parts receive.
    lowest : float
        z of the lowest place of a ground that was added, local frame [m].
    """

    ground: float
    tile: "type[PlanTile]"
    has_end: bool = field(default=False, kw_only=True)
    lowest: float = field(default=np.inf, kw_only=True)

    def make_tile(self, grid: Grid) -> "PlanTile":
        """Make the receivers of a raster of the local frame."""
        return self.tile(self, grid)

    def find_topmost(self, grid: Grid) -> Surface:
        """Find the topmost surface of the visible parts."""

        def find() -> Surface:
            return find_surface(self.soup, grid, self.floor, self.threads, has_end=self.has_end)

        if grid.rows * grid.cols > _KEPT:
            return find()
        return derive(self.soup, "surface", (grid, self.floor, self.has_end), find)

    def find_added_ground(self, grid: Grid) -> Surface:
        """Find the surface of the ground that was added to the model, through all else."""

        def find() -> Surface:
            soup, parts = self.soup, self.scene.parts
            is_added = np.array([part.kind in ADDED_GROUND for part in parts], np.bool_)
            chosen = np.flatnonzero(is_added[soup.part])
            own = replace(soup, faces=soup.faces[chosen], part=soup.part[chosen])
            surface = find_surface(own, grid, self.floor, self.threads, has_end=True)
            face = np.append(chosen, -1).astype(np.int32)[np.maximum(surface.face, -1)]
            return replace(surface, face=face)

        if grid.rows * grid.cols > _KEPT:
            return find()
        return derive(self.soup, "added ground", (grid, self.floor), find)

    @property
    def floor(self) -> float:
        """Height above which parts are visible; just below the plane if there is no plane."""
        return min(self.ground, self.lowest) - self.has_end


@dataclass(frozen=True, eq=False)
class PlanTile:
    """
    Receivers on a plan.

    Parameters
    ----------
    model : PlanModel
    grid : Grid
        Local frame.
    """

    model: PlanModel
    grid: Grid
    on_plane: ClassVar[bool]
    is_topmost: ClassVar[bool] = True

    @cached_property
    def surface(self) -> Surface:
        """Topmost surface of the cells, found on first access."""
        return self.model.find_topmost(self.grid)

    @property
    def receiving(self) -> Surface:
        """The surface that receives."""
        return self.surface

    @cached_property
    def covered(self) -> NDArray[np.intp]:
        """Flat indices of the cells that need rays instead of a sweep: none on a plane."""
        return np.zeros(0, np.intp)

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns."""
        return self.grid.rows, self.grid.cols

    @property
    def casting(self) -> PlanModel:
        """The casters of its scene."""
        return self.model

    @property
    def tree(self) -> FaceTree:
        """Bounding volume hierarchy over the casting faces."""
        return self.model.tree

    @property
    def nothing(self) -> NDArray[np.bool_]:
        """Cells that do not receive, (rows, cols) bool."""
        if not self.model.has_end:
            return np.zeros(self.shape, np.bool_)
        return self.surface.face < 0

    @property
    def axes(self) -> NDArray[np.float64]:
        """The directions of columns and rows, (2, 3) float64."""
        return np.eye(3)[:2]

    @property
    def relief(self) -> NDArray[np.float64]:
        """Heights above the ground, 0 on it, (rows, cols) float64 [m]."""
        relief = self.surface.heights - self.model.ground
        return np.maximum(relief, 0.0, out=relief)

    @property
    def drawn_heights(self) -> NDArray[np.float64]:
        """Heights above the ground for pictures, NaN where nothing receives, (rows, cols) [m]."""
        return np.where(self.nothing, np.nan, self.relief)

    @abstractmethod
    def make_sweep(self, caster: Caster, window: tuple[slice, ...] | None = None) -> Sweep:
        """Prepare to count one caster's shadows, on all cells or a window of them."""

    @abstractmethod
    def find_z(self) -> NDArray[np.float64]:
        """Return the height of each receiver, (rows, cols) float64 [m], local frame."""

    def make_counter(self) -> "Sweep | CoveredSweep":
        """Return a counter of all casters and of attached shadow."""
        return self.with_rays(self.make_sweep(self.model.caster))

    def with_rays(self, sweep: Any) -> Any:
        """Complement any device's sweep with rays for the cells that it cannot count."""
        if not len(self.covered):
            return sweep
        places = self.places.pick(self.covered)
        return CoveredSweep(sweep, self.covered, self.model.tree, places, self.model.threads)

    def count_many(self, lights: int) -> None:
        """Return None: a sweep is the fastest for any number of lights."""

    def count_pieces(self, pieces: Sequence[Sequence[int]]) -> None:
        """Return nothing: a sweep counts one caster, on the cells in its reach."""

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
            Rows and columns that hold all shadows.
        masks : (n, rows, cols) uint8
            Of the window.
        """
        model = self.model
        window, grid = _crop(self.grid, caster, suns, self.find_floor())
        if grid.rows < 1 or grid.cols < 1:
            return window, np.zeros((len(suns), max(grid.rows, 0), max(grid.cols, 0)), np.uint8)
        sweep = self.make_sweep(caster, window)
        inside = np.zeros(self.shape, np.bool_)
        inside.ravel()[self.covered] = True
        if not inside[window].any():
            return window, sweep.masks(suns)
        places = self.places.pick(np.flatnonzero(inside & _fill(self.shape, window)))
        cells, tree = np.flatnonzero(inside[window]), model.find_tree(caster)
        return window, CoveredSweep(
            sweep, cells, tree, places, model.threads, attached=False
        ).masks(suns)

    @abstractmethod
    def find_floor(self) -> float:
        """Return the lowest receiver's height [m], local frame."""

    @cached_property
    def places(self) -> Places:
        """Receiver points of the cells, at the offsets from the centres used for heights."""
        x, y = np.meshgrid(self.grid.x, self.grid.y)
        aside = self._find_aside()
        x += (aside[:, 0] * self.grid.dx).reshape(x.shape)
        y += (aside[:, 1] * self.grid.dy).reshape(x.shape)
        normals = np.zeros((x.size, 3))
        normals[:, 2] = 1.0
        self._tilt(normals)
        return Places(np.stack([x, y, self.find_z()], -1).reshape(-1, 3), normals)

    def _find_aside(self) -> NDArray[np.float64]:
        return np.tile(ASIDE, (self.grid.rows * self.grid.cols, 1))

    def _tilt(self, normals: NDArray[np.float64]) -> None:
        """Set the normals of cells that are not level."""

    def with_casters(self, parts: Sequence[int] | None = None) -> "PlanTile":
        """Return the same receivers with other parts casting; all but canopies by default."""
        model = self.model.solid if parts is None else self.model.with_casters(parts)
        other, known = replace(self, model=model), ("surface", "covered", "places")
        _ = self.covered  # rays count the same cells for any casters
        vars(other).update({name: vars(self)[name] for name in known if name in vars(self)})
        return other

    def find_canopies(self) -> NDArray[np.bool_]:
        """Find the cells under canopies, (rows, cols)."""
        model = self.model
        if model.canopy is None:
            return np.zeros(self.shape, np.bool_)
        crowns = model.scene.triangles(model.canopy.parts)
        return find_surface(crowns, self.grid, model.floor, model.threads).face >= 0

    def find_cells(self, parts: Sequence[int]) -> NDArray[np.bool_]:
        """Find the cells in which some parts are topmost, (rows, cols)."""
        return np.isin(self.find_parts(), parts)

    def find_parts(self) -> NDArray[np.intp]:
        """Return the topmost part of each cell, (rows, cols); -1 on the ground."""
        face = self.surface.face
        return np.append(self.model.soup.part, -1)[face]  # -1 is the last

    def find_below(self, parts: Sequence[int]) -> NDArray[np.bool_]:
        """Find the cells over which some parts of ``scene.whole`` would lie, (rows, cols)."""
        model = self.model
        above = find_surface(
            model.scene.whole.triangles(parts), self.grid, model.floor, model.threads
        )
        return above.heights > self.find_z()


class PlaneTile(PlanTile):
    """Cells of the ground plane."""

    on_plane = True

    def make_sweep(self, caster: Caster, window: tuple[slice, ...] | None = None) -> Sweep:
        """Prepare a sweep over the plane's crossings."""
        grid = self.grid if window is None else self.grid.window(*window)
        return PlaneSweep(caster, grid, self.model.ground, self.model.threads)

    def find_z(self) -> NDArray[np.float64]:
        """Return the ground's height everywhere."""
        return np.full(self.shape, self.model.ground)

    def find_floor(self) -> float:
        """Return the ground's height."""
        return self.model.ground


class TopmostTile(PlanTile):
    """Cells of the topmost surface."""

    on_plane = False

    @cached_property
    def covered(self) -> NDArray[np.intp]:
        """Cells on the surface's rim, and cells under canopies."""
        return np.union1d(self.surface.rim, np.flatnonzero(self._find_crowned()))

    def _find_crowned(self) -> NDArray[np.bool_]:
        """Find the cells under canopies, which are see-through."""
        model, surface = self.model, self.receiving
        if model.canopy is None:
            return np.zeros(self.shape, np.bool_)
        crowns = model.scene.whole.triangles(model.canopy.casting)
        above = find_surface(crowns, self.grid, model.floor, model.threads)
        return above.heights > surface.heights

    def make_sweep(self, caster: Caster, window: tuple[slice, ...] | None = None) -> Sweep:
        """Prepare a sweep over the height field, with attached shadow if all cells are counted."""
        model, surface = self.model, self.receiving
        if window is None:
            return HeightFieldSweep(
                caster, self.grid, surface.heights, model.threads, surface.slopes
            )
        return HeightFieldSweep(
            caster, self.grid.window(*window), surface.heights[window], model.threads
        )

    def find_z(self) -> NDArray[np.float64]:
        """Return the height of the topmost surface."""
        return self.receiving.heights

    def find_floor(self) -> float:
        """Return the lowest of all heights."""
        return float(self.receiving.heights.min())

    def _find_aside(self) -> NDArray[np.float64]:
        aside = super()._find_aside()
        aside[self.receiving.rim] = self.receiving.inward
        return aside

    def _tilt(self, normals: NDArray[np.float64]) -> None:
        slopes = self.receiving.slopes
        normals[slopes.cells] = slopes.planes[:3, slopes.face].T


class ThroughTile(TopmostTile):
    """Cells of a ground that was added to the model, seen through all that stands on it."""

    is_topmost = False

    @cached_property
    def receiving(self) -> Surface:
        """The surface of the ground."""
        return self.model.find_added_ground(self.grid)

    @cached_property
    def nothing(self) -> NDArray[np.bool_]:
        """Cells under buildings, and beyond the ground."""
        kinds = np.array([part.kind for part in self.model.scene.parts])
        is_under = np.append(kinds[self.model.soup.part] == ASSUMED_UNDER, True)
        return is_under[self.receiving.face]

    @cached_property
    def covered(self) -> NDArray[np.intp]:
        """Cells that need rays: under something, and on the ground's rim."""
        ground = self.receiving
        is_under = (self.surface.face != ground.face) & ~self.nothing
        return np.union1d(ground.rim, np.flatnonzero(is_under | self._find_crowned()))

    @property
    def relief(self) -> NDArray[np.float64]:
        """Heights above the ground, 0 on it, (rows, cols) float64 [m]."""
        relief = self.surface.heights - self.receiving.heights
        return np.maximum(relief, 0.0, out=relief)

    @property
    def drawn_heights(self) -> NDArray[np.float64]:
        """Heights above the ground for pictures: buildings are drawn over what lies below."""
        return np.where(self.receiving.face < 0, np.nan, self.relief)


def _fill(shape: tuple[int, ...], window: tuple[slice, ...]) -> NDArray[np.bool_]:
    """Return a mask of all cells that is true in a window."""
    where = np.zeros(shape, np.bool_)
    where[window] = True
    return where


def _crop(
    grid: Grid, caster: Caster, suns: NDArray[np.float64], floor: float
) -> tuple[tuple[slice, slice], Grid]:
    """Find the window of a raster that a caster's shadows reach, down to the lowest receiver."""
    corners = caster.vertices[caster.faces.ravel()]
    low, high = grid.to_cells(np.stack([corners.min(0), corners.max(0)]))
    low, high = low - (grid.col, grid.row, 0), high - (grid.col, grid.row, 0)
    drop = max(high[2] - floor, 0.0)
    reach = -suns[:, :2] / suns[:, 2:] * (drop / grid.dx, drop / grid.dy)
    reach = np.concatenate([np.zeros((1, 2)), reach])
    first = np.floor(low[:2] + reach.min(0)) - 1
    last = np.ceil(high[:2] + reach.max(0)) + 2
    col, row = (int(v) for v in np.clip(first, 0, (grid.cols, grid.rows)))
    cols, rows = (int(v) for v in np.clip(last, 0, (grid.cols, grid.rows)))
    if drop == 0.0:
        cols, rows = col, row
    window = slice(row, max(rows, row)), slice(col, max(cols, col))
    return window, grid.part(*window)
