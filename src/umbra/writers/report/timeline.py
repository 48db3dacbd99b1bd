"""Every instant of a study at the resolution of a web page, packed to bits."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.scene.grid import Grid
from umbra.study import Study

__all__ = ["LONGEST", "LONGEST_VIEW", "MOST_BYTES", "MOST_INSTANTS", "Timeline", "make_timeline"]

LONGEST = 800
"""Cells along the longer side: a plan as wide as a page shows no more."""
LONGEST_VIEW = 1600
"""The same of an elevation or a camera's picture, whose sheets have as many."""
MOST_BYTES = 16_000_000
"""Of all masks at a bit a cell, before they are compressed; else cells grow."""
MOST_INSTANTS = 2000
"""Of a longer study every n-th day is shown; of a longer day every n-th step."""
_SMALLEST = 120  # cells along the longer side that are kept whatever the instants


@dataclass(frozen=True, eq=False)
class Timeline:
    """
    Which cells are in shadow at the middle of each step.

    Parameters
    ----------
    x : (cols,) float64
    y : (rows,) float64
        Cell centres in the model's own coordinates, ascending [m].
    which : (n,) int64
        The steps of the study that are shown.
    last : (n,) int64
        The last step that each one stands for: itself, or a later one of its day.
    strides : (int, int)
        Of days and of a day's steps: (1, 1) where all are shown.
    bits : (n, (rows * cols + 7) // 8) uint8
        A bit for each cell, the first in the highest bit; 1 in shadow, 0 at night.
    surface : (rows, cols) float64
        z of the topmost surface above the ground [m]; in a view that is no plan 0 where
        anything is seen, NaN elsewhere.
    shade : (rows, cols) float32, optional
        In a view: how bright its surfaces are drawn, in [0, 1].
    is_study : bool
        Whether the cells are those of the study itself, so that hours are the same.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    which: NDArray[np.int64]
    last: NDArray[np.int64]
    strides: tuple[int, int]
    bits: NDArray[np.uint8]
    surface: NDArray[np.float64]
    shade: NDArray[np.float32] | None
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
    which, last, strides = _choose_steps([len(steps.hours) for steps in study.period.steps])
    if longest is None:
        longest = LONGEST if study.is_plan else LONGEST_VIEW
    grid = _choose_grid(study.grid, len(which), longest)
    tile = study.model.make_tile(grid)
    sweep = tile.make_counter()
    bits = np.zeros((len(which), (grid.rows * grid.cols + 7) // 8), np.uint8)
    shown = np.flatnonzero(study.sun.is_up[which])
    for first in range(0, len(shown), 8):
        some = shown[first : first + 8]
        masks = sweep.masks(study.sun.direction[which[some]])
        bits[some] = np.packbits(masks.reshape(len(some), -1), axis=1)
    shift_x, shift_y = study.x[0] - study.grid.x0, study.y[0] - study.grid.y0
    return Timeline(
        grid.x + shift_x, grid.y + shift_y, which, last, strides, bits,
        *_find_looks(tile), grid == study.grid and strides == (1, 1),
    )  # fmt: skip


def _choose_steps(
    lengths: list[int],
) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[int, int]]:
    """Choose days, whole if they can be, until no more steps are left than are shown."""
    days = max(1, -(-sum(lengths) // MOST_INSTANTS)) if len(lengths) > 1 else 1
    kept = list(range(0, len(lengths), days))
    steps = max(1, -(-sum(lengths[day] for day in kept) // MOST_INSTANTS))
    firsts = np.cumsum([0, *lengths])
    which = [np.arange(firsts[day], firsts[day + 1], steps) for day in kept]
    last = [np.append(some[1:] - 1, firsts[day + 1] - 1) for day, some in zip(kept, which)]
    return np.concatenate(which), np.concatenate(last), (days, steps)


def _find_looks(tile: Any) -> tuple[NDArray[np.float64], NDArray[np.float32] | None]:
    """Give heights on a plan; in a view where anything is seen, and how it is shaded."""
    if not hasattr(tile, "is_seen"):
        return tile.relief, None
    surface = np.where(tile.is_seen, 0.0, np.nan)
    # Lit from above and a little from the left, as if the viewer held the lamp.
    facing = np.abs(np.nan_to_num(tile.frame.normal[::-1]) @ np.array([0.35, -0.25, 0.9]))
    return surface, (0.70 + 0.24 * facing).astype(np.float32)


def _choose_grid(grid: Grid, instants: int, longest: int) -> Grid:
    """Coarsen the study's cells until every instant fits."""
    most = 8 * MOST_BYTES // max(instants, 1)
    long_side = max(grid.rows, grid.cols)
    fits = int(long_side * math.sqrt(min(1.0, most / (grid.rows * grid.cols))))
    return grid.coarser(max(min(longest, fits), min(_SMALLEST, longest)))
