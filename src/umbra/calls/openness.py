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

__all__ = ["find_openness", "find_sky_directions", "follow_openness"]

_TURN = np.pi * (3.0 - 5.0**0.5)  # the golden angle
_LOWEST = 0.17  # sine of the lowest altitude: shadows of lower ones are long and faint
_AROUND = [(down, right) for down in (-1, 0, 1) for right in (-1, 0, 1) if down or right]


def find_sky_directions(count: int) -> NDArray[np.float64]:
    """
    Return directions toward the sky (n, 3), spread evenly by the cosine of their zenith angle.

    Each is a share of the light on a level surface: Vogel's spiral on the disc (1979), lifted to
    the hemisphere.
    """
    number = np.arange(count) + 0.5
    radius = np.minimum(np.sqrt(number / count), np.sqrt(1 - _LOWEST**2))
    angle = number * _TURN
    rise = np.sqrt(1.0 - radius**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), rise], 1)


def find_openness(
    counter: Any, view: DepthBuffer, frame: VisibleSurface, camera: Camera, count: int
) -> NDArray[np.float32]:
    """
    Find the share of the sky's light that reaches each visible point, (rows, cols) in [0, 1].

    Of the light that would reach it in the open; 1 where nothing is seen, and on surfaces that
    look down.
    """
    rows, cols = frame.part.shape
    normal = np.nan_to_num(frame.normal.astype(np.float32))
    reached, whole = np.zeros((2, rows, cols), np.float32)
    for toward in find_sky_directions(count):
        # Directions are denser by the cosine on a level surface: others weigh by their own.
        cosine = np.maximum(normal @ (toward / toward[2]).astype(np.float32), 0.0)
        shadows = counter.count(view, camera, directional_light(toward), "auto")
        whole += cosine
        reached += np.where(shadows == 0, cosine, np.float32(0))
    return np.where(whole > 0, reached / np.maximum(whole, np.float32(1e-9)), np.float32(1))


def follow_openness(
    openness: NDArray[np.float32], view: DepthBuffer, other: DepthBuffer
) -> NDArray[np.float32]:
    """
    Find the openness of a view whose pixels are offset by up to half a pixel.

    A pixel that sees another face there takes the value of a neighbour that sees this face.
    """
    found = openness.copy()
    row, col = np.nonzero((other.face != view.face) & (other.face != NOTHING))
    last = openness.shape[0] - 1, openness.shape[1] - 1
    for down, right in _AROUND:
        near = np.clip(row + down, 0, last[0]), np.clip(col + right, 0, last[1])
        is_same = view.face[near] == other.face[row, col]
        found[row[is_same], col[is_same]] = openness[near][is_same]
        row, col = row[~is_same], col[~is_same]
    return found
