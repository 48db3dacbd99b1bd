"""
rasterio on one GeoTIFF: its first band in metres.

This runs in a child process (`umbra.readers.height_raster`), as GDAL may end the process at damaged
files, and as a small file may unpack to any size.
"""

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.machine import name_memory
from umbra.packages import need
from umbra.readers.budget import Budget
from umbra.readers.checks import find_reason
from umbra.readers.georeference import name_crs

__all__ = ["MOST_BYTES", "RasterBand", "RasterWork", "read_band"]

LOWEST = -500.0  # [m]; below all land: many such cells are an undeclared nodata value
FEET = {"ft": 0.3048, "foot": 0.3048, "feet": 0.3048, "us survey foot": 1200 / 3937}
METRES = {"", "m", "metre", "meter", "metres", "meters"}
MOST_BYTES = 850  # peak memory of a cell in a study, see docs/formats.md
_CELL = 20  # memory of a cell while it is read [byte]


@dataclass(frozen=True)
class RasterWork:
    """Request to read a file."""

    path: str
    memory: float  # that its cells may take [byte]
    held: float  # memory of a study [byte]


@dataclass(frozen=True, eq=False)
class RasterBand:
    """The heights of a file."""

    heights: NDArray[np.float64]  # (rows, cols): [m]
    there: NDArray[np.bool_]  # (rows, cols): where there is a height
    affine: NDArray[np.float64]  # (2, 3): from (column, row, 1), cell corners, to x and y
    crs: str | None
    has_unit: bool  # whether the file says the unit of its heights
    notes: tuple[str, ...]


def read_band(work: RasterWork) -> Iterator[RasterBand]:
    """Read the first band of a file: yield it at once."""
    rasterio = need("rasterio", "gis", "GeoTIFF")
    notes: list[str] = []
    try:
        with _quietly(), rasterio.open(work.path, driver="GTiff") as source:
            _check_bands(source, work.held, notes)
            Budget(work.memory).spend(_CELL * source.width * source.height, "cells")
            heights, there = _read_heights(source, notes)
            affine = np.array(source.transform, np.float64).reshape(3, 3)[:2]
            crs = None if source.crs is None else _name(source.crs)
            has_unit = bool((source.units[0] or "").strip())
    except rasterio.errors.RasterioError as error:
        reason = find_reason(error, 200)
        msg = f"cannot be read as a raster ({reason}); export it again as GeoTIFF"
        raise InputError(msg) from error
    yield RasterBand(heights, there, affine, crs, has_unit, tuple(notes))


@contextmanager
def _quietly() -> Iterator[None]:
    """Suppress rasterio's warnings: notes say the same."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _check_bands(source: Any, held: float, notes: list[str]) -> None:
    kind = source.dtypes[0]
    if kind.startswith("complex"):
        msg = f"holds {kind} numbers, not heights; give a digital surface or terrain model"
        raise InputError(msg, dtype=kind)
    if kind == "uint8" and source.count >= 3:
        msg = f"is a picture of {source.count} bands, not heights; give a surface or terrain model"
        raise InputError(msg, bands=source.count)
    if source.count > 1:
        notes.append(f"bands after the first left out: {source.count - 1}")
    rows, cols = source.shape
    if rows < 2 or cols < 2:
        msg = f"has {cols}x{rows} cells; a surface needs at least 2x2"
        raise InputError(msg, cells=(rows, cols))
    needed = rows * cols * MOST_BYTES
    if needed > held:
        step = math.ceil(math.sqrt(needed / held))
        msg = (
            f"has {cols}x{rows} cells, a study of which needs {needed / 1e9:.0f} GB and "
            f"{name_memory(held)}; cut it to the area you need (gdal_translate "
            f"-projwin) or make it {step} times coarser (gdalwarp -tr)"
        )
        raise InputError(msg, bytes=needed)


def _read_heights(source: Any, notes: list[str]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Read the first band in metres, and where it has heights."""
    heights = source.read(1).astype(np.float64)
    there = (source.read_masks(1) != 0) & np.isfinite(heights)
    heights = heights * source.scales[0] + source.offsets[0]
    unit = (source.units[0] or "").strip().casefold()
    if unit in FEET:
        heights *= FEET[unit]
        notes.append(f"heights were converted from feet ('{source.units[0]}')")
    elif unit not in METRES:
        msg = f"has heights in '{source.units[0]}'; convert them to metres"
        raise InputError(msg, unit=unit)
    count = int(there.sum())
    if not count:
        msg = "has no cell with a height: all are nodata"
        raise InputError(msg, count=there.size)
    deepest = float(heights[there].min())
    deep = int((heights[there] == deepest).sum())
    if deepest < LOWEST:
        msg = (
            f"has {deep} cells at {deepest:g} m, lower than any land: a value for no data that "
            f"the file does not declare; declare it (gdal_edit.py -a_nodata {deepest:g} FILE)"
        )
        raise InputError(msg, value=deepest, count=deep)
    if count < there.size:
        notes.append(f"cells without a height left out: {there.size - count} of {there.size}")
    return heights, there


def _name(crs: Any) -> str | None:
    """Name a CRS: by its code if it has one, else in its own words."""
    code = crs.to_epsg()
    return f"EPSG:{code}" if code else name_crs(crs.to_wkt())
