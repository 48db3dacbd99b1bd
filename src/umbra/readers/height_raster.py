"""
Height rasters: the surface through the centres of their cells.

Four neighbouring centres make a square, cut by its diagonal from the first row's
column to the next row's next column. Where one of the four has no height, a triangle
of the other three is left.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.machine import find_memory
from umbra.packages import require
from umbra.readers.checks import errors_of
from umbra.readers.child import ReadingChild
from umbra.readers.content import FileContent
from umbra.readers.georeference import assumes_height_unit, show_crs
from umbra.readers.model import NO_CRS, RASTERS, TRUNK, CrownRaster, Crowns, FileModel, ReadChoices
from umbra.readers.raster_file import RasterBand, RasterWork
from umbra.scene import Mesh, Part

__all__ = ["make_crowns", "make_raster_surface", "read_raster"]

TALLEST = 130.0  # [m]; above all trees
CELL = 90  # memory of a cell's place and its two triangles, and of making them [byte]


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
    vertices, faces = make_raster_surface(raster.heights, raster.there, raster.matrix)
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
    require(["rasterio"], "gis", "GeoTIFF")
    choices.companions_of(path).check_beside()
    # By name, not from memory: overviews, masks and world files lie beside it.
    limits = choices.budget.limit_child()
    work = RasterWork(str(path.absolute()), limits.memory, find_memory())
    child = ReadingChild("umbra.readers.raster_file:read_band", work, limits)
    bands = list(child)
    if not child.is_done or not bands:
        error = child.make_error("a raster", "export it again as GeoTIFF")
        raise error
    band: RasterBand = bands[0]
    notes += band.notes
    heights, there, has_unit = band.heights, band.there, band.has_unit
    choices.budget.spend(CELL * int(there.sum()) + heights.nbytes, "cells with a height")
    matrix = band.affine
    if not np.isfinite(matrix).all() or np.linalg.det(matrix[:, :2]) == 0:
        msg = "says that its cells have no area; repair its georeference"
        raise InputError(msg)
    crs = band.crs
    if crs is not None and not has_unit and assumes_height_unit(crs):
        msg = (
            f"coordinates are in feet ({show_crs(crs)}) and the unit of the heights is not said; "
            "declare it (gdal_edit.py -units ft FILE)"
        )
        raise InputError(msg, crs=crs)
    if crs is None:
        plain = np.array_equal(matrix, np.eye(2, 3))
        notes.append("no georeference, so cells are taken as 1 m" if plain else NO_CRS)
    return HeightRaster(heights, there, matrix, crs, has_unit)


def make_raster_surface(
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
        raise InputError(msg, option="canopy_heights", tallest=tallest)
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
    node = np.full((there.shape[0] + 1, there.shape[1] + 1), -1, np.int32)
    for down, right in ((0, 0), (0, 1), (1, 0), (1, 1)):
        node[rows + down, cols + right] = 0
    row, col = np.nonzero(node >= 0)
    node[row, col] = np.arange(len(row), dtype=np.int32)
    plan = matrix @ np.stack([col, row, np.ones(len(row))]).astype(np.float64)
    corners = np.stack([node[rows + r, cols + c] for r, c in ((0, 0), (0, 1), (1, 1), (1, 0))], 1)
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
