"""Every instant of a study at the resolution of a web page, packed to bits."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.scene.grid import Grid
from umbra.study import Study

__all__ = ["LONGEST", "MOST_BYTES", "MOST_INSTANTS", "Timeline", "make_timeline"]

LONGEST = 800
"""Cells along the longer side: a plan as wide as a page shows no more."""
MOST_BYTES = 16_000_000
"""Of all masks at a bit a cell, before they are compressed; else cells grow."""
MOST_INSTANTS = 2000
"""Of a longer study every n-th instant is shown."""
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
    stride : int
        1 where that is all of them.
    bits : (n, (rows * cols + 7) // 8) uint8
        A bit for each cell, the first in the highest bit; 1 in shadow, 0 at night.
    surface : (rows, cols) float64
        z of the topmost surface above the ground [m].
    is_study : bool
        Whether the cells are those of the study itself, so that hours are the same.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    which: NDArray[np.int64]
    stride: int
    bits: NDArray[np.uint8]
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


def make_timeline(study: Study, longest: int = LONGEST) -> Timeline:
    """
    Count every step's middle at a page's resolution.

    The study's own cells are kept where they are few enough; else larger ones are
    counted anew, so that each is exact at its own centre.

    Parameters
    ----------
    study : Study
    longest : int
        Most cells along a side.

    Returns
    -------
    timeline : Timeline
    """
    n = len(study.sun.is_up)
    stride = max(1, -(-n // MOST_INSTANTS))
    # Anew on each day, so that a step that stands for others stands for those of its day.
    lengths = [len(steps.hours) for steps in study.period.steps]
    firsts = np.cumsum([0, *lengths[:-1]])
    which = np.concatenate([k + np.arange(0, m, stride) for k, m in zip(firsts, lengths)])
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
        grid.x + shift_x, grid.y + shift_y, which, stride, bits,
        tile.relief, grid == study.grid and stride == 1,
    )  # fmt: skip


def _choose_grid(grid: Grid, instants: int, longest: int) -> Grid:
    """Coarsen the study's cells until every instant fits."""
    most = 8 * MOST_BYTES // max(instants, 1)
    long_side = max(grid.rows, grid.cols)
    fits = int(long_side * math.sqrt(min(1.0, most / (grid.rows * grid.cols))))
    return grid.coarser(max(min(longest, fits), min(_SMALLEST, longest)))
