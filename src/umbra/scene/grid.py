"""The raster of a plan: where its cells' centres are."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Grid"]


@dataclass(frozen=True)
class Grid:
    """
    Cells of a plan, rows from south to north.

    Parameters
    ----------
    x0, y0 : float
        Centre of the first cell, in the scene's local frame [m].
    dx, dy : float
        Size of a cell [m].
    cols, rows : int
    """

    x0: float
    y0: float
    dx: float
    dy: float
    cols: int
    rows: int

    @property
    def x(self) -> NDArray[np.float64]:
        """Centres of the columns, (cols,) [m]."""
        return self.x0 + self.dx * np.arange(self.cols)

    @property
    def y(self) -> NDArray[np.float64]:
        """Centres of the rows, (rows,) [m]."""
        return self.y0 + self.dy * np.arange(self.rows)

    def to_cells(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Give x and y of points (..., 3) in cells, where centres are whole numbers; z stays."""
        placed = np.array(points, np.float64)
        placed[..., 0] = (placed[..., 0] - self.x0) / self.dx
        placed[..., 1] = (placed[..., 1] - self.y0) / self.dy
        return placed
