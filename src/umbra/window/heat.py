"""The scale of counts: colours that are further apart the more volumes hold a place."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["PALETTE", "find_colors", "find_ticks", "find_top"]

PALETTE = (
    np.array(
        [
            [238, 236, 228], [253, 221, 150], [252, 178, 93], [244, 128, 77], [222, 79, 86],
            [178, 50, 103], [128, 37, 109], [79, 27, 98], [40, 16, 66],
        ],
        np.float64,
    )
    / 255
)  # fmt: skip
"""sRGB from a count of 0 to the highest, (9, 3)."""

_FEW = 8


def find_top(highest: int) -> int:
    """Give the count that takes the last colour: whole steps of the scale where there are few."""
    return max(int(highest), 4)


def find_colors(counts: NDArray, top: int) -> NDArray[np.float64]:
    """
    Give the colours of counts.

    Parameters
    ----------
    counts : (...) int
    top : int
        The count that takes the last colour.

    Returns
    -------
    rgb : (..., 3) float64
        sRGB, 0 to 1.
    """
    place = np.clip(np.asarray(counts) / top, 0.0, 1.0) * (len(PALETTE) - 1)
    low = np.minimum(place.astype(int), len(PALETTE) - 2)
    part = (place - low)[..., None]
    return (1 - part) * PALETTE[low] + part * PALETTE[low + 1]


def find_ticks(top: int) -> list[int]:
    """Give the counts to write at the scale, 0 and ``top`` among them."""
    if top <= _FEW:
        return list(range(top + 1))
    return sorted({round(top * k / 4) for k in range(5)})
