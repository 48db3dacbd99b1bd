"""
Height rasters: the surface through the centres of their cells.

Four neighbouring centres make a square, cut by its diagonal from the first row's
column to the next row's next column. Where one of the four has no height, a triangle
of the other three is left.
"""

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.checks import errors_of, find_reason
from umbra.readers.content import FileContent
from umbra.readers.georeference import assumes_height_unit, name_crs, show_crs
from umbra.readers.model import RASTERS, TRUNK, CrownRaster, Crowns, FileModel, ReadChoices
from umbra.scene import Mesh, Part

__all__ = ["MOST_BYTES", "make_crowns", "make_surface", "read_raster"]

TALLEST = 130.0  # [m]; above all trees
LOWEST = -500.0  # [m]; below all land: many such cells are an undeclared nodata value
FEET = {"ft": 0.3048, "foot": 0.3048, "feet": 0.3048, "us survey foot": 1200 / 3937}
METRES = {"", "m", "metre", "meter", "metres", "meters"}
MOST_BYTES = 850  # peak memory of a cell in a study, see docs/formats.md


@dataclass(frozen=True, eq=False)
class HeightRaster:
    """Heights of cells."""

    heights: NDArray[np.float64]  # (rows, cols): [m]
    there: NDArray[np.bool_]  # (rows, cols): where there is a height
    matrix: NDArray[np.float64]  # (2, 3): from (column, row, 1), cell corners, to x and y
    crs: str | None
    # Whether the file says the unit of its heights, so that they are in metres for certain
    has_unit: bool = False


def read_raster(_: FileContent, path: Path, choices: ReadChoices) -> FileModel:
    """Read a height raster: a surface or terrain, on which buildings may stand, or a canopy."""
    if choices.crowns is not None:
        return _read_canopy(path, choices)
    notes: list[str] = []
    raster = open_raster(path, choices, notes)
    vertices, faces = make_surface(raster.heights, raster.there, raster.matrix)
    if not len(faces):
        msg = "has no two neighbouring rows and columns with heights; nothing can be made of it"
        raise InputError(msg)
    part = Part(path.stem, "Raster", Mesh(vertices, faces))
    return FileModel(
        "GeoTIFF",
        (part,),
        raster.crs,
        tuple(notes),
        is_terrain=True,
        is_high_in_metres=raster.has_unit,
    )


def open_raster(path: Path, choices: ReadChoices, notes: list[str]) -> HeightRaster:
    """Read the heights of a raster; losses go to the notes."""
    rasterio = need("rasterio", "gis", "GeoTIFF")
    choices.companions_of(path).check_beside()
    try:
        # By name, not from memory: overviews, masks and world files lie beside it.
        with _quietly(), rasterio.open(path, driver="GTiff") as source:
            _check_bands(source, notes)
            heights, there = _read_heights(source, notes)
            affine, wkt = source.transform, source.crs
            has_unit = bool((source.units[0] or "").strip())
    except rasterio.errors.RasterioError as error:
        reason = find_reason(error, 200)
        msg = f"cannot be read as a raster ({reason}); export it again as GeoTIFF"
        raise InputError(msg) from error
    matrix = np.array(affine, np.float64).reshape(3, 3)[:2]
    if not np.isfinite(matrix).all() or np.linalg.det(matrix[:, :2]) == 0:
        msg = "says that its cells have no area; repair its georeference"
        raise InputError(msg)
    crs = None if wkt is None else _name(wkt)
    if crs is not None and not has_unit and assumes_height_unit(crs):
        msg = (
            f"coordinates are in feet ({show_crs(crs)}) and the unit of the heights is not said; "
            "declare it (gdal_edit.py -units ft FILE)"
        )
        raise InputError(msg, crs=crs)
    if crs is None:
        plain = affine == affine.identity()
        notes.append(
            "no georeference, so cells are taken as 1 m"
            if plain
            else "no CRS is named, so coordinates are taken as metres"
        )
    return HeightRaster(heights, there, matrix, crs, has_unit)


def make_surface(
    heights: NDArray[np.float64], there: NDArray[np.bool_], matrix: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Make the surface through the centres of cells: vertices, and faces seen from above."""
    rows, cols = heights.shape
    row, col = np.nonzero(there)
    plan = matrix[:, 0] * (col[:, None] + 0.5) + matrix[:, 1] * (row[:, None] + 0.5) + matrix[:, 2]
    vertices = np.column_stack([plan, heights[there]])
    index = np.full((rows, cols), -1, np.int32)
    index[there] = np.arange(len(vertices), dtype=np.int32)
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    c, d = index[1:, :-1].ravel(), index[1:, 1:].ravel()
    missing = (a < 0).astype(np.int8) + (b < 0) + (c < 0) + (d < 0)
    whole = missing == 0
    faces = [
        np.column_stack([a[whole], c[whole], d[whole]]),
        np.column_stack([a[whole], d[whole], b[whole]]),
    ]
    for gone, corners in ((a, (b, c, d)), (b, (a, c, d)), (c, (a, d, b)), (d, (a, c, b))):
        rest = (missing == 1) & (gone < 0)
        faces.append(np.column_stack([corner[rest] for corner in corners]))
    joined = np.concatenate(faces)
    # A raster whose rows run south, as nearly all do, has turned the plan over.
    if np.linalg.det(matrix[:, :2]) > 0:
        joined = joined[:, ::-1]
    return vertices, np.ascontiguousarray(joined)


@contextmanager
def _quietly() -> Iterator[None]:
    """Suppress rasterio's warnings: notes say the same."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _check_bands(source: Any, notes: list[str]) -> None:
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
    from umbra.machine import find_memory, name_memory  # noqa: PLC0415

    needed, held = rows * cols * MOST_BYTES, find_memory()
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


def _read_canopy(path: Path, choices: ReadChoices) -> FileModel:
    """Read a raster of tree tops: the corners of its cells, for `stand_crowns`."""
    crowns = choices.crowns or Crowns(())
    notes: list[str] = []
    raster = open_raster(path, choices, notes)
    there = raster.there & (raster.heights > 0)
    if not there.any():
        msg = "has no cell with a canopy: none is higher than 0"
        raise InputError(msg, count=there.size)
    tallest = float(raster.heights[there].max())
    is_absolute = crowns.heights == "absolute"
    if not is_absolute and tallest > TALLEST:
        msg = (
            f"has trees of {tallest:.4g} m, which no tree reaches; if heights are not above the "
            "ground, give canopy_heights='absolute'"
        )
        raise InputError(msg, tallest=tallest)
    trunk, share = _read_trunk(crowns.trunk, choices, raster, there)
    heights = raster.heights[there]
    part, grid = make_crowns(path.stem, heights, there, raster.matrix, trunk, share, is_absolute)
    return FileModel(
        "GeoTIFF canopy",
        (part,),
        raster.crs,
        tuple(notes),
        crowns=grid,
        is_high_in_metres=raster.has_unit,
    )


def make_crowns(
    name: str,
    tops: NDArray[np.float64],
    there: NDArray[np.bool_],
    matrix: NDArray[np.float64],
    trunk: NDArray[np.float64] | None,
    share: float,
    is_absolute: bool,
) -> tuple[Part, CrownRaster]:
    """
    Make the cells of a canopy, whose body `stand_crowns` makes when the ground is known.

    Parameters
    ----------
    name : str
    tops : (n,) float64
        Heights of the cells ``there`` [m].
    there : (rows, cols) bool
    matrix : (2, 3) float64
        From (column, row, 1), cell corners, to x and y.
    trunk, share, is_absolute
        As in `CrownRaster`.
    """
    rows, cols = np.nonzero(there)
    place = np.full((there.shape[0] + 1, there.shape[1] + 1), -1, np.int32)
    for down, right in ((0, 0), (0, 1), (1, 0), (1, 1)):
        place[rows + down, cols + right] = 0
    row, col = np.nonzero(place >= 0)
    place[row, col] = np.arange(len(row), dtype=np.int32)
    plan = matrix @ np.stack([col, row, np.ones(len(row))]).astype(np.float64)
    corners = np.stack([place[rows + r, cols + c] for r, c in ((0, 0), (0, 1), (1, 1), (1, 0))], 1)
    cells = np.full(there.shape, -1, np.int32)
    cells[rows, cols] = np.arange(len(rows), dtype=np.int32)
    grid = CrownRaster(cells, corners, tops, trunk, share, is_absolute)
    faces = corners[:, [0, 1, 2]]  # only so that each corner is used, until the body is made
    faces = np.concatenate([faces, corners[:, [0, 2, 3]]])
    mesh = Mesh(np.column_stack([plan.T, np.zeros(len(row))]), faces)
    return Part(name, "Canopy", mesh), grid


def _read_trunk(
    trunk: str, choices: ReadChoices, raster: HeightRaster, there: NDArray[np.bool_]
) -> tuple[NDArray[np.float64] | None, float]:
    """Read where crowns begin: heights, or a share of the canopy's."""
    text = str(trunk).strip()
    if text.lower().endswith(RASTERS):
        notes: list[str] = []
        with errors_of(f"trunk zone {text}: "):
            zone = open_raster(Path(text), choices, notes)
        is_same = zone.heights.shape == raster.heights.shape and np.allclose(
            zone.matrix, raster.matrix, rtol=1e-9, atol=1e-6
        )
        if not is_same:
            msg = f"trunk zone {text} has other cells than the canopy; resample it (gdalwarp -ts)"
            raise InputError(msg)
        return np.where(zone.there, zone.heights, -np.inf)[there], 0.0
    try:
        share = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        share = np.nan
    if not 0 <= share < 1:
        msg = (
            f"the trunk zone is a share of the height from 0 to below 1, such as {TRUNK:g}, or "
            f"a GeoTIFF (.tif); got '{text}'"
        )
        raise InputError(msg, trunk=trunk)
    return None, share
