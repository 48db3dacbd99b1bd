"""Receivers that lie in rows and columns."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.kind import Receivers, Variables
from umbra.scene.grid import Grid

__all__ = ["Raster"]


@dataclass(eq=False, kw_only=True)
class Raster(Receivers):
    """
    Receivers that are the cells of a plan or the pixels of a view.

    Parameters
    ----------
    x : (cols,) float64
    y : (rows,) float64
        Cell centres in the model's own coordinates, ascending [m]; for elevations along the
        view and z; for camera pictures pixels, upward.
    grid : Grid
        In the frame of ``casting``'s tiles.
    ground : float
        z of the ground [m].
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    grid: Grid
    ground: float

    @property
    def heights(self) -> NDArray[np.float64]:
        """
        Surface heights, (rows, cols) float64.

        z of the topmost surface or the ground, in the model's own coordinates [m]; NaN where
        nothing receives.
        """
        raise NotImplementedError

    def coordinates(self) -> Variables:
        """Return the centres of columns and rows."""
        rows, cols = self.dims
        return {cols: ((cols,), self.x), rows: ((rows,), self.y)}
