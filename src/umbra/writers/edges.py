"""
Appearance of a view's surfaces: soft shading, and edges.

Surfaces that face away from a lamp at the viewer's upper left are shaded; level ground, and in
an elevation the facade itself, keep the legend's colours. Lines mark jumps in depth and, finer,
creases and borders between parts.
"""

import math

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.rays.depth import NOTHING
from umbra.receivers.seen import ViewTile
from umbra.scene.derived import derive
from umbra.scene.grid import Grid
from umbra.study import Study
from umbra.writers.picture_content import Appearance
from umbra.writers.pixels import resample

__all__ = ["find_breaks", "find_grid_appearance", "find_height_appearance"]

JUMP, CREASE = 0.92, 0.5  # opacity of lines
BEND = math.cos(math.radians(20.0))  # normals further apart than this make a crease
STEP = 2.0  # least depth difference of a jump [sampled pixels]
CROWDED = 0.22  # share of pixels with creases above which they fade: leaves of a tree
THRONGED = 0.5  # share of pixels with jumps above which they fade
FINER = 2.0  # sampled pixels per pixel of the picture, along each side, or somewhat fewer
_ENOUGH = 0.9  # share of these that saves a further cut of every cell
_KEPT = 5_000_000  # most cells whose edges are kept for another picture
_LEVEL = 1e-9  # largest z of a level unit vector
RELIEF = 1.0  # least step in a plan's heights that is an edge [m]

_Marks = tuple[
    NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_] | None
]  # shade, jumps, creases, sky


def find_grid_appearance(
    study: Study, size: tuple[int, int], grid: Grid | None = None, finer: float = FINER
) -> Appearance | None:
    """
    Find the appearance of a study's receivers, or of a part of their grid, in pixels.

    None of a level plane, which has neither shade nor edges. Edges are looked for on about
    ``finer`` cells a pixel, and kept for a picture of another size.
    """
    if study.kind.is_level:
        return None
    grid = grid or study.grid
    times = max(1, math.ceil(_ENOUGH * finer * max(size) / max(grid.rows, grid.cols)))
    fine = grid.coarser(round(2 * finer * max(size))).finer(times)
    marks = derive(
        study.model, "marks", fine, lambda: _mark(study, fine), 1, lambda m: m[0].size <= _KEPT
    )
    return _compose(*marks, size)


def find_height_appearance(
    heights: NDArray[np.float32], cell: float, size: tuple[int, int]
) -> Appearance:
    """Find the appearance of a plan's heights, (rows, cols); NaN lies as low as the lowest."""
    relief = np.nan_to_num(heights - np.nanmin(heights, initial=np.inf)).astype(np.float64)
    return _compose(*_read_relief(relief, cell, _find_rough(relief)), None, size)


def find_breaks(study: Study) -> NDArray[np.bool_]:
    """Return which of a study's own cells lie at an edge of a surface, (rows, cols)."""
    _, jumps, creases, _ = _mark(study, study.grid)
    return jumps | creases


def _mark(study: Study, grid: Grid) -> _Marks:
    """Return the shade, jumps and creases of a study's surfaces on a grid, and a view's sky."""
    tile = study.model.make_tile(grid)
    if isinstance(tile, ViewTile):
        return *_read_view(tile), ~tile.is_seen
    heights = tile.relief
    shade, jumps, creases = _read_relief(heights, min(grid.dx, grid.dy), _find_rough(heights))
    if tile.nothing.any():
        _mark_rim(tile.nothing, jumps)
    return shade, jumps, creases & ~jumps, None


def _mark_rim(nothing: NDArray[np.bool_], jumps: NDArray[np.bool_]) -> None:
    """Mark the border of a plan's surfaces, also where the ground beyond would be as high."""
    for cells, marks in ((nothing, jumps), (nothing.T, jumps.T)):
        rim = cells[1:] != cells[:-1]
        marks[1:] |= rim
        marks[:-1] |= rim


def _read_view(tile: ViewTile) -> tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the shade, jumps and creases of a camera's view."""
    frame, camera = tile.frame, tile.camera
    right, up, forward = camera.axes()
    is_level = abs(forward[2]) < _LEVEL
    reference = -forward if is_level else np.array([0.0, 0.0, 1.0])
    lamp = -0.5 * right + 0.6 * up - 0.62 * forward
    pixel = float(camera.height or 0.0) / camera.size[1]
    deeper = 0 * forward
    if camera.is_perspective:  # pixels grow with the distance from the eye
        deeper = 2 * math.tan(math.radians(camera.fov) / 2) / camera.size[1] * forward
    return _mark_view(
        frame.position[::-1], frame.normal[::-1], frame.part[::-1], camera.eye,
        STEP * pixel, STEP * deeper, lamp / (lamp @ reference),
    )  # fmt: skip


@kernel
def _mark_view(
    position: NDArray[np.float64],
    normal: NDArray[np.float64],
    part: NDArray[np.int32],
    eye: NDArray[np.float64],
    step: float,
    deeper: NDArray[np.float64],
    lamp: NDArray[np.float64],
) -> tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_]]:
    """Shade and mark a view; a jump is ``step`` high, and ``deeper`` of the way from the eye."""
    rows, cols = part.shape
    shade = np.ones((rows, cols), np.float32)
    jumps, creases = np.zeros((rows, cols), np.bool_), np.zeros((rows, cols), np.bool_)
    for i in range(rows):
        for j in range(cols):
            p, n, is_seen = position[i, j], normal[i, j], part[i, j] != NOTHING
            least, facing = step, 0.0
            for k in range(3):
                least += deeper[k] * (p[k] - eye[k])
                facing += n[k] * lamp[k]
            if is_seen:
                shade[i, j] = _darken(facing)
            for y, x in ((i + 1, j), (i, j + 1)):
                if y == rows or x == cols:
                    continue
                is_jump = is_seen != (part[y, x] != NOTHING)
                if is_seen and not is_jump:
                    # Distance of each of two neighbours from the other's plane: 0 if coplanar,
                    # at any slant.
                    here = there = alike = 0.0
                    for k in range(3):
                        here += (position[y, x, k] - p[k]) * n[k]
                        there += (position[y, x, k] - p[k]) * normal[y, x, k]
                        alike += n[k] * normal[y, x, k]
                    is_jump = min(abs(here), abs(there)) > least
                    creases[i, j] |= not is_jump and (alike < BEND or part[i, j] != part[y, x])
                if is_jump:
                    jumps[i, j] = jumps[y, x] = True
    return shade, jumps, creases & ~jumps


@kernel
def _darken(facing: float) -> float:
    """
    Shade by how much more or less than its reference a surface faces the lamp: 1 none, 0 deepest.

    Nothing is brighter than the legend: what faces the lamp more is shaded too, so that a roof
    stands out from the ground whichever way it slopes.
    """
    return min(max(1 - abs(1 - facing), 0.0), 1.0)


def _find_rough(heights: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return the cells that have any but level squares of four cells around them, two cells far."""
    rough = np.zeros(heights.shape, np.bool_)
    if min(heights.shape) > 1:
        up, right = heights[1:] != heights[:-1], heights[:, 1:] != heights[:, :-1]
        square = up[:, 1:] | up[:, :-1] | right[1:]
        tall = np.zeros((len(heights), square.shape[1]), np.bool_)
        for wide, source in ((tall, square), (rough.T, tall.T)):
            wide[:-1] |= source
            wide[1:] |= source
            wide[:-2] |= source[1:]
    return rough


@kernel
def _read_relief(
    heights: NDArray[np.float64], cell: float, rough: NDArray[np.bool_]
) -> tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the shade, jumps and creases of a plan's heights; only rough cells have any."""
    rows, cols = heights.shape
    shade = np.ones((rows, cols), np.float32)
    jumps, creases = np.zeros((rows, cols), np.bool_), np.zeros((rows, cols), np.bool_)
    if min(rows, cols) < 2:
        return shade, jumps, creases
    is_smooth = _find_walls(heights, max(RELIEF, 2 * cell), jumps, rough)
    for i in range(rows):
        south, north = max(i - 1, 0), min(i + 1, rows - 1)
        for j in range(cols):
            if not rough[i, j] or jumps[i, j]:  # a wall seen from above is not a shaded roof
                continue
            west, east = max(j - 1, 0), min(j + 1, cols - 1)
            up, across = heights[north, j] - heights[south, j], heights[i, east] - heights[i, west]
            if up or across:  # the shade of level ground is 1, and needs no root
                up, across = up / ((north - south) * cell), across / ((east - west) * cell)
                # Rows ascend northward: what falls to the upper left (-x, +y) faces the lamp.
                facing = 1 + (across - up) * 0.5 / math.sqrt(2.0)
                shade[i, j] = _darken(facing / math.sqrt(1 + up**2 + across**2))
            # Two squares that lie one apart are compared, since one that holds a crease has a
            # slope between those of its sides.
            if is_smooth[i, j + 1] and is_smooth[i + 2, j + 1]:
                creases[i, j] |= _is_bent(heights, cell, (i - 1, j), (i + 1, j))
            if is_smooth[i + 1, j] and is_smooth[i + 1, j + 2]:
                creases[i, j] |= _is_bent(heights, cell, (i, j - 1), (i, j + 1))
    return shade, jumps, creases


@kernel
def _find_walls(
    heights: NDArray[np.float64], least: float, jumps: NDArray[np.bool_], rough: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """
    Mark the jumps in height, and return which squares between four cells have none.

    The square beyond cell i, j is at i + 1, j + 1 of (rows + 2, cols + 2); none lies outside.
    """
    rows, cols = heights.shape
    is_smooth = np.zeros((rows + 2, cols + 2), np.bool_)
    is_smooth[1:rows, 1:cols] = True
    for i in range(rows):
        for j in range(cols):
            if not rough[i, j]:
                continue
            for up, right in ((1, 0), (0, 1)):
                rise = _find_step(heights, i, j, up, right)
                if abs(rise) > least:
                    # A steep roof rises by as much from cell to cell; a wall's neighbours do not.
                    before = _find_step(heights, i - up, j - right, up, right)
                    after = _find_step(heights, i + up, j + right, up, right)
                    if min(abs(rise - before), abs(rise - after)) > least:
                        jumps[i, j] = jumps[i + up, j + right] = True
                        is_smooth[i + 1, j + 1] = is_smooth[i + up, j + right] = False
    return is_smooth


@kernel
def _find_step(heights: NDArray[np.float64], i: int, j: int, up: int, right: int) -> float:
    """Return the rise from a cell to the next; 0 across the border."""
    rows, cols = heights.shape
    if i < 0 or j < 0 or i + up >= rows or j + right >= cols:
        return 0.0
    return heights[i + up, j + right] - heights[i, j]


@kernel
def _is_bent(
    heights: NDArray[np.float64], cell: float, pair: tuple[int, int], other: tuple[int, int]
) -> bool:
    """Return whether the normals of two squares between four cells are far apart."""
    a, b = _find_rise(heights, pair)
    c, d = _find_rise(heights, other)
    if a == c and b == d:  # as on level ground
        return False
    flat = 4 * cell**2  # what is level of two normals; what rises is of two rows or columns
    return flat + a * c + b * d < BEND * math.sqrt((flat + a**2 + b**2) * (flat + c**2 + d**2))


@kernel
def _find_rise(heights: NDArray[np.float64], square: tuple[int, int]) -> tuple[float, float]:
    """Return the sums of two rises across and up on the square beyond a cell."""
    i, j = square
    a, b, c, d = heights[i, j], heights[i, j + 1], heights[i + 1, j], heights[i + 1, j + 1]
    return b - a + d - c, c - a + d - b


def _widen(mask: NDArray[np.bool_], width: int) -> NDArray[np.bool_]:
    """Make lines of two pixels twice as many pixels wide as they were."""
    for _ in range(width - 1):
        wide = np.pad(mask, 1)
        mask = wide[1:-1, 1:-1] | wide[:-2, 1:-1] | wide[1:-1, :-2]
    return mask


def _compose(
    shade: NDArray,
    jumps: NDArray[np.bool_],
    creases: NDArray[np.bool_],
    sky: NDArray[np.bool_] | None,
    size: tuple[int, int],
) -> Appearance:
    """Resize shade and lines to a picture."""
    jumps = _widen(jumps, max(1, round(len(jumps) / size[0] / FINER)))
    ink, fine = resample(jumps, size), resample(creases, size)
    lines = np.maximum(JUMP * ink * _fade(ink, THRONGED), CREASE * fine * _fade(fine, CROWDED))
    bright = resample(shade, size)

    def pack(values: NDArray) -> NDArray[np.uint8]:
        return (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)

    return Appearance(
        pack(bright), pack(lines), pack(ink), pack(fine),
        None if sky is None else pack(resample(sky, size)),
    )  # fmt: skip


def _fade(edges: NDArray[np.float32], crowded: float) -> NDArray[np.float32]:
    """Return the opacity of edges, by their share of each pixel: less where they are crowded."""
    rows, cols = edges.shape
    crowd = resample(resample(edges, (max(1, rows // 8), max(1, cols // 8))), edges.shape)
    return np.clip(2 - crowd / crowded, 0.15, 1).astype(np.float32)
