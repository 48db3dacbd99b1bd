"""Plots: cells in which heights are sought, and the ground under them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.ground.choice import Ground
from umbra.ground.level import TERRAIN
from umbra.receivers.zenith import find_surface
from umbra.scene import Scene
from umbra.scene.grid import Grid
from umbra.scene.mesh import ADDED_GROUND

__all__ = ["Plot", "lay_cells"]

_MOST = 250_000
"""Most cells of a plot: their mesh has some 20 triangles each."""
_LEAST = 0.01  # side of a cell [m]
_APART = 100.0  # distance from the model from which a plot is taken for wrong [m]


@dataclass(frozen=True, eq=False)
class Plot:
    """
    A plot, cut into square cells along x and y.

    Parameters
    ----------
    x0, y0 : float
        Lower left corner of the raster, local frame [m].
    cell : float
        Side of a cell [m].
    index : (rows, cols) int32
        Number of each cell whose centre lies in the plot; -1 elsewhere. Row 0 is the south.
    ground : (n,) float64
        Height of the ground at each cell's centre, local frame [m].
    foot : (n,) float64
        Lowest ground under each cell, on which its box stands, local frame [m].
    outline : shapely geometry
        In the model's own coordinates [m].
    """

    x0: float
    y0: float
    cell: float
    index: NDArray[np.int32]
    ground: NDArray[np.float64]
    foot: NDArray[np.float64]
    outline: Any

    @property
    def area(self) -> float:
        """Area of a cell [m2]."""
        return self.cell * self.cell

    @cached_property
    def places(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Row and column of each cell."""
        rows, cols = np.nonzero(self.index >= 0)
        return rows, cols

    def spread(self, values: NDArray, empty: float = np.nan) -> NDArray[np.float64]:
        """Lay values of the cells out on the raster (rows, cols)."""
        raster = np.full(self.index.shape, empty)
        raster[self.places] = values
        return raster

    def find_covered(self, points: NDArray[np.float64]) -> NDArray[np.intp]:
        """Return the indices of points (n, 3), local frame, that lie in a cell."""
        col = np.floor((points[:, 0] - self.x0) / self.cell).astype(np.int64)
        row = np.floor((points[:, 1] - self.y0) / self.cell).astype(np.int64)
        rows, cols = self.index.shape
        inside = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
        row, col = np.clip(row, 0, rows - 1), np.clip(col, 0, cols - 1)
        return np.flatnonzero(inside & (self.index[row, col] >= 0))


def lay_cells(outlines: Sequence[Any], ground: Ground, cell: float, threads: int) -> Plot:
    """
    Cut a plot into cells.

    Parameters
    ----------
    outlines : sequence of shapely polygons
        In the model's own coordinates [m]; their union is the plot.
    ground : Ground
        Of the model.
    cell : float
        Side of a cell [m].
    threads : int

    Raises
    ------
    InputError
        If the plot has no area, is smaller than a cell, too large, or lies off the model.
    """
    import shapely  # noqa: PLC0415  (an extra)

    scene = ground.scene
    whole = shapely.union_all(list(outlines)) if len(outlines) else shapely.Polygon()
    if not whole.area > 0:
        msg = "the plot has no area; give a polygon"
        raise InputError(msg, option="plot")
    bounds = np.array(shapely.bounds(whole)).reshape(2, 2)
    _check_near(bounds, scene)
    if not (np.isfinite(cell) and cell >= _LEAST):
        msg = f"cell= must be a length from {_LEAST:g} m; got {cell:g}"
        raise InputError(msg, option="cell")
    if cell > np.ptp(bounds, axis=0).max():
        msg = f"a cell of {cell:g} m is larger than the plot; give a smaller cell="
        raise InputError(msg, option="cell")
    size = np.ceil(np.ptp(bounds, axis=0) / cell - 1e-9)
    count = float(whole.area / cell**2)
    if count > _MOST or size.prod() > 16 * _MOST:
        least = max(cell * np.sqrt(count / _MOST), cell * np.sqrt(size.prod() / (16 * _MOST)))
        msg = (
            f"the plot of {whole.area:,.0f} m² would be {count:,.0f} cells of {cell:g} m, of at "
            f"most {_MOST:,}; give a larger cell=, from {least:.2g} m"
        )
        raise InputError(msg, option="cell", cells=count)
    cols, rows = np.maximum(size.astype(np.int64), 1)
    # The raster stands in the middle of the plot's bounds.
    x0, y0 = bounds.mean(0) - np.array([cols, rows]) * cell / 2
    x, y = x0 + (np.arange(cols) + 0.5) * cell, y0 + (np.arange(rows) + 0.5) * cell
    inside = shapely.contains_xy(whole, *np.meshgrid(x, y))
    if not inside.any():
        msg = (
            f"no centre of a cell of {cell:g} m lies in the plot of {whole.area:.3g} m²; give a "
            "smaller cell="
        )
        raise InputError(msg, option="cell")
    index = np.full((rows, cols), -1, np.int32)
    index[inside] = np.arange(inside.sum())
    x0, y0 = x0 - scene.origin[0], y0 - scene.origin[1]
    middle, foot = _find_ground(ground, float(x0), float(y0), cell, inside, threads)
    return Plot(float(x0), float(y0), float(cell), index, middle, foot, whole)


def _check_near(bounds: NDArray[np.float64], scene: Scene) -> None:
    low, high = scene.model_bounds()[:, :2]
    gap = float(np.hypot(*np.maximum(np.maximum(low - bounds[1], bounds[0] - high), 0.0)))
    if gap > _APART:
        ends = ", ".join(f"{a:,.6g} to {b:,.6g}" for a, b in zip(low, high, strict=True))
        extent = ", ".join(f"{a:,.6g} to {b:,.6g}" for a, b in bounds.T)
        msg = (
            f"the plot (x, y {extent}) lies {gap:,.0f} m outside the model ({ends}); give it in "
            "the model's coordinates, or in longitude and latitude where the model has a CRS"
        )
        raise InputError(msg, option="plot", gap=gap)


def _find_ground(
    ground: Ground, x0: float, y0: float, cell: float, inside: NDArray[np.bool_], threads: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ground's height at the middle of each cell, and its lowest at five places."""
    scene = ground.scene
    level = ground.level - scene.origin[2]
    count = int(inside.sum())
    if ground.is_plane:
        return np.full(count, level), np.full(count, level)
    kinds = ADDED_GROUND if ground.is_added else TERRAIN
    parts = [k for k, part in enumerate(scene.parts) if part.kind in kinds]
    soup = scene.triangles(parts)
    rows, cols = inside.shape
    below = float(soup.vertices[:, 2].min()) - 1.0
    samples = []
    for dx, dy in ((0.5, 0.5), (0.01, 0.01), (0.99, 0.01), (0.01, 0.99), (0.99, 0.99)):
        grid = Grid(x0 + dx * cell, y0 + dy * cell, cell, cell, cols, rows)
        seen = find_surface(soup, grid, below, threads, has_end=True)
        samples.append(np.where(seen.face >= 0, seen.heights, np.nan)[inside])
    heights = np.array(samples)
    bare = np.isnan(heights).all(0)
    # Beyond the terrain.
    heights[:, bare] = level if bare.all() else np.nanmedian(heights[0, ~bare])
    foot = np.nanmin(heights, 0)
    return np.where(np.isnan(heights[0]), foot, heights[0]), foot
