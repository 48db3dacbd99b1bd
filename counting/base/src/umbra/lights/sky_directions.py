"""
Directions of the sky, each of which stands for an equal or a stated solid angle.

By default Vogel's spiral on the sphere: the sine of the altitude rises in even steps and the
azimuth turns by the golden angle, so that each of n directions stands for 2 pi / n of the upper
half (Vogel 1979, "A better way to construct the sunflower head"). Names are those of the patches
that other tools use: Tregenza's 145 patches in bands of 12 degrees of altitude (Tregenza 1987), and
Reinhart's, which cut each by 2 or 4 in both ways (577 and 2,305 directions; Bourgeois, Reinhart
and Ward 2008).
"""

import math

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value

__all__ = ["MOST", "NAMES", "find_directions", "spread_directions"]

MOST = 1_000_000
"""Most directions: beyond them what is left is rounding of other kinds."""
_GOLDEN = math.pi * (3 - math.sqrt(5))
_BANDS = (30, 30, 24, 24, 18, 12, 6)
"""Patches in each of Tregenza's bands of altitude, from the horizon up."""
_BAND = math.radians(12)
NAMES = {"tregenza": 1, "reinhart2": 2, "reinhart4": 4}
"""Named sets of patches, and into how many each of Tregenza's is cut, each way."""


def find_directions(given: int | str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Find the directions that an option names, and the solid angle of each.

    Parameters
    ----------
    given : int or str
        Number of directions of a spiral; or a name of ``NAMES``.

    Returns
    -------
    directions : (n, 3) float64
        Unit vectors toward the upper half of the sky; x east, y north, z up.
    solid_angles : (n,) float64
        Of the patch that each stands for [sr]; they add up to 2 pi.

    Raises
    ------
    InputError
        If there is no such set, or the number is not between 1 and ``MOST``.
    """
    text = str(given).strip().lower()
    if text in NAMES:
        return _cut_patches(NAMES[text])
    if isinstance(given, bool) or not text.isdigit() or not 1 <= int(text) <= MOST:
        msg = (
            f"sky_directions= is a number from 1 to {MOST:,}, or one of {', '.join(NAMES)}; got "
            f"{show_value(given)}"
        )
        raise InputError(msg, option="sky_directions")
    count = int(text)
    return spread_directions(count), np.full(count, 2 * math.pi / count)


def spread_directions(count: int) -> NDArray[np.float64]:
    """Spread directions evenly over the upper half of the sphere, (count, 3) float64."""
    number = np.arange(count)
    rise = (number + 0.5) / count
    level, turn = np.sqrt(1 - rise * rise), _GOLDEN * number
    return np.stack([level * np.sin(turn), level * np.cos(turn), rise], axis=1)


def _cut_patches(parts: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cut each of Tregenza's patches into parts x parts, the zenith's patch left whole."""
    altitude, azimuth, angle = [], [], []
    step = _BAND / parts
    for row in range(len(_BANDS) * parts):
        count = _BANDS[row // parts] * parts
        low, high = row * step, (row + 1) * step
        # Of the mean height, so that an open level plane gets the whole of its sky.
        altitude.append(np.full(count, math.asin((math.sin(low) + math.sin(high)) / 2)))
        azimuth.append((np.arange(count) + 0.5) * 2 * math.pi / count)
        angle.append(np.full(count, (math.sin(high) - math.sin(low)) * 2 * math.pi / count))
    altitude.append(np.full(1, math.pi / 2))
    azimuth.append(np.zeros(1))
    angle.append(np.full(1, 2 * math.pi * (1 - math.sin(len(_BANDS) * _BAND))))
    up, turn = np.concatenate(altitude), np.concatenate(azimuth)
    directions = np.stack([np.cos(up) * np.sin(turn), np.cos(up) * np.cos(turn), np.sin(up)], 1)
    return directions, np.concatenate(angle)
