"""
The share of the sky that surfaces see, by shadow counts of a few dozen directions.

The sky's light is a mean over directions; each direction is a light whose shadows are counted
as those of any other, so corners and courtyards darken as they do under an overcast sky.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.scene import Camera, directional_light

__all__ = ["find_openness", "find_sky_directions", "follow_openness", "smooth_openness"]

_TURN = np.pi * (3.0 - 5.0**0.5)  # the golden angle
_LOWEST = 0.1  # sine of the lowest altitude: shadows of lower ones are long and faint
_WIDEST = 0.01  # widest step of smoothing: share of the picture's longer side
_UNLIKE = 0.1  # by which smoothed values differ, a few directions: corners stay dark
_BEND = 0.1  # by which a surface may bend between two pixels: sine of the angle
_AROUND = [(down, right) for down in (-1, 0, 1) for right in (-1, 0, 1) if down or right]


def find_sky_directions(count: int) -> NDArray[np.float64]:
    """
    Return directions toward the sky (n, 3), spread evenly over it but for its lowest tenth.

    Vogel's spiral (1979) with even steps of height, so that each is as large a part of the sky.
    """
    number = np.arange(count) + 0.5
    rise = 1.0 - (1.0 - _LOWEST) * number / count
    radius = np.sqrt(1.0 - rise**2)
    angle = number * _TURN
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), rise], 1)


def find_openness(
    counter: Any, view: DepthBuffer, frame: VisibleSurface, camera: Camera, count: int
) -> NDArray[np.float32]:
    """
    Find the share of the sky's light that reaches each visible point, (rows, cols) in [0, 1].

    Of the light that would reach it in the open; 1 where nothing is seen, and on surfaces that
    look down. Each direction leaves an edge on the faces, which are smoothed away along them.
    """
    rows, cols = frame.part.shape
    normal = np.nan_to_num(frame.normal.astype(np.float32))
    reached, whole = np.zeros((2, rows, cols), np.float32)
    directions = find_sky_directions(count)
    lights = [directional_light(toward) for toward in directions]
    for toward, shadows in zip(directions, counter.count_all(view, camera, lights), strict=True):
        cosine = np.maximum(normal @ toward.astype(np.float32), 0.0)
        whole += cosine
        reached += np.where(shadows == 0, cosine, np.float32(0))
    share = np.where(whole > 0, reached / np.maximum(whole, np.float32(1e-9)), np.float32(1))
    return smooth_openness(share, frame.position, normal)


def smooth_openness(
    values: NDArray[np.float32], position: NDArray[np.float64], normal: NDArray[np.float32]
) -> NDArray[np.float32]:
    """
    Smooth values (rows, cols) along surfaces, never across an edge.

    The à-trous wavelets of Dammertz et al. (2010), rows and columns in turn, with binomial
    weights: steps of 1, 2, 4 and so on pixels, up to a share of the picture.
    """
    centred = (position - np.nan_to_num(position).mean((0, 1))).astype(np.float32)
    step = 1
    while step <= max(values.shape) * _WIDEST:
        for axis in (0, 1):
            values = _smooth_along(axis, step, values, centred, normal)
        step *= 2
    return values


def _smooth_along(
    axis: int,
    step: int,
    values: NDArray[np.float32],
    position: NDArray[np.float32],
    normal: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Average values with those ``step`` and twice ``step`` pixels away on the same surface."""
    total, weights = values * np.float32(6), np.full_like(values, 6)
    for apart, weight in ((step, np.float32(4)), (2 * step, np.float32(1))):
        first = np.s_[:-apart] if axis == 0 else np.s_[:, :-apart]
        second = np.s_[apart:] if axis == 0 else np.s_[:, apart:]
        way = position[second] - position[first]
        least = _BEND * np.sqrt(np.einsum("ijk,ijk->ij", way, way))
        is_same = np.einsum("ijk,ijk->ij", normal[first], normal[second]) > 1 - _BEND
        for side in (first, second):
            is_same &= np.abs(np.einsum("ijk,ijk->ij", normal[side], way)) <= least
        is_same &= np.abs(values[second] - values[first]) <= _UNLIKE
        shared = weight * is_same
        for here, there in ((first, second), (second, first)):
            total[here] += shared * values[there]
            weights[here] += shared
    return total / weights


def follow_openness(
    openness: NDArray[np.float32], view: DepthBuffer, other: DepthBuffer
) -> NDArray[np.float32]:
    """
    Find the openness of a view whose pixels are offset by up to half a pixel.

    A pixel that sees another face there takes the value of a neighbour that sees this face.
    """
    followed = openness.copy()
    row, col = np.nonzero((other.face != view.face) & (other.face != NOTHING))
    last = openness.shape[0] - 1, openness.shape[1] - 1
    for down, right in _AROUND:
        near = np.clip(row + down, 0, last[0]), np.clip(col + right, 0, last[1])
        is_same = view.face[near] == other.face[row, col]
        followed[row[is_same], col[is_same]] = openness[near][is_same]
        row, col = row[~is_same], col[~is_same]
    return followed
