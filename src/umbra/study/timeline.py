"""Instants of a study, as many and as fine as a web page holds, packed to bits."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.scene.grid import Grid
from umbra.study import Study
from umbra.study.lights import Lights, Period
from umbra.study.loop import Accumulator, TileRun, look, pass_lights

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
"""Most dates of which all are shown, if need be at one instant an hour."""
_COARSE, _COARSEST = 0.25, 1.0  # between instants that are shown: of many dates, of few [h]


def thin(period: Period, most: int) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[int, int]]:
    """
    Choose steps until no more of those with the sun up are left than a page holds.

    Instants of a date are given up first, down to one in 15 minutes (of few dates one an
    hour); then whole dates, evenly; at last more instants.

    Parameters
    ----------
    period : Period
    most : int
        With the sun up; by night nothing is kept of a step but its time.

    Returns
    -------
    which : (n,) int64
        The steps that are shown.
    last : (n,) int64
        The last step that each one stands for.
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
    last = [np.append(some[1:] - 1, end - 1) for (_, end), some in zip(pairs, which)]
    return np.concatenate(which), np.concatenate(last), (days, steps)


LONGEST = 800
"""Cells along the longer side: a plan as wide as a page shows no more."""
LONGEST_VIEW = 1600
"""The same of an elevation or a camera's picture, whose sheets have as many."""
MOST_BYTES = 16_000_000
"""Of all masks at a bit a cell, before they are compressed; else cells grow."""
MOST_INSTANTS = 3000
"""With the sun up; of more ``thin`` chooses some."""
_FEWEST = 24  # instants that are kept of however many points
_SMALLEST = 120  # cells along the longer side that are kept however many the instants


@dataclass(frozen=True, eq=False)
class Instants:
    """
    Which receivers are in shadow at the middle of each step that is shown.

    Parameters
    ----------
    which : (n,) int64
        The steps of the study that are shown.
    last : (n,) int64
        The last step that each one stands for: itself, or a later one of its day.
    strides : (int, int)
        Of days and of a day's steps: (1, 1) where all are shown.
    bits : (n, (receivers + 7) // 8) uint8
        A bit for each receiver, the first in the highest bit; 1 in shadow, 0 at night.
    behind : (n, (receivers + 7) // 8) uint8, optional
        1 where a receiver is behind canopies alone; None without canopies.
    share : (n,) float64, optional
        Of the light that canopies let through; where it is 1 they are not there.
    """

    which: NDArray[np.int64]
    last: NDArray[np.int64]
    strides: tuple[int, int]
    bits: NDArray[np.uint8]
    behind: NDArray[np.uint8] | None = field(default=None, kw_only=True)
    share: NDArray[np.float64] | None = field(default=None, kw_only=True)

    def is_summed(self, study: Study) -> bool:
        """Tell whether the steps shown add up to the study's own hours of these receivers."""
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
    The instants of a raster's cells.

    Parameters
    ----------
    which, last, strides, bits, behind, share
        As in ``Instants``.
    x : (cols,) float64
    y : (rows,) float64
        Cell centres in the model's own coordinates, ascending [m].
    surface : (rows, cols) float64
        z of the topmost surface above the ground [m]; in a view that is no plan 0 where
        anything is seen. NaN where nothing receives.
    is_study : bool
        Whether the cells are those of the study itself, so that hours are the same.
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
    Count every step's middle at a page's resolution.

    The study's own cells are kept where they are few enough; else larger ones are
    counted anew, so that each is exact at its own centre.

    Parameters
    ----------
    study : Study
    longest : int, optional
        Most cells along a side; ``LONGEST`` of a plan, ``LONGEST_VIEW`` of a view.

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
    kept = _InstantPacker(len(which), grid.rows * grid.cols, share, ~tile.nothing)
    lights = Lights.of(study.sun.direction[which[shown]], step=shown)
    pass_lights(look(tile, study.model.canopy), lights, [kept])
    shift_x, shift_y = study.x[0] - study.grid.x0, study.y[0] - study.grid.y0
    return Timeline(
        which, last, strides, kept.bits, grid.x + shift_x, grid.y + shift_y,
        tile.drawn_heights, grid == study.grid and strides == (1, 1),
        behind=kept.behind, share=share,
    )  # fmt: skip


def make_point_timeline(study: Study) -> Instants:
    """
    Return every step's middle at single points, or of so many steps as fit a page.

    Masks that the study kept are used; else these steps are counted again.
    """
    count = len(study.shadow_hours)
    sets = 1 if study.model.canopy is None else 2
    fit = 8 * MOST_BYTES / max(sets * count, 1)
    which, last, strides = thin(study.period, int(max(min(MOST_INSTANTS, fit), _FEWEST)))
    share = _find_share(study, which)
    kept = _InstantPacker(len(which), count, share)
    shown = np.flatnonzero(study.sun.is_up[which])
    if study.masks is not None:
        canopies: Any = study.more["under_canopy"][1] if share is not None else None
        for k in shown:
            solid = study.masks[int(which[k])][None]
            masks = solid if canopies is None else solid | canopies[int(which[k])]
            kept.keep(shown[shown == k], [masks, solid])
    else:
        lights = Lights.of(study.sun.direction[which[shown]], step=shown)
        for where, tile in study.laid.look_again():
            pass_lights(look(tile, study.model.canopy, where), lights, [kept])
    return Instants(which, last, strides, kept.bits, behind=kept.behind, share=share)


class _InstantPacker(Accumulator):
    """
    Fills in the bits of ``Instants``.

    Parameters
    ----------
    instants, count : int
        Number of instants and of receivers.
    share : (n,) float64, optional
        Of the light that canopies let through.
    is_there : (...) bool, optional
        Which receivers there are.
    """

    def __init__(
        self, instants: int, count: int, share: NDArray[np.float64] | None,
        is_there: NDArray[np.bool_] | None = None,
    ) -> None:  # fmt: skip
        self.bits = np.zeros((instants, (count + 7) // 8), np.uint8)
        self.share, self.behind = share, None if share is None else np.zeros_like(self.bits)
        self._is_there, self._first = is_there, 0

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin with a run of receivers, which starts at a whole byte."""
        first = run.where.start if isinstance(run.where, slice) else 0
        self._first = first // 8

    def add(self, lights: Lights, some: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """Pack some instants' shadows."""
        self.keep(lights.step[some], masks)

    def keep(self, some: NDArray[np.signedinteger], masks: Sequence[NDArray[np.uint8]]) -> None:
        """Pack some instants' shadows, and where there are canopies what they alone cast."""
        if self._is_there is not None:
            masks = [mask & self._is_there for mask in masks]
        flat = [mask.reshape(len(some), -1) for mask in masks]
        shadow = flat[0]
        width = slice(self._first, self._first + (shadow.shape[1] + 7) // 8)
        if self.share is not None and self.behind is not None:
            shadow = np.where(self.share[some, None] < 1, flat[0], flat[1])
            self.behind[some, width] = np.packbits(shadow & ~flat[1], axis=1)
        self.bits[some, width] = np.packbits(shadow, axis=1)


def _find_share(study: Study, which: NDArray[np.int64]) -> NDArray[np.float64] | None:
    """Return the share of the light that canopies let through at some steps, if there are any."""
    canopy, period = study.model.canopy, study.period
    return None if canopy is None else canopy.find_shares(period.days)[period.day_of_step[which]]


def _choose_grid(grid: Grid, instants: int, longest: int) -> Grid:
    """Coarsen the study's cells until every instant fits."""
    most = 8 * MOST_BYTES // max(instants, 1)
    long_side = max(grid.rows, grid.cols)
    fits = int(long_side * math.sqrt(min(1.0, most / (grid.rows * grid.cols))))
    return grid.coarser(max(min(longest, fits), min(_SMALLEST, longest)))
