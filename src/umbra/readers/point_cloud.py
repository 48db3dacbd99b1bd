"""
LAS and LAZ point clouds: the surface of ground and buildings, and the canopy of trees.

Of each cell the highest first return counts. Points of classes 3 to 5 make a canopy on the
lowest ground points (class 2); without classes all points make one surface. The points are read
in a child process, as the decoder ends its process on damaged files.
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.machine import find_memory, name_memory
from umbra.packages import need, require
from umbra.readers.checks import find_reason
from umbra.readers.child import ReadingChild
from umbra.readers.content import FileContent
from umbra.readers.georeference import is_in_degrees, name_crs, show_crs
from umbra.readers.height_raster import make_crowns, make_raster_surface
from umbra.readers.model import NO_CRS, TRUNK, FileModel, ReadChoices
from umbra.readers.raster_file import MOST_BYTES
from umbra.readers.region import Region
from umbra.scene import Mesh, Part

__all__ = ["grid_points", "read_cloud_points"]

CELLS = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Sides of a cell, in the unit of the plan."""
PER_CELL = 4
"""First returns that a cell shall have on average."""
GROUND, TREES, NOISE = 2, (3, 4, 5), (7, 18)
_UNCLASSIFIED = (0, 1)
_CHUNK = 1_000_000  # points read at once
_ROUNDS = 3  # cells by which gaps between heights are filled from each side
_HEADER = 247  # [byte] of a header, to the number of records behind the points
_AROUND = 5  # neighbours with heights that a filled cell has


@dataclass(frozen=True)
class PointWork:
    """Request to read a file."""

    path: str
    region: Region | None
    held: float  # memory of a study [byte]


@dataclass(eq=False)
class PointGrid:
    """Highest and lowest points of cells, rows running south."""

    west: float
    north: float
    cell: float
    solid: NDArray[np.float64]  # (rows, cols): highest first return that is no tree; -inf for none
    trees: NDArray[np.float64]  # (rows, cols): highest of trees; -inf for none
    ground: NDArray[np.float64]  # (rows, cols): lowest of the ground; inf for none
    used: int = 0
    noise: int = 0
    outside: int = 0
    classes: set[int] = field(default_factory=set)

    @classmethod
    def make(cls, west: float, north: float, cell: float, shape: tuple[int, int]) -> "PointGrid":
        """Make a grid without points."""
        none = np.full(shape, -np.inf)
        return cls(west, north, cell, none, none.copy(), -none)

    def add(self, points: Any) -> None:
        """Add a chunk of points: the first returns of what is no noise."""
        kind = np.asarray(points.classification)
        first = np.asarray(points.return_number) <= 1
        noise = np.isin(kind, NOISE)
        if hasattr(points, "withheld"):
            noise |= np.asarray(points.withheld, np.bool_)
        self.noise += int(noise.sum())
        x, y, z = (np.asarray(axis, np.float64) for axis in (points.x, points.y, points.z))
        col, row = (x - self.west) / self.cell, (self.north - y) / self.cell
        rows, cols = self.solid.shape
        there = (col >= 0) & (col < cols) & (row >= 0) & (row < rows) & np.isfinite(z)
        self.outside += int((~there & ~noise).sum())
        # Ground under trees is seen by later returns only.
        is_ground = there & (kind == GROUND)
        flat = np.where(there, row, 0).astype(np.int64) * cols
        flat += np.where(there, col, 0).astype(np.int64)
        np.minimum.at(self.ground.reshape(-1), flat[is_ground], z[is_ground])
        is_used = there & first & ~noise
        is_tree = is_used & np.isin(kind, TREES)
        is_solid = is_used & ~is_tree
        np.maximum.at(self.trees.reshape(-1), flat[is_tree], z[is_tree])
        np.maximum.at(self.solid.reshape(-1), flat[is_solid], z[is_solid])
        self.used += int(is_used.sum())
        self.classes |= set(np.unique(kind[is_used]).tolist())


def read_cloud_points(content: FileContent, path: Path, choices: ReadChoices) -> FileModel:
    """Read a point cloud as a surface and a canopy; of a region only its points."""
    require(["laspy", "lazrs"], "city", "LAS and LAZ")
    _check_records(content)
    work = PointWork(str(path.resolve()), choices.region, find_memory())
    limits = choices.budget.limit_child()
    child = ReadingChild("umbra.readers.point_cloud:grid_points", work, limits)
    last = None
    for piece in child:
        last = piece
    if not child.is_done or not isinstance(last, tuple):
        error = child.make_error("a point cloud", "fetch it again")
        raise error
    grid, crs = last
    parts, notes = _make_parts(grid, path.stem)
    if crs is None:
        notes.append(NO_CRS)
    is_terrain = len(parts) == 1
    form = "LAZ" if path.suffix.lower() == ".laz" else "LAS"
    return FileModel(form, parts, crs, tuple(notes), is_terrain=is_terrain)


def _check_records(content: FileContent) -> None:
    """Refuse more variable length records than fit in the file: laspy would list them all."""
    head = content.head.ljust(_HEADER, b"\0")
    count, more = struct.unpack_from("<I", head, 100)[0], struct.unpack_from("<I", head, 243)[0]
    is_long = tuple(head[24:26]) >= (1, 4)  # a version with records behind the points
    if max(54 * count, 60 * more if is_long else 0) > content.size:
        msg = (
            f"is a damaged point cloud (its header says {max(count, more):,} records, more than "
            f"fit in its {content.size:,} bytes); fetch it again"
        )
        raise InputError(msg, count=max(count, more))


def grid_points(work: PointWork) -> Iterator[int | tuple[PointGrid, str | None]]:
    """Grid a file's points in a child process: yield the points so far, at last grid and CRS."""
    laspy = need("laspy", "city", "LAS and LAZ")
    try:
        with laspy.open(work.path) as file:
            crs = _find_crs(file.header)
            grid = _lay_out(file.header, work, crs)
            for points in file.chunk_iterator(_CHUNK):
                grid.add(points)
                yield grid.used
        yield grid, crs
    except InputError:
        raise
    except MemoryError as error:
        msg = "is a point cloud too large for memory, or damaged; fetch it again"
        raise InputError(msg) from error
    except Exception as error:  # lazrs raises kinds of its own
        reason = find_reason(error) or "its points"
        msg = f"is a damaged point cloud ({reason}); fetch it again"
        raise InputError(msg) from error


def _find_crs(header: Any) -> str | None:
    system = header.parse_crs()
    if system is None:
        return None
    code = system.to_epsg()
    crs = f"EPSG:{code}" if code else name_crs(system.to_wkt())
    if crs is not None and is_in_degrees(crs):
        msg = f"is in degrees ({show_crs(crs)}); convert it to metres (pdal translate, reproject)"
        raise InputError(msg, crs=crs)
    return crs


def _lay_out(header: Any, work: PointWork, crs: str | None) -> PointGrid:
    """Choose the cell by the density of first returns, and the cells' extent."""
    region = work.region
    low, high = np.array(header.mins, np.float64)[:2], np.array(header.maxs, np.float64)[:2]
    if not (np.isfinite([*low, *high]).all() and (high >= low).all()):
        msg = "has bounds in its header that are not finite; fetch it again"
        raise InputError(msg)
    counts = np.array(header.number_of_points_by_return, np.float64)
    count = counts[0] if len(counts) and counts[0] > 0 else float(header.point_count)
    if not count > 0:
        msg = "has no points; fetch it again"
        raise InputError(msg)
    area = max(float((high - low).prod()), 1e-6)
    wanted = math.sqrt(PER_CELL * area / count)
    cell = next((side for side in CELLS if side >= 0.999 * wanted), wanted)
    if region is not None:
        west, south, east, north = region.settle(crs).find_box(crs)
        low, high = np.maximum(low, [west, south]), np.minimum(high, [east, north])
        if (high <= low).any():
            msg = f"has no point inside {region.shown}; umbra inspect shows its bounds"
            raise InputError(msg, option=region.option)
    cols, rows = (int(n) for n in np.floor((high - low) / cell) + 1)
    needed, held = rows * cols * MOST_BYTES, work.held
    if needed > held:
        msg = (
            f"makes {cols}x{rows} cells of {cell:g} m, a study of which needs {needed / 1e9:.0f} "
            f"GB and {name_memory(held)}; give a part of it (bbox=)"
        )
        raise InputError(msg, option="bbox", bytes=needed)
    return PointGrid.make(float(low[0]), float(high[1]), cell, (rows, cols))


def _make_parts(grid: PointGrid, name: str) -> tuple[tuple[Part, ...], list[str]]:
    """Make the surface and the canopy, and notes on how they came about."""
    area = grid.cell**2 * grid.solid.size
    density = f"{grid.used / area:.3g} for a square metre"
    notes = [f"cells of {grid.cell:g} m, from {grid.used:,} first returns ({density})"]
    if grid.noise:
        notes.append(f"points left out that are noise or withheld: {grid.noise}")
    if grid.outside:
        notes.append(f"points left out outside the bounds: {grid.outside}")
    there = np.isfinite(grid.solid)
    is_plain = grid.classes <= set(_UNCLASSIFIED)
    if is_plain:
        notes.append("points have no classes, so trees are part of the surface")
    heights, filled = _fill(np.where(there, grid.solid, np.nan))
    if filled:
        notes.append(f"cells without a point filled from their neighbours: {filled}")
    matrix = np.array([[grid.cell, 0, grid.west], [0, -grid.cell, grid.north]])
    known = np.isfinite(heights)
    vertices, faces = make_raster_surface(heights, known, matrix)
    parts = [Part(name, "Raster", Mesh(vertices, faces))] if len(faces) else []
    crowns = np.isfinite(grid.trees)
    if crowns.any():
        body, left_out = _make_canopy(grid, crowns, heights, matrix, f"{name} trees")
        parts.append(body)
        notes.append(
            f"a canopy of classes 3 to 5 on the ground of class 2, {int(crowns.sum()) - left_out} "
            f"cells, crowns from {TRUNK:g} of their height up"
        )
    if not parts:
        msg = "has no two neighbouring cells with points; nothing can be made of it"
        raise InputError(msg)
    return tuple(parts), notes


def _make_canopy(
    grid: PointGrid,
    crowns: NDArray[np.bool_],
    heights: NDArray[np.float64],
    matrix: NDArray[np.float64],
    name: str,
) -> tuple[Part, int]:
    """Make the body of trees above the nearest ground."""
    from scipy.ndimage import distance_transform_edt  # noqa: PLC0415 - 0.2 s

    from umbra.readers.canopy import stand_crowns  # noqa: PLC0415 - it compiles kernels

    ground = np.where(np.isfinite(grid.ground), grid.ground, np.nan)
    if not np.isfinite(ground).any():
        ground = heights
    missing = ~np.isfinite(ground)
    if missing.all():
        ground, missing = np.full_like(ground, grid.trees[crowns].min()), np.zeros_like(missing)
    nearest = distance_transform_edt(missing, return_distances=False, return_indices=True)
    below = ground[tuple(nearest)][crowns]
    part, cells = make_crowns(name, grid.trees[crowns], crowns, matrix, None, TRUNK, True)
    return stand_crowns(part, cells, below)


def _fill(heights: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Fill small gaps by the mean of at least five neighbours; count the cells filled."""
    filled = 0
    for _ in range(_ROUNDS):
        padded = np.pad(heights, 1, constant_values=np.nan)
        total, known = np.zeros_like(heights), np.zeros(heights.shape, np.int8)
        rows, cols = heights.shape
        for down in range(3):
            for right in range(3):
                near = padded[down : down + rows, right : right + cols]
                is_known = np.isfinite(near)
                total += np.where(is_known, near, 0)
                known += is_known
        new = ~np.isfinite(heights) & (known >= _AROUND)
        if not new.any():
            break
        heights = np.where(new, total / np.maximum(known, 1), heights)
        filled += int(new.sum())
    return heights, filled
