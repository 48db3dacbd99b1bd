"""
The lattice of a city: one raster for the whole run, cut into tiles, windows and blocks.

Coordinates in cells are taken from the corner of a block of the lattice. Blocks do not depend on
the tiles, and no window crosses one, so a cell's bits do not depend on the tile that holds it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from umbra.scene.grid import Grid

__all__ = ["MOST_SIDE", "CityTile", "Lattice", "find_side"]

MOST_SIDE = 2048
"""Most cells along a tile, which is a chunk of the arrays in the store."""


@dataclass(frozen=True)
class CityTile:
    """
    Rows and columns of a lattice, or a run of objects or of named areas, that one task counts.

    Parameters
    ----------
    number : int
        In order of rows, then columns.
    rows, cols : (int, int)
        First, and end.
    place : (int, int)
        Number of its row and column of tiles.
    areas : tuple of int
        Numbers of the areas.
    """

    number: int
    rows: tuple[int, int]
    cols: tuple[int, int]
    place: tuple[int, int] = (0, 0)
    areas: tuple[int, ...] = ()

    @property
    def cells(self) -> int:
        """Number of cells."""
        return (self.rows[1] - self.rows[0]) * (self.cols[1] - self.cols[0])


@dataclass(frozen=True)
class Lattice:
    """
    Raster of a whole run.

    Parameters
    ----------
    grid : Grid
        In the run's local frame.
    side : int
        Cells along a tile.
    block : int
        Cells along a block.
    """

    grid: Grid
    side: int
    block: int

    def __len__(self) -> int:
        """Return the number of tiles."""
        return math.ceil(self.grid.rows / self.side) * math.ceil(self.grid.cols / self.side)

    def tiles(self) -> Iterator[CityTile]:
        """Yield the tiles, by rows from the south."""
        rows, cols = self.grid.rows, self.grid.cols
        corners = (
            (row, col) for row in range(0, rows, self.side) for col in range(0, cols, self.side)
        )
        for number, (row, col) in enumerate(corners):
            yield CityTile(
                number,
                (row, min(row + self.side, rows)),
                (col, min(col + self.side, cols)),
                (row // self.side, col // self.side),
            )

    def cut(self, tile: CityTile, most: int) -> Iterator[tuple[slice, slice]]:
        """Yield the windows of a tile, rows and columns: in one block, and at most so wide."""
        for rows in _cut(*tile.rows, self.block, most):
            for cols in _cut(*tile.cols, self.block, most):
                yield rows, cols

    def find_window(self, rows: slice, cols: slice) -> Grid:
        """Return the cells of a window, numbered from the corner of their block."""
        row, col = rows.start // self.block * self.block, cols.start // self.block * self.block
        whole = self.grid
        corner = whole.part(slice(row, whole.rows), slice(col, whole.cols))
        return corner.window(
            slice(rows.start - row, rows.stop - row), slice(cols.start - col, cols.stop - col)
        )


def _cut(first: int, end: int, block: int, most: int) -> Iterator[slice]:
    """Cut a range at multiples of the block, and in equal pieces of at most a length."""
    while first < end:
        stop = min(end, (first // block + 1) * block)
        pieces = math.ceil((stop - first) / most)
        length = math.ceil((stop - first) / pieces)
        for start in range(first, stop, length):
            yield slice(start, min(start + length, stop))
        first = stop


def find_side(length: float, cell: float) -> int:
    """Return the cells along a tile of a length [m], or of an equal part of it."""
    cells = max(1, round(length / cell))
    return math.ceil(cells / math.ceil(cells / MOST_SIDE))
