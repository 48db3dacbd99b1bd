"""
Pixels of pictures: their colours, and rasters resampled, packed, and written as PNG.

Colours are made in OKLab, where equal distances look equal: paths of even steps, shades.
"""

import os
import struct
import zlib
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

__all__ = [
    "HALF",
    "NO_SUN",
    "PackedMasks",
    "Ramp",
    "make_ramp",
    "make_stamp_path",
    "make_stamp_tints",
    "paint_shares",
    "resample",
    "shade_ramp",
    "to_srgb",
    "write_png",
]

# Björn Ottosson, "A perceptual color space for image processing" (2020): OKLab to the
# cube roots of cone responses, and cone responses to linear sRGB.
LAB_TO_CONES = np.array(
    [
        [1.0, 0.3963377774, 0.2158037573],
        [1.0, -0.1055613458, -0.0638541728],
        [1.0, -0.0894841775, -1.2914855480],
    ]
)
CONES_TO_RGB = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)

# Lightness, chroma and hue [degrees], from no shadow (pale yellow, which a shaded roof keeps:
# paper is white) to shadow all the time (deep blue). Lightness falls all the way, so that the
# order holds in grey print and for every kind of colour vision.
SHADE_STOPS = [
    (0.965, 0.050, 97.0),
    (0.885, 0.085, 110.0),
    (0.760, 0.105, 165.0),
    (0.600, 0.110, 225.0),
    (0.430, 0.120, 262.0),
    (0.290, 0.095, 280.0),
]
# From no loss (paper) to the most (brown): in no hue of the hours in shadow beside them.
LOSS_STOPS = [
    (0.985, 0.004, 80.0),
    (0.910, 0.060, 75.0),
    (0.810, 0.115, 62.0),
    (0.680, 0.140, 50.0),
    (0.520, 0.125, 42.0),
    (0.340, 0.085, 35.0),
]
# From no gain to the most (violet): opposite to losses for every kind of colour vision.
GAIN_STOPS = [
    (0.985, 0.004, 310.0),
    (0.910, 0.045, 310.0),
    (0.800, 0.100, 310.0),
    (0.660, 0.150, 310.0),
    (0.500, 0.170, 308.0),
    (0.330, 0.130, 305.0),
]
Ramp = Literal["shade", "loss", "change"]
"""Hours in shadow; hours lost; hours won (first half) and lost (second half)."""
RAMPS = {"shade": SHADE_STOPS, "loss": LOSS_STOPS}
NO_SUN = (0.075, 0.075, 0.08)
"""sRGB of places without any sun on the date: darker than the longest shadow of the scale."""
# The deepest shade of a surface that slopes: darker by this, mostly across the scale of hours
# rather than along it, where it would be taken for more hours.
SLOPE_SHADE, ALONG = 0.08, 0.4
_SHADES = 33
# The day's light: yellow in the morning, red at noon, violet in the evening; and ever darker, so
# that neighbours of nine differ by 5 of CIELAB's lightness in grey print and for the colour-blind.
STAMP_STOPS = [
    (0.960, 0.151, 105.0),
    (0.847, 0.145, 60.0),
    (0.765, 0.126, 36.0),
    (0.716, 0.132, 8.0),
    (0.639, 0.149, -24.0),
    (0.544, 0.168, -51.0),
]


SINGLE = (0.66, -0.012, -0.055)
"""Of a shadow that is alone on its map, OKLab: 2.8 : 1 on paper."""
_TOE = 0.0031308  # below which sRGB is linear
# Linear light to sRGB; a step is less than one of 255 even in the dark.
_LINEAR = np.linspace(0, 1, 8192)
_GAMMA = np.where(
    _LINEAR <= _TOE, 12.92 * _LINEAR, 1.055 * np.maximum(_LINEAR, 1e-9) ** (1 / 2.4) - 0.055
)
_COLOR_TYPES = {2: 4, 3: 2, 4: 6}  # of PNG, by the number of channels
_ROWS = 256  # that are compressed at a time
_COLORS = 8192  # that are computed at a time
HALF = 0.5
"""A pixel with a larger share of a region belongs to it."""


def make_ramp(stops: list[tuple[float, float, float]], positions: ArrayLike) -> NDArray[np.float64]:
    """
    Take sRGB colours (n, 3) in [0, 1] from a path through OKLCh stops, at equal steps to the eye.

    Positions are those along the path, 0 its start and 1 its end; hues in degrees.
    """
    return to_srgb(follow(stops, positions))


def follow(stops: list[tuple[float, float, float]], positions: ArrayLike) -> NDArray[np.float64]:
    """Take OKLab colours (n, 3) from a path through stops; same parameters as ``make_ramp``."""
    lightness, chroma, hue = np.array(stops, np.float64).T
    hue = np.unwrap(np.radians(hue))
    knots = np.linspace(0, 1, len(stops))
    fine = np.linspace(0, 1, 512)
    lightness, chroma, hue = (np.interp(fine, knots, c) for c in (lightness, chroma, hue))
    lab = np.column_stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)])
    # Measure positions along the path's own length: stops are not evenly far apart.
    steps = np.linalg.norm(np.diff(lab, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = np.clip(np.asarray(positions, np.float64), 0, 1) * length[-1]
    return np.column_stack([np.interp(wanted, length, c) for c in lab.T])


def to_srgb(lab: NDArray) -> NDArray:
    """Turn OKLab colours (..., 3) into sRGB in [0, 1]; what sRGB cannot show is cut."""
    to_cones, to_rgb, gamma = (m.T.astype(lab.dtype) for m in (LAB_TO_CONES, CONES_TO_RGB, _GAMMA))
    colors = lab.reshape(-1, 3)
    srgb = np.zeros_like(colors)
    for first in range(0, len(colors), _COLORS):  # so many as stay in the processor's cache
        cones = colors[first : first + _COLORS] @ to_cones
        linear = np.clip((cones * cones * cones) @ to_rgb, 0, 1)
        srgb[first : first + _COLORS] = gamma[(linear * (len(gamma) - 1) + 0.5).astype(np.intp)]
    return srgb.reshape(lab.shape)


def shade_ramp(n: int = 256, ramp: Ramp = "shade") -> NDArray[np.float64]:
    """Return a ramp's colours, (n, 3) sRGB: from none to all the time, or from won to lost."""
    return to_srgb(_follow_ramp(ramp, n))


def _follow_ramp(ramp: Ramp, n: int) -> NDArray[np.float64]:
    """Take n OKLab colours, (n, 3), from a ramp; the middle of that of change is paper."""
    positions = np.linspace(0, 1, n)
    if ramp != "change":
        return follow(RAMPS[ramp], positions)
    won, lost = (follow(stops, abs(2 * positions - 1)) for stops in (GAIN_STOPS, LOSS_STOPS))
    return np.where(positions[:, None] < HALF, won, lost)


def paint_shares(
    shares: NDArray[np.floating],
    shade: NDArray[np.floating] | None = None,
    ramp: Ramp = "shade",
) -> NDArray[np.float32]:
    """
    Paint shares of the longest time in shadow, on surfaces that are shaded by their slope.

    However deep the shade, from 0 to 1, a colour stays nearest to its own place on the scale: it
    moves by less than half of one of eight steps. Shares of ``change`` are from -1 to 1. Returns
    sRGB (..., 3) in [0, 1].
    """
    if ramp == "change":
        shares = (np.asarray(shares) + 1) / 2
    index = np.clip(np.asarray(shares) * 255 + 0.5, 0, 255).astype(np.intp)
    if shade is None:
        return shade_ramp(ramp=ramp).astype(np.float32)[index]
    depth = np.clip(np.asarray(shade) * (_SHADES - 1) + 0.5, 0, _SHADES - 1).astype(np.intp)
    return _make_shaded_ramps(ramp)[depth, index]


@lru_cache(maxsize=2)
def _make_shaded_ramps(ramp: Ramp) -> NDArray[np.float32]:
    """Return the colour scale in every depth of shade, (n_shades, 256, 3) sRGB."""
    lab = _follow_ramp(ramp, 256)
    along = np.gradient(lab, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    darker = np.array([-1.0, 0.0, 0.0])
    way = darker - (1 - ALONG) * (along @ darker)[:, None] * along
    depth = SLOPE_SHADE * np.linspace(0, 1, _SHADES)
    return to_srgb(lab + depth[:, None, None] * way).astype(np.float32)


def make_stamp_tints(n: int) -> NDArray[np.float64]:
    """Return one tint for each of n stamps, (n, 3) sRGB, from the first to the last."""
    return to_srgb(make_stamp_path(n))


def make_stamp_path(n: int) -> NDArray[np.float64]:
    """Return the same tints in OKLab, (n, 3); one alone is the blue-grey of shadows."""
    return np.array([SINGLE]) if n == 1 else follow(STAMP_STOPS, np.linspace(0, 1, n))


def write_png(
    file: str | os.PathLike[str] | BinaryIO,
    pixels: NDArray[np.uint8],
    dots_per_inch: float | None = None,
) -> None:
    """
    Write pixels as an 8-bit PNG.

    Rows are not filtered: Pillow, which tries five filters for each, takes twice the time, and its
    files of plans are a quarter larger.

    Parameters
    ----------
    file : path or binary file
    pixels : (rows, cols, 2, 3 or 4) uint8
        Grey with opacity, sRGB, or sRGB with opacity; row 0 is the top.
    dots_per_inch : float, optional
        Kept in the file, so that it prints at its intended size.

    Raises
    ------
    ValueError
        If the pixels have another shape or dtype.
    """
    pixels = np.asarray(pixels)
    if pixels.ndim != 3 or pixels.shape[2] not in _COLOR_TYPES or pixels.dtype != np.uint8:
        msg = f"a picture is (rows, cols, 3) uint8; got {pixels.shape} {pixels.dtype}"
        raise ValueError(msg)
    rows, cols, channels = pixels.shape
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", cols, rows, 8, _COLOR_TYPES[channels], 0, 0, 0))]
    if dots_per_inch is not None:
        per_metre = round(dots_per_inch / 0.0254)
        chunks.append((b"pHYs", struct.pack(">IIB", per_metre, per_metre, 1)))
    packer = zlib.compressobj(3)
    for first in range(0, rows, _ROWS):
        block = pixels[first : first + _ROWS]
        lines = np.zeros((len(block), 1 + cols * channels), np.uint8)  # 0: the row is not filtered
        lines[:, 1:] = block.reshape(len(block), -1)
        chunks.append((b"IDAT", packer.compress(lines.data)))
    chunks += [(b"IDAT", packer.flush()), (b"IEND", b"")]
    data = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in chunks
    )
    if isinstance(file, (str, os.PathLike)):
        Path(file).write_bytes(data)
    else:
        file.write(data)


_AT_ONCE = 1 << 22  # cells that are resampled together


def resample(values: NDArray, size: tuple[int, int]) -> NDArray[np.float32]:
    """
    Resample values (rows, cols) by area where cells are smaller than pixels, else keep cells crisp.

    NaN cells take no part; a pixel that has only such is NaN.
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
    high, wide = values.shape
    # Hamming's kernel is as wide as bilinear's, sharper, and never rings.
    shrink, grow = Image.Resampling.HAMMING, Image.Resampling.BOX
    # Columns change their height alone: some at a time, since Pillow copies what it is given.
    columns = max(1, _AT_ONCE // high)
    bands = [
        Image.fromarray(np.ascontiguousarray(values[:, first : first + columns])).resize(
            (min(columns, wide - first), rows), shrink if rows < high else grow
        )
        for first in range(0, wide, columns)
    ]
    image = (
        bands[0]
        if len(bands) == 1
        else Image.fromarray(np.hstack([np.asarray(band) for band in bands]))
    )
    image = image.resize((cols, rows), shrink if cols < wide else grow)
    return np.asarray(image, np.float32)


class PackedMasks:
    """
    Masks at one bit a cell, each unpacked when read: a day's instants in little memory.

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
