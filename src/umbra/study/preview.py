"""
Content of a study's pictures and films: moments, and plans at a picture's resolution.

Moments are clock times with the sun up, round unless requested.
"""

import datetime as dt
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.tile import Counter
from umbra.scene.grid import Grid
from umbra.study.finer import LONGEST, find_most_work, find_work
from umbra.study.result import Study
from umbra.sun import find_sun
from umbra.sun.clock import ROUND, Stamps, Steps, find_round_stamps, find_stamps

__all__ = [
    "Moment",
    "Preview",
    "choose_stamps",
    "find_moments",
    "make_preview",
    "refine_preview",
]

MOST = 400_000_000
"""Cells of all stamps together: a day of many stamps is drawn with larger cells."""
COVERED = 0.9
"""Least share of its plan that a model with terrain covers."""
LOW = 0.25
"""Share of the model's height below which a tenth of the terrain lies."""


@dataclass(frozen=True, eq=False)
class Moment:
    """
    An instant with the sun above the horizon.

    Parameters
    ----------
    instant : datetime
        UTC.
    local : datetime
        Local time at the site.
    altitude, azimuth : float
        Of the sun [degrees].
    direction : (3,) float64
        Toward the sun, in the model's axes.
    """

    instant: dt.datetime
    local: dt.datetime
    altitude: float
    azimuth: float
    direction: NDArray[np.float64]


def choose_stamps(steps: Steps, at: Sequence[str] = (), most: int | None = None) -> Stamps:
    """Return the requested clock times on a date; by default its steps' ends, or N round ones."""
    if at:
        return find_stamps(steps.local()[0].date(), at, steps.zone)
    return steps if most is None or len(steps.stamps) <= most else _find_round(steps, None, most)


def find_moments(
    study: Study, at: Sequence[str] = (), *, every: int | None, most: int
) -> list[Moment]:
    """
    Find the requested moments with the sun up, or round ones.

    Parameters
    ----------
    study : Study
    at : sequence of str
        Clock times, as ``umbra.sun.clock.find_stamps`` reads them.
    every : int, optional
        Least spacing without ``at`` [min]. If None, or more than half of a date's period:
        the length of the study's steps, or the next round one.
    most : int
        Limit for all dates: fewer per date are shown, then only every n-th date.

    Returns
    -------
    moments : list of Moment
    """
    days = study.period.steps
    days = days[:: -(-len(days) // most)]
    chosen = [
        choose_stamps(steps, at) if at else _find_round(steps, every, most // len(days))
        for steps in days
    ]
    path = find_sun(
        study.site, np.concatenate([day.stamps for day in chosen]), refraction=study.refraction
    )
    local = [when for day in chosen for when in day.local()]
    return [
        Moment(
            local[k].astimezone(dt.UTC), local[k], float(path.altitude[k]),
            float(path.azimuth[k]), path.direction[k],
        )
        for k in np.flatnonzero(path.is_up & ~study.period.meets_land(path.direction))
    ]  # fmt: skip


def _find_round(steps: Steps, every: int | None, most: int) -> Stamps:
    """Return at most N round times of a date, or its steps' ends if it has none."""
    length = float(steps.hours.sum()) * 60
    least = every if every and every <= length / 2 else float(steps.hours.max()) * 60
    for minutes in ROUND:
        if minutes > least - 1e-6:
            stamps = find_round_stamps(steps, minutes)
            if len(stamps.stamps) <= most:
                return stamps if len(stamps.stamps) else steps
    return steps


@dataclass(frozen=True, eq=False)
class PreviewCells:
    """The cells of a preview and what counts on them, whatever the date."""

    grid: Grid
    tile: Any  # of a plan or a view

    @cached_property
    def counter(self) -> Counter:
        """Counts on these cells."""
        return cast("Counter", self.tile.make_counter())


@dataclass(frozen=True, eq=False)
class Preview:
    """
    A study at the resolution of its pictures.

    Parameters
    ----------
    x : (cols,) float64
    y : (rows,) float64
        Cell centres in the model's own coordinates [m].
    away : (n_stamps, 2) float64
        Direction of shadows at each stamp, along x and y; NaN at night.
    heights : (rows, cols) float64
        z of the topmost surface above the ground [m]; in other views 1 where a surface is seen.
    nothing : (rows, cols) bool
        Where nothing receives.
    count : function of () -> (n_stamps, rows, cols) bool
        Counts ``shadows``.
    cells : PreviewCells
        The cells, which the previews of several dates may share.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    away: NDArray[np.float64]
    heights: NDArray[np.float64]
    nothing: NDArray[np.bool_]
    count: Callable[[], NDArray[np.bool_]]
    cells: "PreviewCells"

    @cached_property
    def shadows(self) -> NDArray[np.bool_]:
        """
        Shadow at each stamp, (n_stamps, rows, cols) bool; none at night.

        Counted on first access: other pictures need not wait.
        """
        return self.count()

    def find_cells(self, parts: Sequence[int]) -> NDArray[np.bool_]:
        """Find the cells in which some parts are topmost, or in front, (rows, cols) bool."""
        return cast("NDArray[np.bool_]", self.cells.tile.find_cells(parts))

    def find_canopies(self) -> NDArray[np.bool_]:
        """Find cells with canopies over a plan, or in front of a view's surfaces."""
        return cast("NDArray[np.bool_]", self.cells.tile.find_canopies())

    def has_terrain(self, bounds: NDArray[np.float64]) -> bool:
        """
        Return whether the model has its own ground: it covers its plan, partly at low height.

        A single house covers its plan too, but is high everywhere.

        Parameters
        ----------
        bounds : (2, 3) float64
            Of the model, in its coordinates [m].

        Returns
        -------
        has_terrain : bool
        """
        cols = (self.x >= bounds[0, 0]) & (self.x <= bounds[1, 0])
        rows = (self.y >= bounds[0, 1]) & (self.y <= bounds[1, 1])
        inside = self.heights[np.ix_(rows, cols)]
        if not inside.size or (inside > 0).mean() <= COVERED:
            return False
        return bool(np.quantile(inside, 0.1) < LOW * inside.max())


def make_preview(
    study: Study,
    longest: int = LONGEST,
    steps: Stamps | None = None,
    *,
    finer: int = 1,
    like: Preview | None = None,
) -> Preview:
    """
    Prepare the shadows at each stamp of a study's day.

    Parameters
    ----------
    study : Study
    longest : int
        Most cells along a side.
    steps : Stamps, optional
        Clock times of a day; the study's first day by default.
    finer : int
        Number of cells a side into which each is cut.
    like : Preview, optional
        Of another date of the study; its cells are taken if they are the same.

    Returns
    -------
    preview : Preview
    """
    has_days = bool(study.period.days)
    stamps = (steps or study.steps).stamps if has_days else study.period.instants
    most = math.isqrt(MOST // max(len(stamps), 1))
    own = study.grid.coarser(min(longest, most))
    grid = own.finer(finer) if finer > 1 else own
    cells = like.cells if like and like.cells.grid == grid else None
    cells = cells or PreviewCells(grid, study.model.make_tile(grid))
    tile = cells.tile
    path = study.sun
    if has_days:
        path = find_sun(study.site, stamps, refraction=study.refraction)

    def count() -> NDArray[np.bool_]:
        dark = cells.counter.masks(path.direction[path.is_up]).view(np.bool_)
        dark[study.period.meets_land(path.direction[path.is_up])] = True
        nothing = tile.nothing
        if nothing.any():
            dark &= ~nothing
        if path.is_up.all():
            return dark
        shadows = np.zeros((len(path.altitude), grid.rows, grid.cols), np.bool_)
        shadows[path.is_up] = dark
        return shadows

    # From local coordinates to the model's, by the study's own shift.
    shift_x, shift_y = study.x[0] - study.grid.x0, study.y[0] - study.grid.y0
    return Preview(
        grid.x + shift_x, grid.y + shift_y,
        np.where(path.is_up[:, None], -path.direction @ tile.axes.T, np.nan),
        tile.relief, tile.nothing, count, cells,
    )  # fmt: skip


SMOOTH = 1_200_000
"""Most cells of a preview that is recounted: as many as a plan has by default."""


def refine_preview(
    study: Study,
    preview: Preview,
    longest: int = LONGEST,
    steps: Stamps | None = None,
    *,
    like: Preview | None = None,
) -> Preview:
    """
    Count shadows in cells as fine as a picture's pixels where the study's are larger.

    Outlines of long shadows would be the staircases of large cells. Takes at most as much work as
    the study, or what is free; canopies and views of some parts need rays, which take more.
    Parameters and result as of ``make_preview``, which made ``preview``.
    """
    rows, cols = preview.heights.shape
    stamps = len((steps or study.steps).stamps)
    times = min(longest // max(rows, cols), math.isqrt(SMOOTH // (rows * cols)))
    takes_rays = "canopy_transmissivity" in study.facts or getattr(study.model, "shown", None)
    if times <= 1 or rows < len(study.y) or takes_rays:
        return preview
    if find_work(study, preview.cells.grid.finer(times), stamps) > find_most_work(study):
        return preview
    return make_preview(study, longest, steps, finer=times, like=like)
