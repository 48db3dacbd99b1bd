"""Where a study's raster lies: extent, cell size, and whether it fits in memory."""

import math
import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.scene.grid import Grid

__all__ = ["LONGEST_SHADOW", "lay_out"]

LONGEST_SHADOW = 4.0
"""The default extent follows shadows up to this many times the model's height."""
_LONG_SIDE = 1024  # cells of the default raster
_BYTES = 32  # held for each cell: heights, hours, and their copies on the way to the file
_WORK = 1.5e9  # for counting a tile and drawing [byte]


def lay_out(
    bounds: NDArray[np.float64],
    suns: NDArray[np.float64],
    ground: float,
    *,
    extent: Sequence[float] | None = None,
    cell: float | None = None,
    size: tuple[int, int] | None = None,
    masks: int = 0,
) -> tuple[Grid, NDArray[np.float64], NDArray[np.float64]]:
    """
    Choose the cells of a plan.

    Parameters
    ----------
    bounds : (2, 3) float64
        Of the model, in its own coordinates [m].
    suns : (n, 3) float64
        Directions toward the sun that the default extent shall hold the shadows of.
    ground : float
        z of the ground [m].
    extent : (4,) float, optional
        xmin, ymin, xmax, ymax [m].
    cell : float, optional
        Side of a cell [m].
    size : (int, int), optional
        Columns and rows, instead of ``cell``.
    masks : int
        Instants that are kept one by one.

    Returns
    -------
    grid : Grid
        In the model's own coordinates.
    x : (cols,) float64
    y : (rows,) float64
        Cell centres [m], ascending.

    Raises
    ------
    InputError
        If the options contradict each other, or the raster does not fit in memory.
    """
    if cell is not None and size is not None:
        msg = "give either a cell size or a raster size, not both"
        raise InputError(msg)
    if cell is not None and not 0 < cell < math.inf:
        msg = f"a cell must be larger than 0 m; got {cell:g}"
        raise InputError(msg, cell=cell)
    if size is not None and min(size) < 1:
        msg = f"a raster needs at least 1x1 cells; got {size[0]}x{size[1]}"
        raise InputError(msg, size=size)
    if extent is None:
        low, high = _reach(bounds, suns, ground)
    else:
        low, high = np.array(extent[:2], np.float64), np.array(extent[2:], np.float64)
        if not (np.isfinite(low).all() and np.isfinite(high).all() and (high > low).all()):
            msg = (
                "the extent must be XMIN,YMIN,XMAX,YMAX with XMIN < XMAX and YMIN < YMAX; "
                f"got {','.join(f'{v:g}' for v in extent)}"
            )
            raise InputError(msg, extent=tuple(extent))
    if size is None:
        side = cell or _round_up(float((high - low).max()) / _LONG_SIDE)
        if extent is None:
            low = np.floor(low / side) * side
        # A whole number of cells, but for the rounding of decimal fractions.
        cols, rows = (max(1, math.ceil(n - 1e-6)) for n in (high - low) / side)
        dx = dy = side
    else:
        cols, rows = size
        dx, dy = (high - low) / (cols, rows)
    _check_memory(cols, rows, masks, float(max(dx, dy)))
    grid = Grid(float(low[0] + dx / 2), float(low[1] + dy / 2), float(dx), float(dy), cols, rows)
    return grid, grid.x, grid.y


def _reach(
    bounds: NDArray[np.float64], suns: NDArray[np.float64], ground: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give the corners of the model and its shadows, the longest ones cut short."""
    tall = max(float(bounds[1, 2]) - ground, 0.0)
    flat = np.hypot(suns[:, 0], suns[:, 1])
    length = tall * np.minimum(flat / np.maximum(suns[:, 2], 1e-9), LONGEST_SHADOW)
    away = -suns[:, :2] / np.maximum(flat, 1e-12)[:, None] * length[:, None]
    away = np.concatenate([np.zeros((1, 2)), away])
    low, high = bounds[0, :2] + away.min(0), bounds[1, :2] + away.max(0)
    margin = 0.02 * float(max(high - low)) + 1e-3
    return low - margin, high + margin


def _round_up(value: float) -> float:
    """Give the next 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(
        float(f"{step * power:.6g}") for step in (1, 2, 5, 10) if step * power >= value * 0.999
    )


def _check_memory(cols: int, rows: int, masks: int, side: float) -> None:
    cells = cols * rows
    needed = cells * (_BYTES + masks) + _WORK
    held = _memory()
    if needed <= held:
        return
    fits = side * math.sqrt((needed - _WORK) / max(held - _WORK, 0.1 * held))
    advice = f"a cell of {_round_up(fits):g} m would fit"
    if masks:
        advice += ", or leave out the masks"
    msg = (
        f"a raster of {cols}x{rows} cells needs {needed / 1e9:.1f} GB "
        f"and this machine has {held / 1e9:.1f} GB; {advice}"
    )
    raise InputError(msg, cells=cells, bytes=needed)


def _memory() -> float:
    """Give the machine's memory [byte]; 8 GB where it does not tell."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 8e9
