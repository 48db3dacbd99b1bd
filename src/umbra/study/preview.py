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

from umbra.lights import Lights, Period
from umbra.receivers.tile import Counter
from umbra.scene.grid import Grid
from umbra.study.loop import add_up, make_tile_run
from umbra.study.result import Study
from umbra.sun import find_sun
from umbra.sun.clock import ROUND, Stamps, Steps, find_round_stamps, find_stamps

__all__ = [
    "FinerHours",
    "Moment",
    "Preview",
    "choose_stamps",
    "count_finer",
    "find_moments",
    "make_preview",
    "refine_preview",
]

LONGEST = 1600
"""Cells along the longer side: more than a picture's map has pixels."""
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
            found = find_round_stamps(steps, minutes)
            if len(found.stamps) <= most:
                return found if len(found.stamps) else steps
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
        found = cells.counter.masks(path.direction[path.is_up]).view(np.bool_)
        found[study.period.meets_land(path.direction[path.is_up])] = True
        nothing = tile.nothing
        if nothing.any():
            found &= ~nothing
        if path.is_up.all():
            return found
        shadows = np.zeros((len(path.altitude), grid.rows, grid.cols), np.bool_)
        shadows[path.is_up] = found
        return shadows

    # From local coordinates to the model's, by the study's own shift.
    shift_x, shift_y = study.x[0] - study.grid.x0, study.y[0] - study.grid.y0
    return Preview(
        grid.x + shift_x, grid.y + shift_y,
        np.where(path.is_up[:, None], -path.direction @ tile.axes.T, np.nan),
        tile.relief, tile.nothing, count, cells,
    )  # fmt: skip


FACE = 75
"""Work per sun and casting face, relative to that per cell. Measured."""
PIXEL = 20
"""Work per sun and pixel of a view, relative to that per cell of a plan. Measured."""
FREE = 1_000_000_000
"""Work that is always allowed: up to half a second of one core, less than drawing takes."""
LEAST = 60_000_000
"""Least length of a cut step [us]."""


@dataclass(frozen=True, eq=False)
class FinerHours:
    """
    Hours of one date in finer steps, from which pictures and lines are drawn.

    Parameters
    ----------
    shadow_hours : (rows, cols) float32
        NaN where nothing receives.
    up_hours : float
        Time with the sun up, by these steps [h].
    seconds : float
        Length of a step [s].
    tile : Tile
        Its cells.
    lights : Lights
        The sun at the middle of each step, with its length as weight.
    """

    shadow_hours: NDArray[np.float32]
    up_hours: float
    seconds: float
    tile: Any
    lights: Lights

    def find_lost(self, others: Sequence[int]) -> NDArray[np.float32]:
        """
        Count the hours of sun that fall away with all casters beside some parts.

        Parameters
        ----------
        others : sequence of int
            Parts that cast before.

        Returns
        -------
        lost : (rows, cols) float32
            NaN where nothing receives.
        """
        before = self.tile.with_casters(others)
        run = make_tile_run(before, None)
        found = add_up(run.counters[0], before.shape, self.lights)[0]
        return cast("NDArray[np.float32]", self.shadow_hours - found)


def count_finer(
    study: Study,
    pictures: int = 1,
    longest: int | None = LONGEST,
    *,
    like: FinerHours | None = None,
) -> FinerHours | None:
    """
    Count one date of a plan or view in finer steps, with at most as much work as the study took.

    Small studies may take more, ``FREE``, still less than drawing. Work is the number of suns
    times cells and faces, not time, so that a study has the same picture on every machine.

    Parameters
    ----------
    study : Study
        Of one date.
    pictures : int
        Number of dates that share ``FREE``.
    longest : int, optional
        Most cells along a side; the study's own cells if None.
    like : FinerHours, optional
        Of another date of the study, whose tile is taken.

    Returns
    -------
    finer : FinerHours or None
        None if the work does not allow finer steps, and for nights, several dates together,
        views of some parts, canopies, the sun's disc, and studies that solve instants exactly.
    """
    facts, period = study.facts, study.period
    if (
        not (study.kind.is_raster and study.kind.counts_cells)
        or getattr(study.model, "shown", None)  # takes rays
        or len(period.days) > 1
        or not period.sun.is_up.any()
        or not facts.keys().isdisjoint(_OTHERWISE)
    ):
        return None
    grid = study.grid.coarser(longest) if longest else study.grid
    suns = int(period.sun.is_up.sum())
    most = max(_find_work(study, study.grid, suns), FREE / pictures)
    parts = _choose_parts(period, int(most / _find_work(study, grid, suns)))
    if parts == 1:
        return None
    tile = study.model.make_tile(grid) if like is None else like.tile
    hours, starts = period.hours, period.starts
    part = (period.ends - starts) / parts
    middles = starts[:, None] + part[:, None] * (np.arange(parts) + 0.5)
    path = find_sun(
        study.site, middles.ravel().astype(np.int64).view("datetime64[us]"),
        refraction=study.refraction,
    )  # fmt: skip
    length = np.repeat(hours / parts, parts)
    lights = Lights.of(path.direction[path.is_up], length[path.is_up])  # the last step is shorter
    run = make_tile_run(tile, None).behind_land(period)
    total = add_up(run.counters[0], tile.shape, lights)[0]
    total[tile.nothing] = np.nan
    up_hours, seconds = float(length[path.is_up].sum()), 3600 * float(length[0])
    return FinerHours(total, up_hours, seconds, tile, lights)


_OTHERWISE = {"exact_tolerance_seconds", "canopy_transmissivity", "sun_disc_deg"}
"""Attributes of studies whose hours are no sums of steps of a point sun through solids."""


SMOOTH = 1_200_000
"""Most cells of a preview that is counted anew: as many as a plan has by default."""


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
    the study, or ``FREE``; rays, which canopies and views of some parts need, take more than that.
    Parameters and result as of ``make_preview``, which made ``preview``.
    """
    rows, cols = preview.heights.shape
    stamps = len((steps or study.steps).stamps)
    times = min(longest // max(rows, cols), math.isqrt(SMOOTH // (rows * cols)))
    takes_rays = "canopy_transmissivity" in study.facts or getattr(study.model, "shown", None)
    if times <= 1 or rows < len(study.y) or takes_rays:
        return preview
    own = _find_work(study, study.grid, int(study.period.sun.is_up.sum()))
    if _find_work(study, preview.cells.grid.finer(times), stamps) > max(own, FREE):
        return preview
    return make_preview(study, longest, steps, finer=times, like=like)


def _find_work(study: Study, grid: Grid, suns: int) -> int:
    """Return the work of counting some suns on a raster."""
    cells = grid.rows * grid.cols + FACE * len(study.model.caster.faces)
    return suns * cells * (1 if study.is_plan else PIXEL)


def _choose_parts(period: Period, most: int) -> int:
    """Cut a step into at most N parts of whole minutes, or of whole seconds."""
    step = round(float(period.hours[0]) * 3.6e9)
    parts = range(min(most, step // LEAST), 1, -1)
    for unit in (60_000_000, 1_000_000):
        found = next((n for n in parts if step % (n * unit) == 0), 1)
        if found > 1:
            return found
    return 1
