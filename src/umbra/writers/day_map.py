"""One of several maps of a picture, as data: drawing it needs more."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["DayMap"]


@dataclass(frozen=True, eq=False)
class DayMap:
    """
    What one of several maps shows.

    Parameters
    ----------
    title, remark : str
        The date, and what is said of it: sunrise and sunset.
    hours : (rows, cols) float32
        Rows ascend in y; NaN where there is no value.
    hatched : (rows, cols) bool, optional
    finer : (m, n) float32, optional
        The same hours on cells of another size, for the contour lines.
    """

    title: str
    remark: str
    hours: NDArray
    hatched: NDArray[np.bool_] | None = None
    finer: NDArray | None = None
