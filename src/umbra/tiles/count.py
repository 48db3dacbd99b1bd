"""
Counting one tile of a city.

``count_tile`` is a function of a job and a tile alone, which any process may call: it reads the
casters that can reach the tile, counts it, writes its chunks and then its mark. A tile without a
mark counts as not done, whatever chunks there are.
"""

import time
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.kind import Variables
from umbra.receivers.plan import PlanKind, PlanRaster
from umbra.receivers.plan_tiles import PlanModel
from umbra.scene.grid import Grid
from umbra.study.compare import NeighbourSums
from umbra.tiles.city_areas import count_areas
from umbra.tiles.city_lattice import CityTile
from umbra.tiles.city_proposal import split_neighbours, write_neighbours
from umbra.tiles.job import CityJob, WorkerContext
from umbra.tiles.neighbourhood import Neighbourhood, Selection, make_tile_casters
from umbra.tiles.receive import LEAST, SunGroups, count_receivers
from umbra.tiles.store import CityStore
from umbra.tiles.surface_pieces import write_pieces
from umbra.tiles.surface_results import count_surfaces

__all__ = [
    "LEAST_SIDE", "TileRecord", "count_tile", "count_window", "find_needs", "halve_window",
    "lay_out_window",
]  # fmt: skip

LEAST_SIDE = 64  # cells: smaller windows are not cut
# Memory of a process, measured and rounded up [byte]: of itself, for each face of the
# neighbourhood, for each cell, and for each cell and thread.
_BASE, _FACE, _CELL, _CELL_AND_THREAD = 3e8, 2500.0, 80.0, 8.0


@dataclass(frozen=True)
class TileRecord:
    """
    What a task reports of its tile.

    Parameters
    ----------
    number : int
    seconds : float
        Time taken [s].
    triangles : int
        Casting triangles that were read, added up over its windows.
    bare : int
        Cells without any of the model.
    """

    number: int
    seconds: float
    triangles: int = 0
    bare: int = 0


@dataclass(eq=False)
class WindowRaster(PlanRaster):
    """Cells of one window of a city's lattice."""

    def make_tiles(self, request: Any) -> list[tuple[Any, Any]]:
        """Return the window as one tile, numbered as in its block."""
        whole = slice(0, self.grid.rows), slice(0, self.grid.cols)
        self._parts = [(*whole, self.grid)]
        return [(whole, partial(self._make_tile, whole, self.grid))]


def count_tile(job: CityJob, tile: CityTile) -> TileRecord:
    """
    Count a tile and write it into the store of its job.

    Parameters
    ----------
    job : CityJob
    tile : CityTile

    Returns
    -------
    record : TileRecord
    """
    begun = time.perf_counter()
    context, store = job.open(), CityStore(job.store)
    if tile.areas:
        neighbours, triangles, bare = list[NeighbourSums](), count_areas(context, tile), 0
    elif context.kind.is_plan:
        neighbours, triangles, bare = _count_cells(context, store, tile)
    else:
        pieces, neighbours, triangles = count_surfaces(context, tile)
        write_pieces(store.find_place(tile.number), pieces)
        bare = 0
    write_neighbours(store.find_place(tile.number), neighbours)
    record = TileRecord(tile.number, time.perf_counter() - begun, triangles, bare)
    store.mark(tile, vars(record), job.fingerprint)
    return record


def _count_cells(
    context: WorkerContext, store: CityStore, tile: CityTile
) -> tuple[list[NeighbourSums], int, int]:
    """Count and write cells; return neighbours, and the numbers of triangles and bare cells."""
    job, lattice = context.job, context.job.lattice
    assert lattice is not None
    arrays: dict[str, NDArray] = {}
    neighbours: list[NeighbourSums] = []
    triangles = bare = 0
    shape = tile.rows[1] - tile.rows[0], tile.cols[1] - tile.cols[0]
    waiting = list(lattice.cut(tile, lattice.block))[::-1]
    while waiting:
        rows, cols = waiting.pop()
        grid = lattice.find_window(rows, cols)
        need = find_needs(context, grid)
        if need.bytes(context, grid) > job.memory and max(grid.rows, grid.cols) > LEAST_SIDE:
            waiting += halve_window(rows, cols)
            continue
        variables, losses, casting, empty = count_window(context, grid, need)
        neighbours += losses
        triangles, bare = triangles + casting, bare + empty
        where = (
            slice(rows.start - tile.rows[0], rows.stop - tile.rows[0]),
            slice(cols.start - tile.cols[0], cols.stop - tile.cols[0]),
        )
        for name, (dims, array) in variables.items():
            if dims[-2:] == ("y", "x"):
                values = np.asarray(array)
                if name not in arrays:
                    arrays[name] = np.zeros((*values.shape[:-2], *shape), values.dtype)
                arrays[name][(..., *where)] = values
    store.write(arrays, (..., slice(*tile.rows), slice(*tile.cols)))
    return neighbours, triangles, bare


def halve_window(rows: slice, cols: slice) -> list[tuple[slice, slice]]:
    """Cut a window in two across its longer side."""
    if rows.stop - rows.start >= cols.stop - cols.start:
        middle = (rows.start + rows.stop) // 2
        return [(slice(rows.start, middle), cols), (slice(middle, rows.stop), cols)]
    middle = (cols.start + cols.stop) // 2
    return [(rows, slice(cols.start, middle)), (rows, slice(middle, cols.stop))]


@dataclass(frozen=True)
class TileNeeds:
    """
    What counting a window reads.

    Parameters
    ----------
    seen, units : Selection
        Units that are seen in it; and those with all that cast onto it.
    box : (2, 3) float64
        Around its receivers, local frame [m].
    faces : int
        Number of the units' faces.
    """

    seen: Selection
    units: Selection
    box: NDArray[np.float64]
    faces: int

    def bytes(self, context: WorkerContext, grid: Grid) -> float:
        """Return the memory that a process takes to count the window, from measurements [byte]."""
        cell = _CELL + _CELL_AND_THREAD * context.job.threads + context.bytes_kept
        # Groups have casters of their own.
        faces = self.faces * (1 if context.groups is None else 2)
        return _BASE + faces * _FACE + grid.rows * grid.cols * cell


def find_needs(
    context: WorkerContext, grid: Grid, lights: NDArray[np.float64] | None = None
) -> TileNeeds:
    """
    Find the units that are seen in a window or cast onto it, of any light.

    Lights (n, 3) or (n, 4) are the study's by default.
    """
    near = Neighbourhood(context)
    x, y = grid.x, grid.y
    aside = np.array([grid.dx, grid.dy])
    low, high = np.array([x[0], y[0]]) - aside, np.array([x[-1], y[-1]]) + aside
    seen = near.find_seen(low, high)
    box = find_tile_box(context, near, seen, low, high)
    lights = context.lights.vectors if lights is None else lights
    units = seen | near.find_casting(box, lights)
    return TileNeeds(seen, units, box, near.count_faces(units))


def count_window(
    context: WorkerContext, grid: Grid, needs: TileNeeds
) -> tuple[Variables, list[NeighbourSums], int, int]:
    """
    Count the cells of a window.

    Parameters
    ----------
    context : WorkerContext
    grid : Grid
        In the run's local frame.
    needs : Needs
        As ``find_needs`` finds them.

    Returns
    -------
    variables : dict
        As a study's.
    neighbours : list of NeighbourSums
        Those that lose sun to a proposal; none without one.
    triangles : int
        Number of casting triangles.
    bare : int
        Number of cells without any of the model.
    """
    near, groups = Neighbourhood(context), context.groups
    is_due = groups is not None and groups.are_among(needs.units)

    def find_tiles(lights: NDArray[np.float64]) -> Any:
        units = needs.seen | near.find_casting(needs.box, lights)
        return lay_out_window(context, grid, units).make_tiles(None)

    if _has_groups(context) and (groups is None or (context.adds_exactly and not is_due)):
        laid = lay_out_window(context, grid, needs.seen)
        counter: Any = SunGroups(lambda suns: find_tiles(suns)[0][1]().make_counter())
    else:
        laid, counter = lay_out_window(context, grid, needs.units), None
    study, neighbours = count_receivers(
        context, laid, laid.make_tiles(None), find_tiles, counter, is_due=is_due
    )
    variables = split_neighbours(study.variables())
    return variables, neighbours, near.count_faces(needs.units), laid.bare


def _has_groups(context: WorkerContext) -> bool:
    """Return whether suns are so many that groups of them have casters of their own."""
    if context.sees_whole_sky:
        return False
    results = context.setup.results
    is_summed = not results.is_streamed and not results.by_day
    equal = len(np.unique(context.lights.weights, axis=0)) == 1 and bool(
        context.lights.are_suns.all()
    )
    return is_summed and equal and len(context.lights) >= 2 * LEAST and context.roles.season is None


def lay_out_window(
    context: WorkerContext, grid: Grid, units: Selection, *, has_kinds: bool = False
) -> WindowRaster:
    """Lay out the cells of a window among some units, whose parts' kinds are known if asked for."""
    job, kind = context.job, context.kind
    scene = Neighbourhood(context).read(units)
    if job.frame.is_added or has_kinds:
        scene = scene.with_words(context.catalogue)
    caster, canopy, soup = make_tile_casters(context, scene)
    assert isinstance(kind, PlanKind)
    model = PlanModel(
        scene, soup, caster, job.threads, job.frame.ground - context.origin[2], kind.tile,
        canopy=canopy, has_end=job.frame.has_end, lowest=job.frame.lowest - context.origin[2],
    )  # fmt: skip
    return WindowRaster(
        kind, model, (grid.rows, grid.cols), ("y", "x"), grid.dx * grid.dy, {}, x=grid.x, y=grid.y,
        grid=grid, ground=job.frame.ground, assumed=None,
    )  # fmt: skip


def find_tile_box(
    context: WorkerContext, near: Neighbourhood, seen: Any, low: NDArray, high: NDArray
) -> NDArray[np.float64]:
    """Return a box around the receivers of a window, local frame, (2, 3) [m]."""
    floor = context.job.frame.floor
    if context.kind.is_level:
        least = most = floor
    else:
        below, above = near.find_heights(seen)
        least = max(floor, below) if context.job.frame.has_end else floor
        most = max(least, above)
    return np.array([[*low, least], [*high, most]])
