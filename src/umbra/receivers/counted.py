"""Receivers that count in a study's figures, and their weights."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["NEAR", "Counted", "find_near"]

NEAR = 20.0
"""Farthest that ground counts in a plan's figures from a building, whatever the frame [m]."""
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
        return f"{self.whole:,.0f} {self.unit}"

    @property
    def whole(self) -> float:
        """Total weight."""
        return float(self.weight[self.which].sum())

    def add_up(self, test: NDArray[np.bool_]) -> float:
        """Return the weight of the receivers that pass a test."""
        return float(self.weight[self.which & test].sum())

    def average(self, values: NDArray) -> float:
        """Return the weighted mean."""
        return float(np.average(values[self.which], weights=self.weight[self.which]))


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
    from scipy.ndimage import distance_transform_edt  # noqa: PLC0415  (0.1 s)

    if not is_built.any():
        return np.ones(is_built.shape, np.bool_)
    (rows, cols), (dx, dy) = is_built.shape, cell
    reach = math.ceil(most / dy)
    near = np.zeros((rows, cols), np.bool_)
    step = max(_CELLS // cols, reach, 1)
    for first in range(0, rows, step):  # distances take 16 bytes a cell
        low, high = max(first - reach, 0), min(first + step + reach, rows)
        own = is_built[low:high]
        if own.any():
            away = distance_transform_edt(~own, sampling=(dy, dx))
            near[first : first + step] = away[first - low :][:step] <= most
    return near
