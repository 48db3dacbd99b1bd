"""
Which boxes can cast a shadow onto a box of receivers.

A caster's shadow lies where its box is swept away from the light. The reach follows from both boxes
and the light, and is never capped.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["MARGIN", "find_reaching"]

MARGIN = 0.01
"""Distance by which boxes are enlarged, far above rounding [m]."""
_LEVEL = 1e-6  # z of unit vectors below which steps to casters do not follow from heights


def find_reaching(
    boxes: NDArray[np.float64], target: NDArray[np.float64], lights: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """
    Find the boxes of casters whose shadows can meet a box of receivers.

    Parameters
    ----------
    boxes : (n, 2, 3) float64
        Lowest and highest corners [m].
    target : (2, 3) float64
        Box of the receivers, in the same frame [m].
    lights : (k, 3) or (k, 4) float64
        Unit directions toward lights; or homogeneous lights: w = 0 is a direction, w = 1 a lamp's
        position in the same frame [m].

    Returns
    -------
    reaches : (n,) bool
    """
    reaches = np.zeros(len(boxes), np.bool_)
    boxes = np.ascontiguousarray(boxes)
    is_sun = lights[:, 2] > _LEVEL
    if lights.shape[1] > 3:
        is_sun &= lights[:, 3] == 0
    suns, others = lights[is_sun], lights[~is_sun]
    slopes = np.ascontiguousarray(suns[:, :2] / suns[:, 2:3])
    if len(slopes):
        bounds = np.stack([slopes.min(0), slopes.max(0)])
        _find(boxes, target, slopes, bounds, reaches)
    if len(others):
        whole = np.zeros((len(others), 4))
        whole[:, : others.shape[1]] = others
        _find_any(boxes, target, whole, reaches)
    return reaches


@njit(cache=True, nogil=True)
def _find_any(boxes, target, lights, reaches):
    """
    Add the boxes that rays from a box of receivers to any lights can meet.

    A ray is at p + s d from a receiver p, with d = the direction, s >= 0, or d = lamp - p, s <= 1.
    """
    for i in range(boxes.shape[0]):
        for k in range(lights.shape[0]):
            if reaches[i]:
                break
            w = lights[k, 3]
            low, high = 0.0, 1.0 if w > 0.0 else np.inf
            for axis in range(3):
                # Least and greatest p + s d are both linear in s.
                least, most = target[0, axis] - MARGIN, target[1, axis] + MARGIN
                down, up = lights[k, axis] - w * least, lights[k, axis] - w * most
                low, high = _cut_below(least - boxes[i, 1, axis], down, low, high)
                low, high = _cut_below(boxes[i, 0, axis] - most, -up, low, high)
            reaches[i] = low <= high


@njit(cache=True, nogil=True, inline="always")
def _cut_below(start, slope, low, high):
    """Cut an interval of s to where start + s slope <= 0."""
    if slope > 0.0:
        return low, min(high, -start / slope)
    if slope < 0.0:
        return max(low, -start / slope), high
    return (low, high) if start <= 0.0 else (1.0, 0.0)


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
