"""
Which boxes can cast a shadow onto a box of receivers.

A caster's shadow lies where its box is swept away from the sun. The reach follows from the heights
of both boxes and the sun's direction, and is never capped.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["MARGIN", "find_reaching"]

MARGIN = 0.01
"""Distance by which boxes are enlarged, far above rounding [m]."""


def find_reaching(
    boxes: NDArray[np.float64], target: NDArray[np.float64], suns: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """
    Find the boxes of casters whose shadows can meet a box of receivers.

    Parameters
    ----------
    boxes : (n, 2, 3) float64
        Lowest and highest corners [m].
    target : (2, 3) float64
        Box of the receivers, in the same frame [m].
    suns : (k, 3) float64
        Unit directions toward the sun, above the horizon.

    Returns
    -------
    reaches : (n,) bool
    """
    slopes = np.ascontiguousarray(suns[:, :2] / suns[:, 2:])
    reaches = np.zeros(len(boxes), np.bool_)
    if len(slopes):
        bounds = np.stack([slopes.min(0), slopes.max(0)])
        _find(np.ascontiguousarray(boxes), target, slopes, bounds, reaches)
    return reaches


@njit(cache=True, nogil=True)
def _find(boxes, target, slopes, bounds, reaches):
    for i in range(boxes.shape[0]):
        box = boxes[i]
        rise = box[1, 2] - target[0, 2] + MARGIN  # of the highest caster over the lowest receiver
        if rise < 0.0:
            continue
        least = max(box[0, 2] - target[1, 2] - MARGIN, 0.0)
        # Steps from receivers to casters, by axis.
        x0, x1 = box[0, 0] - target[1, 0] - MARGIN, box[1, 0] - target[0, 0] + MARGIN
        y0, y1 = box[0, 1] - target[1, 1] - MARGIN, box[1, 1] - target[0, 1] + MARGIN
        if not _meets(least, rise, bounds[0, 0], bounds[1, 0], x0, x1):
            continue
        if not _meets(least, rise, bounds[0, 1], bounds[1, 1], y0, y1):
            continue
        for s in range(slopes.shape[0]):
            low, high = _cut(slopes[s, 0], x0, x1, least, rise)
            low, high = _cut(slopes[s, 1], y0, y1, low, high)
            if low <= high:
                reaches[i] = True
                break


@njit(cache=True, nogil=True, inline="always")
def _meets(least, rise, slope0, slope1, a, b):
    """Return whether steps of some slopes, up to a rise, meet an interval along an axis."""
    low = min(slope0 * least, slope0 * rise)
    high = max(slope1 * least, slope1 * rise)
    return low <= b and high >= a


@njit(cache=True, nogil=True, inline="always")
def _cut(slope, a, b, low, high):
    """Cut an interval of heights to those at which a sun's step lies in [a, b] along an axis."""
    if slope == 0.0:
        return (low, high) if a <= 0.0 <= b else (1.0, 0.0)
    first, last = a / slope, b / slope
    if first > last:
        first, last = last, first
    # Quotients may round either way; the boxes' margin covers it.
    return max(low, first), min(high, last)
