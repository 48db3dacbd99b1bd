"""A scene made ready for study: who casts, who receives, and how that is counted."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.face_tree import FaceTree, make_face_tree
from umbra.cpu.field import FieldSweep
from umbra.cpu.plane import PlaneSweep
from umbra.cpu.rays import find_hidden
from umbra.cpu.sweep import Sweep
from umbra.scene import Scene, Triangles
from umbra.scene.grid import Grid
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
        What casts.
    threads : int
    """

    scene: Scene
    soup: Triangles
    caster: Caster
    threads: int

    @cached_property
    def tree(self) -> FaceTree:
        """What casts, for ways that start anywhere."""
        return make_face_tree(self.caster)

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
        key = id(caster)  # which stays its own, since the caster is kept beside the tree
        if key not in self._trees:
            self._trees[key] = caster, make_face_tree(caster)
        corners = caster.vertices[caster.faces.ravel()]
        which = places.find_reached(corners.min(0), corners.max(0), suns)
        masks = find_hidden(
            self._trees[key][1], places.points[which], places.normals[which], suns, self.threads,
            attached=False,
        )  # fmt: skip
        return which, masks

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
    """

    receivers: str
    ground: float

    def make_sweep(self, grid: Grid) -> tuple[Surface, Sweep]:
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
        return PlanTile(self, grid, find_surface(self.soup, grid, self.ground, self.threads))


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
    """

    model: Model
    grid: Grid
    surface: Surface

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns."""
        return self.grid.rows, self.grid.cols

    @property
    def relief(self) -> NDArray[np.float64]:
        """What stands above the ground, (rows, cols) float64 [m]."""
        return self.surface.heights - self.model.ground

    def make_counter(self) -> Sweep:
        """Make ready to count: on a plane by crossings, on anything else by spans."""
        model, surface = self.model, self.surface
        if model.receivers == "ground":
            return PlaneSweep(model.caster, self.grid, model.ground, model.threads)
        return FieldSweep(model.caster, self.grid, surface.heights, model.threads, surface.slopes)

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
        return window, FieldSweep(caster, grid, heights[window], model.threads).masks(suns)

    @cached_property
    def places(self) -> Places:
        """The cells' centres on the receiver."""
        x, y = np.meshgrid(self.grid.x, self.grid.y)
        is_ground = self.model.receivers == "ground"
        z = np.full(x.shape, self.model.ground) if is_ground else self.surface.heights
        normals = np.zeros((x.size, 3))
        normals[:, 2] = 1.0
        if not is_ground:
            slopes = self.surface.slopes
            normals[slopes.cells] = slopes.planes[:3, slopes.face].T
        return Places(np.stack([x, y, z], -1).reshape(-1, 3), normals)

    def find_parts(self) -> NDArray[np.intp]:
        """Give the part that is topmost in each cell, (rows, cols); -1 on the ground."""
        face = self.surface.face
        return np.where(face < 0, -1, self.model.soup.part[np.maximum(face, 0)])


def prepare_model(
    scene: Scene, casters: list[int], receivers: str, ground: float, threads: int
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
    """
    cast = prepare_casting(scene, casters, threads)
    return Model(scene, cast.soup, cast.caster, threads, receivers, ground)


def prepare_casting(scene: Scene, casters: list[int], threads: int) -> Casting:
    """Find the adjacency of what casts, for any receivers; same parameters."""
    soup = scene.triangles()
    caster = _make_caster(scene, casters, soup if len(casters) == len(scene.parts) else None)
    return Casting(scene, soup, caster, threads)


def _make_caster(scene: Scene, parts: Sequence[int], soup: Triangles | None = None) -> Caster:
    soup = scene.triangles(parts) if soup is None else soup
    return make_caster(soup.vertices, soup.faces, scene.groups()[soup.part])


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
