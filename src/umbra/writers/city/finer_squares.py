"""Hours of a plan in tiles in finer steps, on the squares of its pictures, for these alone."""

from dataclasses import dataclass
from typing import ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights
from umbra.receivers.kind import Tile
from umbra.scene.grid import Grid
from umbra.study.finer import FACE, FREE, choose_parts, cut_steps
from umbra.study.light_sums import add_up
from umbra.study.loop import make_tile_run
from umbra.tiles.city_lattice import CityTile, Lattice
from umbra.tiles.count import (
    LEAST_SIDE,
    TileNeeds,
    find_needs,
    halve_window,
    lay_out_window,
)
from umbra.writers.city.city_plan import CityPlan

__all__ = ["FinerSquares", "count_finer_squares"]

_MOST = 4 * FREE
"""Work up to which steps of a large city are cut in three, at most."""
_ROUNDING = 1e-3  # of hours in float32


@dataclass(frozen=True, eq=False)
class FinerSquares:
    """
    Hours in finer steps than the store keeps, at the middles of squares.

    Parameters
    ----------
    shadow_hours : (rows, cols) float32
    lost : (rows, cols) float32 or None
        Hours of sun that a proposal takes, if there is one.
    is_covered : (rows, cols) bool
        Squares whose middle lies under a roof that covers them in part.
    up_hours : float
        Time with the sun up, by these steps [h].
    seconds : float
        Length of a step [s].
    """

    shadow_hours: NDArray[np.float32]
    lost: NDArray[np.float32] | None
    is_covered: NDArray[np.bool_]
    up_hours: float
    seconds: float
    kept: ClassVar[str] = "study.zarr"

    def refine(
        self, kept: NDArray[np.float32], finer: NDArray[np.float32] | None
    ) -> NDArray[np.float32]:
        """Return finer hours of squares, and those of the store's steps where there are none."""
        if finer is None:
            return kept
        return np.where(np.isnan(kept) | np.isnan(finer) | self.is_covered, kept, finer)


def count_finer_squares(
    plan: CityPlan, squares: Grid, means: NDArray[np.float32]
) -> FinerSquares | None:
    """
    Count the hours at the middles of squares in finer steps, with a bounded amount of work.

    The work is of squares, suns and all casters, so that a run in other tiles, or on another
    machine, has the same picture.

    Parameters
    ----------
    plan : CityPlan
    squares : Grid
        In the run's local frame.
    means : (rows, cols) float32
        Hours in shadow of the store's steps, of each square's open cells.

    Returns
    -------
    finer : FinerSquares or None
        None if the work allows no finer steps, and for nights, canopies, the sun's disc, and runs
        that solve instants exactly.
    """
    job, context = plan.job, plan.context
    options, period = job.options, context.period
    if (
        options.exact or options.disc or context.roles.season is not None
        or not period.sun.is_up.any()
    ):  # fmt: skip
        return None
    faces = sum(len(file.geometry.faces) for file in context.catalogue.files)
    suns = int(period.sun.is_up.sum()) * (2 if options.proposed else 1)
    work = suns * (squares.rows * squares.cols + FACE * faces)
    parts = choose_parts(period, max(FREE // work, min(3, _MOST // work)))
    if parts == 1:
        return None
    lights = cut_steps(period, parts, job.min_altitude)
    shape = squares.rows, squares.cols
    hours = np.full(shape, np.nan, np.float32)
    lost = np.full(shape, np.nan, np.float32) if options.proposed else None
    lattice = Lattice(squares, max(shape), plan.lattice.block)
    waiting = list(lattice.cut(CityTile(0, (0, shape[0]), (0, shape[1])), lattice.block))
    while waiting:
        window = waiting.pop()
        grid = lattice.find_window(*window)
        needs = find_needs(context, grid, lights.vectors)
        if needs.bytes(context, grid) > job.memory and max(grid.rows, grid.cols) > LEAST_SIDE:
            waiting += halve_window(*window)
            continue
        hours[window], before = _count(plan, grid, needs, lights)
        if lost is not None:
            lost[window] = hours[window] - before
    up_hours = float(lights.weights.sum())
    is_dark = hours >= up_hours - _ROUNDING
    is_covered = is_dark & (means < plan.result.up_hours - _ROUNDING)
    return FinerSquares(hours, lost, is_covered, up_hours, 3600 * float(period.hours[0]) / parts)


def _count(
    plan: CityPlan, grid: Grid, needs: TileNeeds, lights: Lights
) -> tuple[NDArray[np.float32], NDArray[np.float32] | float]:
    """Count the hours in shadow of a window, and those before a proposal; NaN without one."""
    context = plan.context
    [(_, make_tile)] = lay_out_window(context, grid, needs.units).make_tiles(None)
    tile = make_tile()

    def count(tile: Tile) -> NDArray[np.float32]:
        run = make_tile_run(tile, None).behind_land(context.period)
        return cast("NDArray[np.float32]", add_up(run.counters[0], tile.shape, lights)[0])

    hours = count(tile)
    if not plan.job.options.proposed:
        return hours, np.nan
    assert context.groups is not None
    before = context.groups.proposal.find_before(tile)
    return hours, count(tile.with_casters(list(before)))
