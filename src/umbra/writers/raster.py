"""Rasters: resampled to the size at which they are seen, packed, and written as PNG."""

import os
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray
from PIL import Image

__all__ = ["HALF", "PackedMasks", "resample", "write_png"]

HALF = 0.5
"""From such a share on a pixel belongs to a region."""


def write_png(
    path: str | os.PathLike[str], rgb: NDArray[np.uint8], dots_per_inch: float | None = None
) -> None:
    """
    Write an image as an 8-bit RGB PNG.

    Parameters
    ----------
    path : path
    rgb : (rows, cols, 3) uint8
        sRGB; row 0 is the top.
    dots_per_inch : float, optional
        Kept in the file, so that it prints at its intended size.

    Raises
    ------
    ValueError
        If ``rgb`` has another shape or dtype.
    OSError
        If the file cannot be written.
    """
    rgb = np.asarray(rgb)
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8:
        msg = f"a picture is (rows, cols, 3) uint8; got {rgb.shape} {rgb.dtype}"
        raise ValueError(msg)
    extra = {} if dots_per_inch is None else {"dpi": (dots_per_inch, dots_per_inch)}
    # Level 3 takes a third of the default's time for a file a few percent larger.
    Image.fromarray(np.ascontiguousarray(rgb)).save(path, "PNG", compress_level=3, **extra)


def resample(values: NDArray, size: tuple[int, int]) -> NDArray[np.float32]:
    """
    Resample by area where cells are smaller than pixels, else keep cells crisp.

    Parameters
    ----------
    values : (rows, cols) bool or float
        NaN cells take no part; a pixel that has none but such is NaN.
    size : (rows, cols)

    Returns
    -------
    resampled : (rows, cols) float32
    """
    if values.dtype == bool:
        # Pillow's 8-bit path is three times as fast, and 1 of 255 is nothing to the eye.
        return _resize(values.astype(np.uint8) * np.uint8(255), size) / np.float32(255)
    values = np.asarray(values, np.float32)
    is_missing = np.isnan(values)
    if not is_missing.any():
        return _resize(values, size)
    weight = _resize((~is_missing).astype(np.float32), size)
    total = _resize(np.where(is_missing, np.float32(0), values), size)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(weight > HALF, total / weight, np.float32(np.nan))


def _resize(values: NDArray, size: tuple[int, int]) -> NDArray[np.float32]:
    """Resize each axis by its own need: shrinking averages, growing repeats."""
    rows, cols = size
    # Hamming's kernel is as wide as bilinear's, sharper, and never rings.
    shrink, grow = Image.Resampling.HAMMING, Image.Resampling.BOX
    image = Image.fromarray(np.ascontiguousarray(values))
    image = image.resize((image.width, rows), shrink if rows < image.height else grow)
    image = image.resize((cols, rows), shrink if cols < image.width else grow)
    return np.asarray(image, np.float32)


class PackedMasks:
    """
    Masks at a bit a cell, unpacked one by one: all instants of a day in little memory.

    Parameters
    ----------
    masks : iterable of (rows, cols) bool
    """

    def __init__(self, masks: Iterable[NDArray[np.bool_]]) -> None:
        self.shape: tuple[int, ...] = (0, 0)
        self.packed: list[NDArray[np.uint8]] = []
        for mask in masks:
            self.shape = mask.shape
            self.packed.append(np.packbits(np.asarray(mask, bool)))

    def __len__(self) -> int:
        return len(self.packed)

    def __iter__(self) -> Iterator[NDArray[np.bool_]]:
        size = self.shape[0] * self.shape[1]
        for bits in self.packed:
            yield np.unpackbits(bits, count=size).reshape(self.shape).astype(bool)
