"""Receivers that count in a study's figures, and their weights."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.errors import show_count

__all__ = ["NEAR", "Counted", "choose_near", "find_near", "meets_frame", "reach_from_centres"]

NEAR = 20.0
"""Farthest that ground counts in a plan's figures from a building, whatever the frame [m]."""
_SIZES = 2.0  # of the longest side of a small model, instead
_CELLS = 4_000_000  # whose distances are found at a time
_HECTARE = 10_000.0


@dataclass(frozen=True, eq=False)
class Counted:
    """
    Receivers with meaningful hours, and their weights.

    Parameters
    ----------
    which : (...) bool
        Selection of the study's receivers.
    weight : (...) float64
        Area or number that each represents.
    unit : str
        Unit of the weights.
    what : str
        Description of them all.
    """

    which: NDArray[np.bool_]
    weight: NDArray[np.float64]
    unit: str
    what: str

    @property
    def name(self) -> str:
        """What they are, in a word or two."""
        return self.what.partition(",")[0]

    def tell_whole(self) -> str:
        """Write the total weight with its unit; a large area in hectares."""
        if self.unit == "m²" and self.whole >= _HECTARE:
            return f"{self.whole / _HECTARE:.3g} ha"
        return show_count(round(self.whole), self.unit.removesuffix("s"), self.unit)

    def tell_whole_of(self) -> str:
        """Write the total weight, and of what: ``2,656 m² of open ground``, ``2 points``."""
        return f"{self.tell_whole()}{'' if self.unit == self.name else f' of {self.name}'}"

    @property
    def whole(self) -> float:
        """Total weight."""
        return float(self.weight[self.which].sum())

    def add_up(self, test: NDArray[np.bool_]) -> float:
        """Return the weight of the receivers that pass a test."""
        return float(self.weight[self.which & test].sum())

    def with_value(self, values: NDArray) -> "Counted":
        """Return those of them whose value is a number."""
        return replace(self, which=self.which & np.isfinite(values))

    def of_weight(self, weight: float) -> "Counted":
        """Return some of them as one, by their total weight."""
        return replace(self, which=np.ones(1, np.bool_), weight=np.array([weight]))

    def average(self, values: NDArray) -> float:
        """Return the weighted mean."""
        return float(np.average(values[self.which], weights=self.weight[self.which]))


def meets_frame(cells: NDArray[np.bool_]) -> bool:
    """Return whether some cells (rows, cols) lie along the frame, which may cut others off."""
    return any(bool(side.any()) for side in (cells[0], cells[-1], cells[:, 0], cells[:, -1]))


def choose_near(built: NDArray[np.float64] | None) -> float:
    """
    Choose how far from buildings ground counts in figures: 20 m; less for a model like a chair.

    Parameters
    ----------
    built : (2, 3) float64, optional
        Bounds of all that receives and is no ground, of a whole model or city [m].

    Returns
    -------
    near : float
        Distance [m], at most twice the longest side of the bounds.
    """
    if built is None:
        return NEAR
    return min(NEAR, float(f"{_SIZES * float(np.ptp(built, axis=0).max()):.2g}"))


def reach_from_centres(near: float, cell: tuple[float, float]) -> float:
    """
    Return how far from the centres of built cells ground is near a building [m].

    A building ends, in the mean, half a cell beyond the centre of its last cell.
    """
    return near + min(cell) / 2


def find_near(
    is_built: NDArray[np.bool_], cell: tuple[float, float], most: float
) -> NDArray[np.bool_]:
    """
    Find the cells within a distance of some cells, from centre to centre.

    Parameters
    ----------
    is_built : (rows, cols) bool
    cell : (float, float)
        Width and height of a cell [m].
    most : float
        The distance [m].

    Returns
    -------
    is_near : (rows, cols) bool
        Holds those cells, too; all cells if there are none.
    """
    if not is_built.any():
        return np.ones(is_built.shape, np.bool_)
    (rows, cols), (dx, dy) = is_built.shape, cell
    # How many cells aside of a built one are near, by the number of rows to it; -1 for none.
    up = (np.arange(min(math.ceil(most / dy), rows) + 1) * dy) ** 2
    aside = (np.arange(min(math.ceil(most / dx), cols) + 1) * dx) ** 2
    reach = (np.sqrt(up[:, None] + aside) <= most).sum(1, dtype=np.int32) - np.int32(1)
    reach = np.append(reach[reach >= 0], np.int32(-1))
    height = len(reach) - 1
    near = np.zeros((rows, cols), np.bool_)
    step = max(_CELLS // cols, height, 1)
    for first in range(0, rows, step):
        low, high = max(first - height, 0), min(first + step + height, rows)
        half = reach[_count_rows(is_built[low:high], height)[first - low :][:step]]
        # Spans of near cells, from the first to the last of neighbours of one reach.
        changes = np.ones((len(half), cols + 1), np.bool_)
        changes[:, 1:-1] = half[:, 1:] != half[:, :-1]
        counts = np.zeros((len(half), cols + 1), np.int32)
        for ends, sign in ((changes[:, :-1], 1), (changes[:, 1:], -1)):
            row, col = np.nonzero(ends & (half >= 0))
            side = col - half[row, col] if sign > 0 else col + half[row, col] + 1
            at = row * (cols + 1) + np.clip(side, 0, cols)
            counts += sign * np.bincount(at, minlength=counts.size).reshape(counts.shape)
        near[first : first + step] = np.cumsum(counts[:, :-1], axis=1) > 0
    return near


def _count_rows(is_built: NDArray[np.bool_], most: int) -> NDArray[np.int32]:
    """Return the number of rows from each cell to the nearest built one of its column, at most."""
    row, far = np.arange(len(is_built), dtype=np.int32)[:, None], np.int32(1 << 30)
    below = np.maximum.accumulate(np.where(is_built, row, -far), axis=0)
    above = np.minimum.accumulate(np.where(is_built, row, far)[::-1], axis=0)[::-1]
    return np.minimum(np.minimum(row - below, above - row), most)
