"""Hours of one date in finer steps than the study's, from which pictures and lines are drawn."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from umbra.devices import DEVICES
from umbra.lights import Lights, Period
from umbra.scene.grid import Grid
from umbra.study.light_sums import add_up
from umbra.study.loop import make_tile_run
from umbra.study.result import Study
from umbra.sun import find_sun

__all__ = [
    "FACE", "FREE", "LONGEST", "FinerHours", "FinerSteps", "can_count_casters", "choose_parts",
    "count_finer", "cut_steps", "find_most_work", "find_work",
]  # fmt: skip

LONGEST = 1600
"""Cells along the longer side: more than a picture's map has pixels."""
FACE = 75
"""Work per sun and casting face, relative to that per cell. Measured."""
PIXEL = 20
"""Work per sun and pixel of a view, relative to that per cell of a plan. Measured."""
FREE = 1_000_000_000
"""Work that is always allowed: up to half a second of one core, less than drawing takes."""
CASTERS = 4 * FREE
"""Work that is allowed to tell casters apart, who are only counted one by one if asked for."""
LEAST = 60_000_000
"""Least length of a cut step [us]."""


class FinerSteps(Protocol):
    """Steps from which hours are drawn, finer than those that results keep."""

    @property
    def seconds(self) -> float:
        """Length of a step [s]."""

    @property
    def kept(self) -> str:
        """File that keeps the hours of the study's own steps."""


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
    period : Period
        Of the study.
    """

    shadow_hours: NDArray[np.float32]
    up_hours: float
    seconds: float
    tile: Any
    lights: Lights
    period: Period
    kept: ClassVar[str] = "study.nc"

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
        return cast("NDArray[np.float32]", self.shadow_hours - self._count_hidden(others))

    def find_cast(self, parts: Sequence[int]) -> NDArray[np.float32]:
        """
        Count the hours in the shadow of some parts, as if they stood alone.

        As ``cast_hours`` of a study, without those of surfaces that face away from the sun.

        Parameters
        ----------
        parts : sequence of int

        Returns
        -------
        hours : (rows, cols) float32
            NaN where nothing receives.
        """
        hours = np.maximum(self._count_hidden(parts) - self._attached, np.float32(0))
        hours[self.tile.nothing] = np.nan
        return hours

    @cached_property
    def _attached(self) -> NDArray[np.float32]:
        """Hours that are dark without any caster: of surfaces turned away, and behind the land."""
        return self._count_hidden(())

    def _count_hidden(self, casters: Sequence[int]) -> NDArray[np.float32]:
        """Count the hours without sun if only some parts cast."""
        tile = self.tile.with_casters(list(casters))
        run = make_tile_run(tile, None).behind_land(self.period)
        return add_up(run.counters[0], tile.shape, self.lights)[0]


def count_finer(
    study: Study,
    share: float = 1.0,
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
    share : float
        Of ``FREE``; more than 1 for what is only drawn if asked for.
    longest : int, optional
        Most cells along a side; the study's own cells if None.
    like : FinerHours, optional
        Of another date of the study, whose tile is taken.

    Returns
    -------
    finer : FinerHours or None
        None if the work does not allow finer steps, and for nights, several dates together,
        views of some parts, devices of packages, canopies, the sun's disc, and studies that solve
        instants exactly.
    """
    facts, period = study.facts, study.period
    if (
        not (study.kind.is_raster and study.kind.counts_cells)
        or getattr(study.model, "shown", None)  # takes rays
        or len(period.days) > 1
        or not period.sun.is_up.any()
        or not facts.keys().isdisjoint(_OTHERWISE)
        or facts["device"] not in DEVICES  # whose work is not known
    ):
        return None
    grid = study.grid.coarser(longest) if longest else study.grid
    work = find_work(study, grid, int(period.sun.is_up.sum()))
    parts = choose_parts(period, int(find_most_work(study, share) / work))
    if parts == 1:
        return None
    tile = study.model.make_tile(grid) if like is None else like.tile
    lights = cut_steps(period, parts)
    run = make_tile_run(tile, None).behind_land(period)
    total = add_up(run.counters[0], tile.shape, lights)[0]
    total[tile.nothing] = np.nan
    up_hours, seconds = float(lights.weights.sum()), 3600 * float(period.hours[0]) / parts
    return FinerHours(total, up_hours, seconds, tile, lights, period)


def cut_steps(period: Period, parts: int, min_altitude: float = 0.0) -> Lights:
    """Return the suns at the middle of each part of a period's steps, with its length in hours."""
    part = (period.ends - period.starts) / parts
    middles = period.starts[:, None] + part[:, None] * (np.arange(parts) + 0.5)
    path = find_sun(
        period.site, middles.ravel().astype(np.int64).view("datetime64[us]"),
        refraction=period.refraction,
    )  # fmt: skip
    length = np.repeat(period.hours / parts, parts)  # the last step is shorter
    is_up = path.is_up & (path.altitude >= min_altitude) if min_altitude else path.is_up
    return Lights.of(path.direction[is_up], length[is_up])


_OTHERWISE = {"exact_tolerance_seconds", "canopy_transmissivity", "sun_disc_deg"}
"""Attributes of studies whose hours are no sums of steps of a point sun through solids."""


def can_count_casters(study: Study, finer: Sequence[FinerHours], casters: int) -> bool:
    """Return whether some dates' shadows of single casters may be counted in finer steps."""
    suns = sum(len(one.lights) for one in finer)
    work = find_work(study, study.grid, suns)
    work += (casters - 1) * suns * study.grid.rows * study.grid.cols * _weigh(study)
    return work <= CASTERS


def find_most_work(study: Study, share: float = 1.0) -> float:
    """Return the work that a picture of a study may take: the study's own, or what is free."""
    own = find_work(study, study.grid, int(study.period.sun.is_up.sum()))
    return max(own, share * FREE)


def find_work(study: Study, grid: Grid, suns: int) -> int:
    """Return the work of counting some suns on a raster."""
    cells = grid.rows * grid.cols + FACE * len(study.model.caster.faces)
    return suns * cells * _weigh(study)


def _weigh(study: Study) -> int:
    """Return the work of a cell, relative to one of a plan."""
    return 1 if study.is_plan else PIXEL


def choose_parts(period: Period, most: int) -> int:
    """Cut a step into at most N parts of whole minutes, or of whole seconds."""
    step = round(float(period.hours[0]) * 3.6e9)
    parts = range(min(most, step // LEAST), 1, -1)
    for unit in (60_000_000, 1_000_000):
        count = next((n for n in parts if step % (n * unit) == 0), 1)
        if count > 1:
            return count
    return 1
