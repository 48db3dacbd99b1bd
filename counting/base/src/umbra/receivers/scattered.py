"""Models whose objects stand far apart: where most of them are, and cells that show them."""

import math

import numpy as np
from numpy.typing import NDArray

from umbra.scene.grid import Grid

__all__ = ["find_dense", "tell_coarse", "tell_dense"]

SPARSE = 80.0
"""Sizes of the middling object from which a model is scattered; as of the live page."""
NEIGHBOURHOOD = 12.0
"""Sizes of the middling object along a square in which objects are counted."""
FEW = 8
"""Fewest objects of which some can be most."""
LEAST_CELLS = 6.0
"""Cells of a footprint below which a plan does not show its building."""


def find_dense(boxes: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """
    Find where most objects stand, of a model in whose plan they would be specks.

    Parameters
    ----------
    boxes : (n, 2, 3) float64
        Bounds of each object's plan [m].

    Returns
    -------
    box : (2, 2) float64 or None
        Lower left and upper right corner [m]; None if the whole plan shows them.
    """
    if len(boxes) < FEW:
        return None
    low, high = boxes[:, 0, :2], boxes[:, 1, :2]
    middling = float(np.median(np.hypot(*(high - low).T)))
    if not math.hypot(*(high.max(0) - low.min(0))) > SPARSE * middling > 0:
        return None
    square = np.floor((low + high) / 2 / (NEIGHBOURHOOD * middling)).astype(np.int64)
    around = square[:, None] + np.array([(0, 0), (-1, 0), (0, -1), (-1, -1)])
    corners, count = np.unique(around.reshape(-1, 2), axis=0, return_counts=True)
    best = corners[count.argmax()]
    held = ((square >= best) & (square <= best + 1)).all(1)
    return np.stack([low[held].min(0), high[held].max(0)])


def tell_dense(dense: NDArray[np.float64], boxes: NDArray[np.float64]) -> str:
    """Say that a plan begins where most of a scattered model is, and what shows the rest."""
    middle = boxes[:, :, :2].mean(1)
    held = int(((middle >= dense[0]) & (middle <= dense[1])).all(1).sum())
    wide, deep = (np.ptp(boxes[..., axis]) / 1000 for axis in (0, 1))
    return (
        f"the model's {len(boxes):,} objects stand scattered over {wide:.3g} x {deep:.3g} km; the "
        f"plan shows {held:,} of them, where they stand closest (extent= shows others)"
    )


def tell_coarse(grid: Grid, boxes: NDArray[np.float64]) -> str:
    """Say that cells are too coarse for the model's buildings; nothing if they are not."""
    if not len(boxes):
        return ""
    sides = np.sqrt(np.prod(np.ptp(boxes[..., :2], axis=1), axis=1))
    middling = float(np.median(sides))
    cells = middling**2 / (grid.dx * grid.dy)
    if middling <= 0 or cells >= LEAST_CELLS:
        return ""
    finer = middling / math.sqrt(LEAST_CELLS)
    return (
        f"cells of {grid.dx:.3g} m are coarse for buildings of about {middling:.3g} m: "
        f"{cells:.2g} cells a footprint; choose a part of the plan (extent=), or cells of "
        f"{finer:.2g} m (cell=)"
    )
