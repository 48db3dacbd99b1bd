"""Instants of a study, thinned and coarsened to fit a web page, packed to bits."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights, Period
from umbra.scene.grid import Grid
from umbra.study import Study
from umbra.study.engine import count_each_tile, run_by_tiles
from umbra.study.loop import Accumulator, TileRun

__all__ = [
    "FEW_DATES",
    "LONGEST",
    "LONGEST_VIEW",
    "MOST_BYTES",
    "MOST_INSTANTS",
    "Instants",
    "Timeline",
    "make_point_timeline",
    "make_timeline",
    "thin",
]

FEW_DATES = 24
"""Most dates that are all shown, if need be at one instant an hour."""
_COARSE, _COARSEST = 0.25, 1.0  # longest gap between instants of many dates, of few [h]


def thin(period: Period, most: int) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[int, int]]:
    """
    Choose steps so that those with the sun up fit a page.

    Instants of a date are dropped first, down to one in 15 minutes (one an hour for few
    dates); then whole dates, evenly; then more instants.

    Parameters
    ----------
    period : Period
    most : int
        Limit of steps with the sun up; at night only a step's time is kept.

    Returns
    -------
    which : (n,) int64
        The chosen steps.
    last : (n,) int64
        Last step that each one represents.
    strides : (int, int)
        Of dates and of a date's steps.
    """
    firsts = np.cumsum([0, *(len(steps.hours) for steps in period.steps)])
    is_up = period.sun.is_up
    lit = [int(is_up[a:b].sum()) for a, b in pairwise(firsts)]

    def fits(days: int, steps: int) -> bool:
        return sum(-(-count // steps) for count in lit[::days]) <= most

    gap = _COARSEST if len(lit) <= FEW_DATES else _COARSE
    coarsest = max(1, int(gap / float(np.median(period.hours)) + 1e-9))
    every = range(1, len(lit) + 1)
    days = next((n for n in every if fits(n, coarsest)), len(lit))
    steps = next((n for n in range(1, coarsest) if fits(days, n)), coarsest)
    while not fits(days, steps) and steps < len(period.hours):
        steps += 1
    pairs = list(pairwise(firsts))[::days]
    which = [np.arange(first, end, steps) for first, end in pairs]
    last = [np.append(starts[1:] - 1, end - 1) for (_, end), starts in zip(pairs, which)]
    return np.concatenate(which), np.concatenate(last), (days, steps)


LONGEST = 800
"""Cells along the longer side: the width of a page."""
LONGEST_VIEW = 1600
"""Cells along the longer side of an elevation or a camera's picture, as on its sheets."""
MOST_BYTES = 16_000_000
"""Most bytes of all masks at one bit a cell, uncompressed; cells grow to fit."""
MOST_INSTANTS = 3000
"""Most instants with the sun up; ``thin`` chooses among more."""
_FEWEST = 24  # least number of instants, for any number of points
_SMALLEST = 120  # least cells along the longer side, for any number of instants


@dataclass(frozen=True, eq=False)
class Instants:
    """
    Receivers in shadow at the midpoint of each chosen step.

    Parameters
    ----------
    which : (n,) int64
        The chosen steps of the study.
    last : (n,) int64
        Last step that each one represents: itself, or a later one of its day.
    strides : (int, int)
        Of days and of a day's steps; (1, 1) if all are chosen.
    bits : (n, (receivers + 7) // 8) uint8
        One bit per receiver, the first in the highest bit; 1 in shadow, 0 at night.
    behind : (n, (receivers + 7) // 8) uint8, optional
        1 for receivers behind canopies alone; None without canopies.
    share : (n,) float64, optional
        Share of light that canopies transmit; 1 means no canopy.
    """

    which: NDArray[np.int64]
    last: NDArray[np.int64]
    strides: tuple[int, int]
    bits: NDArray[np.uint8]
    behind: NDArray[np.uint8] | None = field(default=None, kw_only=True)
    share: NDArray[np.float64] | None = field(default=None, kw_only=True)

    def is_summed(self, study: Study) -> bool:
        """Return whether the chosen steps add up to the study's hours on these receivers."""
        period, count = study.period, study.shadow_hours.size
        total = np.zeros(count)
        lengths = (period.ends[self.last] - period.starts[self.which]) / 3.6e9
        for k in np.flatnonzero(period.sun.is_up[self.which]):
            total += lengths[k] * np.unpackbits(self.bits[k], count=count)
            if self.behind is not None and self.share is not None:
                weakened = np.unpackbits(self.behind[k], count=count)
                total -= lengths[k] * self.share[k] * weakened
        known = np.isfinite(study.shadow_hours.ravel())
        return bool(np.allclose(total[known], study.shadow_hours.ravel()[known], atol=1e-3))


@dataclass(frozen=True, eq=False)
class Timeline(Instants):
    """
    Instants of a raster.

    Parameters
    ----------
    which, last, strides, bits, behind, share
        As in ``Instants``.
    x : (cols,) float64
    y : (rows,) float64
        Cell centres in the model's own coordinates, ascending [m].
    surface : (rows, cols) float64
        z of the topmost surface above the ground [m]; in views other than plans 0 where a
        surface is seen. NaN where nothing receives.
    is_study : bool
        Whether cells are the study's own, with equal hours.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    surface: NDArray[np.float64]
    is_study: bool

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.y), len(self.x)

    def masks(self, first: int, last: int) -> NDArray[np.bool_]:
        """Unpack the masks of some of the instants, (last - first, rows, cols) bool."""
        rows, cols = self.shape
        flat = np.unpackbits(self.bits[first:last], axis=1, count=rows * cols)
        return flat.reshape(-1, rows, cols).view(np.bool_)


def make_timeline(study: Study, longest: int | None = None) -> Timeline:
    """
    Count the steps' midpoints at a page's resolution.

    The study's cells are kept if few enough; else larger ones are counted, each exact at
    its centre.

    Parameters
    ----------
    study : Study
    longest : int, optional
        Most cells along a side; by default ``LONGEST``, or ``LONGEST_VIEW`` for views.

    Returns
    -------
    timeline : Timeline
    """
    which, last, strides = thin(study.period, MOST_INSTANTS)
    if longest is None:
        longest = LONGEST if study.is_plan else LONGEST_VIEW
    share = _find_share(study, which)
    shown = np.flatnonzero(study.sun.is_up[which])
    grid = _choose_grid(study.grid, len(shown) * (1 if share is None else 2), longest)
    tile = study.model.make_tile(grid)
    packer = _InstantPacker(len(which), grid.rows * grid.cols, share, ~tile.nothing)
    lights = Lights.of(study.sun.direction[which[shown]], step=shown)
    count_each_tile(
        [(..., lambda: tile)], lights, [packer], run_by_tiles(study.model.canopy, study.period)
    )
    shift_x, shift_y = study.x[0] - study.grid.x0, study.y[0] - study.grid.y0
    return Timeline(
        which, last, strides, packer.bits, grid.x + shift_x, grid.y + shift_y,
        tile.drawn_heights, grid == study.grid and strides == (1, 1),
        behind=packer.behind, share=share,
    )  # fmt: skip


def make_point_timeline(study: Study) -> Instants:
    """
    Return the steps' midpoints at single points, thinned to fit a page.

    The study's masks are used if kept; else these steps are counted again.
    """
    count = len(study.shadow_hours)
    sets = 1 if study.model.canopy is None else 2
    fit = 8 * MOST_BYTES / max(sets * count, 1)
    which, last, strides = thin(study.period, int(max(min(MOST_INSTANTS, fit), _FEWEST)))
    share = _find_share(study, which)
    packer = _InstantPacker(len(which), count, share)
    shown = np.flatnonzero(study.sun.is_up[which])
    if study.masks is not None:
        canopies: Any = study.more["under_canopy"][1] if share is not None else None
        for k in shown:
            solid = study.masks[int(which[k])][None]
            masks = solid if canopies is None else solid | canopies[int(which[k])]
            packer.keep(shown[shown == k], [masks, solid])
    else:
        lights = Lights.of(study.sun.direction[which[shown]], step=shown)
        tiles = study.laid.make_ray_tiles()
        count_each_tile(tiles, lights, [packer], run_by_tiles(study.model.canopy, study.period))
    return Instants(which, last, strides, packer.bits, behind=packer.behind, share=share)


class _InstantPacker(Accumulator):
    """
    Accumulator that packs the bits of ``Instants``.

    Parameters
    ----------
    instants, count : int
        Number of instants and of receivers.
    share : (n,) float64, optional
        Share of light that canopies transmit.
    is_there : (...) bool, optional
        Receivers that exist; all by default.
    """

    def __init__(
        self, instants: int, count: int, share: NDArray[np.float64] | None,
        is_there: NDArray[np.bool_] | None = None,
    ) -> None:  # fmt: skip
        self.bits = np.zeros((instants, (count + 7) // 8), np.uint8)
        self.share, self.behind = share, None if share is None else np.zeros_like(self.bits)
        self._is_there, self._first = is_there, 0

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin a run of receivers, which starts at a whole byte."""
        first = run.where.start if isinstance(run.where, slice) else 0
        self._first = first // 8

    def add(self, lights: Lights, span: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """Pack some instants' shadows."""
        self.keep(lights.step[span], masks)

    def keep(self, steps: NDArray[np.signedinteger], masks: Sequence[NDArray[np.uint8]]) -> None:
        """Pack some instants' shadows, and the shadows of canopies alone."""
        if self._is_there is not None:
            masks = [mask & self._is_there for mask in masks]
        flat = [mask.reshape(len(steps), -1) for mask in masks]
        shadow = flat[0]
        width = slice(self._first, self._first + (shadow.shape[1] + 7) // 8)
        if self.share is not None and self.behind is not None:
            shadow = np.where(self.share[steps, None] < 1, flat[0], flat[1])
            self.behind[steps, width] = np.packbits(shadow & ~flat[1], axis=1)
        self.bits[steps, width] = np.packbits(shadow, axis=1)


def _find_share(study: Study, which: NDArray[np.int64]) -> NDArray[np.float64] | None:
    """Return the share of light that canopies transmit at some steps; None without canopies."""
    canopy, period = study.model.canopy, study.period
    return None if canopy is None else canopy.find_shares(period.days)[period.day_of_step[which]]


def _choose_grid(grid: Grid, instants: int, longest: int) -> Grid:
    """Coarsen the study's cells until every instant fits."""
    most = 8 * MOST_BYTES // max(instants, 1)
    long_side = max(grid.rows, grid.cols)
    fits = int(long_side * math.sqrt(min(1.0, most / (grid.rows * grid.cols))))
    return grid.coarser(max(min(longest, fits), min(_SMALLEST, longest)))
