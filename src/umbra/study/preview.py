"""What a study's pictures show: the same plan, with no more cells than a picture has pixels."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.study.result import Study
from umbra.sun import find_sun
from umbra.sun.clock import Stamps

__all__ = ["Preview", "make_preview"]

LONGEST = 1600
"""Cells along the longer side: more than the map of a picture shows."""
MOST = 400_000_000
"""Cells of all stamps together: a day of very many stamps is drawn with larger cells."""
COVERED = 0.9
"""Share of its plan that a model with terrain covers at least."""
LOW = 0.25
"""Share of the model's height that a tenth of the terrain stays below."""


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
        Where the sun casts shadows at each stamp, along x and y; NaN at night.
    heights : (rows, cols) float64
        z of the topmost surface above the ground [m]; in other views 1 where anything is seen.
    count : function of () -> (n_stamps, rows, cols) bool
        Counts ``shadows``.
    find_parts : function of () -> (rows, cols) int
        Finds the part that is seen in each cell; -1 for the ground and where there is none.
    find_canopies : function of () -> (rows, cols) bool
        Tells where canopies hang over a plan, or stand before what a view shows.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    away: NDArray[np.float64]
    heights: NDArray[np.float64]
    count: Callable[[], NDArray[np.bool_]]
    find_parts: Callable[[], NDArray[np.intp]]
    find_canopies: Callable[[], NDArray[np.bool_]]

    @cached_property
    def shadows(self) -> NDArray[np.bool_]:
        """
        Where shadow falls at each stamp, (n_stamps, rows, cols) bool; none at night.

        Counted at this resolution when first asked for: other pictures need not wait.
        """
        return self.count()

    def has_terrain(self, bounds: NDArray[np.float64]) -> bool:
        """
        Tell whether the model brings its own ground: it covers its plan, low down for a part.

        A single house covers its plan as well, but stands high everywhere.

        Parameters
        ----------
        bounds : (2, 3) float64
            Of the model, in its own coordinates [m].

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


def make_preview(study: Study, longest: int = LONGEST, steps: Stamps | None = None) -> Preview:
    """
    Count where shadow falls at each stamp of a study's day.

    Parameters
    ----------
    study : Study
    longest : int
        Most cells along a side.
    steps : Stamps, optional
        The clock times of a day; those of the study's first by default.

    Returns
    -------
    preview : Preview
    """
    stamps = (steps or study.steps).stamps
    most = math.isqrt(MOST // len(stamps))
    grid = study.grid.coarser(min(longest, most))
    tile = study.model.make_tile(grid)
    path = find_sun(study.site, stamps, refraction=study.refraction)

    def count() -> NDArray[np.bool_]:
        shadows = np.zeros((len(path.altitude), grid.rows, grid.cols), np.bool_)
        up = path.direction[path.is_up]
        shadows[path.is_up] = tile.make_counter().masks(up).view(np.bool_)
        shadows &= ~tile.nothing
        return shadows

    # From local coordinates to the model's own, as the study's cells went.
    shift_x, shift_y = study.x[0] - study.grid.x0, study.y[0] - study.grid.y0
    return Preview(
        grid.x + shift_x, grid.y + shift_y,
        np.where(path.is_up[:, None], -path.direction @ tile.axes.T, np.nan),
        tile.relief, count, tile.find_parts, tile.find_canopies,
    )  # fmt: skip
