"""
The shadows of many stamps over one another.

Lightness says how many shadows fall on a place, hue when they do. Colours are mixed in OKLab:
of each pixel the share of the stamps whose shadow holds it, and the mean of their tints, which
fades as shares grow, since what lies in shadow all day belongs to no hour. So the deepest
overlap of a long day is a grey that can still be read, and one shadow alone has its legend's tint.
"""

from collections.abc import Iterable
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from umbra.writers.color import make_stamp_path, to_srgb
from umbra.writers.raster import resample

__all__ = ["compose_profile", "find_tints"]

PAPER = 0.99  # lightness where no shadow falls
DEPTH = 0.53  # by which it falls at most
CHROMA = 0.75  # of the tints that one shadow alone keeps


def compose_profile(
    shadows: Iterable[NDArray[np.bool_]], n: int, size: tuple[int, int]
) -> NDArray[np.float32]:
    """
    Mix the tints of n stamps where their shadows fall.

    Parameters
    ----------
    shadows : iterable of (rows, cols) bool
        One a stamp; taken one by one, so an iterator does.
    n : int
        How many there are.
    size : (rows, cols)
        Of the result.

    Returns
    -------
    image : (rows, cols, 3) float32
        sRGB; white where no shadow falls.

    Raises
    ------
    ValueError
        If ``shadows`` does not hold n masks.
    """
    path = make_stamp_path(n).astype(np.float32)
    stamps = iter(shadows)
    total: NDArray[np.float32] | None = None
    given = 0
    while batch := list(islice(stamps, 8)):
        # Eight stamps are the bits of one byte, and a table adds up their count and tints.
        sums = np.zeros((256, 3), np.float32)
        bits = np.zeros(batch[0].shape, np.uint8)
        for bit, mask in enumerate(batch):
            bits |= np.asarray(mask, bool).view(np.uint8) << np.uint8(bit)
            if given + bit < n:
                sums[np.arange(256) >> bit & 1 == 1] += (1, *path[given + bit, 1:])
        given += len(batch)
        if total is None:
            total = np.zeros((3, *bits.shape), np.float32)
        for channel in range(3):
            total[channel] += sums[:, channel][bits]
    if given != n:
        msg = f"{given} shadows for {n} labels"
        raise ValueError(msg)
    if total is None:
        return np.ones((*size, 3), np.float32)
    count, a, b = (resample(channel, size) for channel in total)
    return _mix(count, a, b, n)


def find_tints(n: int) -> NDArray[np.float32]:
    """Give the colour of each of n stamps' shadow alone, (n, 3) sRGB."""
    path = make_stamp_path(n).astype(np.float32)
    return _mix(np.ones(n, np.float32), path[:, 1], path[:, 2], n)


def _mix(count: NDArray, a: NDArray, b: NDArray, n: int) -> NDArray[np.float32]:
    """Turn counts and sums of tints into sRGB."""
    share = np.clip(count / n, 0, 1)
    depth = DEPTH * n / (n + 2) * np.sqrt(share)
    # A pixel that is covered in part keeps the hue and loses chroma with the count.
    kept = CHROMA / np.maximum(count, 1) * np.sqrt(np.maximum((n - count) / max(n - 1, 1), 0))
    if n == 1:
        kept = np.full_like(count, CHROMA)
    lab = np.stack([PAPER - depth, a * kept, b * kept], -1).astype(np.float32)
    image = to_srgb(lab)
    image[count <= 0] = 1
    return image
