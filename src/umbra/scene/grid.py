"""Positions of receivers: the raster of a plan, and points with normals."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = ["ASIDE", "Grid", "Places"]

ASIDE = (2.0**-24, 0.618 * 2.0**-24)
"""
Offset to the east and north of its centre at which a cell of the topmost surface is judged
[cells], away from edges: in the centre itself rounding could put the face, its height and the
sides above it on different sides of an edge.
"""


@dataclass(frozen=True)
class Grid:
    """
    Cells of a plan, rows from south to north.

    A window of a raster keeps the raster's origin and numbers its cells from there: whatever is
    computed for a cell has the same bits in every window that holds it.
    """

    x0: float  # centre of the cell (0, 0), with y0, in the scene's local frame [m]
    y0: float
    dx: float  # size of a cell, with dy [m]
    dy: float
    cols: int
    rows: int
    col: int = 0  # number of the first column and row
    row: int = 0

    @property
    def x(self) -> NDArray[np.float64]:
        """Centres of the columns, (cols,) [m]."""
        return self.x0 + self.dx * np.arange(self.col, self.col + self.cols, dtype=np.float64)

    @property
    def y(self) -> NDArray[np.float64]:
        """Centres of the rows, (rows,) [m]."""
        return self.y0 + self.dy * np.arange(self.row, self.row + self.rows, dtype=np.float64)

    def window(self, rows: slice, cols: slice) -> "Grid":
        """Return some rows and columns, numbered as in this raster."""
        return replace(
            self, cols=cols.stop - cols.start, rows=rows.stop - rows.start,
            col=self.col + cols.start, row=self.row + rows.start,
        )  # fmt: skip

    def part(self, rows: slice, cols: slice) -> "Grid":
        """Return the raster of some rows and columns."""
        return Grid(
            self.x0 + self.dx * (self.col + cols.start),
            self.y0 + self.dy * (self.row + rows.start),
            self.dx,
            self.dy,
            cols.stop - cols.start,
            rows.stop - rows.start,
        )

    def tiles(self, side: int) -> Iterator[tuple[slice, slice, "Grid"]]:
        """Cut the raster into tiles of at most ``side`` cells a side: rows, columns, grid."""
        for row in range(0, self.rows, side):
            for col in range(0, self.cols, side):
                rows = slice(row, min(row + side, self.rows))
                cols = slice(col, min(col + side, self.cols))
                yield rows, cols, self.part(rows, cols)

    def coarser(self, longest: int) -> "Grid":
        """Return a raster of the same extent with larger cells, at most ``longest`` a side."""
        times = max(self.cols, self.rows) / longest
        if times <= 1:
            return self
        cols, rows = max(round(self.cols / times), 1), max(round(self.rows / times), 1)
        dx, dy = self.dx * self.cols / cols, self.dy * self.rows / rows
        return Grid(self.x0 + (dx - self.dx) / 2, self.y0 + (dy - self.dy) / 2, dx, dy, cols, rows)

    def finer(self, times: int) -> "Grid":
        """Return a raster of the same extent, each cell cut into ``times`` a side."""
        dx, dy = self.dx / times, self.dy / times
        return Grid(
            self.x0 + (dx - self.dx) / 2, self.y0 + (dy - self.dy) / 2, dx, dy,
            self.cols * times, self.rows * times,
        )  # fmt: skip

    def to_cells(
        self, points: NDArray[np.float64], aside: tuple[float, float] = (0.0, 0.0)
    ) -> NDArray[np.float64]:
        """Return x and y of points (..., 3) in cells from the judged place of (0, 0); z stays."""
        placed = np.array(points, np.float64)
        placed[..., 0] = (placed[..., 0] - self.x0) / self.dx - aside[0]
        placed[..., 1] = (placed[..., 1] - self.y0) / self.dy - aside[1]
        return placed


@dataclass(frozen=True, eq=False)
class Places:
    """Points with normals."""

    points: NDArray[np.float64]  # (n, 3) in the scene's local frame [m]
    # (n, 3) of the side that is seen; NaN where a point faces every light
    normals: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.points)

    def pick(self, which: NDArray[np.intp] | slice) -> "Places":
        """Return some of the points."""
        return Places(self.points[which], self.normals[which])

    def find_reached(
        self, low: NDArray[np.float64], high: NDArray[np.float64], suns: NDArray[np.float64]
    ) -> NDArray[np.intp]:
        """
        Find the points that the shadow of a box can reach, conservatively.

        The box lies from low to high, (3,) each; suns (n, 3) are above the horizon.
        """
        margin = 1e-6 * (1.0 + np.abs([low, high]).max())
        x, y, z = self.points.T
        climb = high[2] - z
        is_reached = climb >= -margin
        for at, k in ((x, 0), (y, 1)):
            slope = suns[:, k] / suns[:, 2]
            rise = np.maximum(climb, 0.0)
            nearest, farthest = at + min(slope.min(), 0.0) * rise, at + max(slope.max(), 0.0) * rise
            is_reached &= (farthest >= low[k] - margin) & (nearest <= high[k] + margin)
        return np.flatnonzero(is_reached)
