"""
Finding the appearance of a view's surfaces: a soft shade, and their edges.

The shade falls on what turns from a lamp at the viewer's upper left; level ground, and in an
elevation the facade itself, keep the legend's colours. Lines are drawn where one surface ends
before another, and, finer, where two meet at an angle or two parts meet.
"""

import math

import numpy as np
from numpy.typing import NDArray

from umbra.rays.depth import NOTHING
from umbra.receivers.seen import ViewTile
from umbra.scene.grid import Grid
from umbra.study import Study
from umbra.writers.pixels import resample
from umbra.writers.plan import Appearance

__all__ = ["find_appearance", "find_breaks"]

JUMP, CREASE = 0.92, 0.5  # how much of a line's ink there is
BEND = math.cos(math.radians(20.0))  # normals further apart than this make a crease
STEP = 2.0  # pixels that a surface must stand before another, of those that are looked at
CROWDED = 0.22  # share of pixels with creases, above which they fade: leaves of a tree
THRONGED = 0.5  # share of pixels with jumps, above which they fade, too
FINER = 2  # pixels looked at for one of the picture, along each side
_LEVEL = 1e-9  # of a unit vector that lies level
RELIEF = 1.0  # least step in a plan's heights that is an edge [m]


def find_appearance(
    study: Study, size: tuple[int, int], grid: Grid | None = None
) -> Appearance | None:
    """
    Find the appearance of a study's receivers, or of a part of their grid, in a picture's pixels.

    None of a level plane, which has neither shade nor edges.
    """
    if study.kind.is_level:
        return None
    grid = grid or study.grid
    times = max(1, math.ceil(FINER * max(size) / max(grid.rows, grid.cols)))
    fine = grid.coarser(2 * FINER * max(size)).finer(times)
    tile = study.model.make_tile(fine)
    if isinstance(tile, ViewTile):
        return _find_seen_appearance(tile, size)
    return _find_plan_appearance(tile.relief, min(fine.dx, fine.dy), size)


def find_breaks(study: Study) -> NDArray[np.bool_]:
    """Tell which of a study's own cells lie at an edge of a surface, (rows, cols)."""
    tile = study.model.make_tile(study.grid)
    if isinstance(tile, ViewTile):
        jumps, creases = _find_edges(*_read(tile))
    else:
        jumps, creases = _find_plan_edges(tile.relief, min(study.grid.dx, study.grid.dy))
    return jumps | creases


def _find_seen_appearance(tile: ViewTile, size: tuple[int, int]) -> Appearance:
    """Find the appearance of what a camera sees."""
    camera = tile.camera
    position, normal, part, is_seen, step = _read(tile)
    jumps, creases = _find_edges(position, normal, part, is_seen, step)
    right, up, forward = camera.axes()
    is_level = abs(forward[2]) < _LEVEL
    reference = -forward if is_level else np.array([0.0, 0.0, 1.0])
    lamp = -0.5 * right + 0.6 * up - 0.62 * forward
    facing = normal @ (lamp / (lamp @ reference))
    shade = np.where(is_seen, _darken(facing), 1)
    width = max(1, round(len(part) / size[0] / FINER))
    return _compose(shade, _widen(jumps, width), creases, size, ~is_seen)


def _read(tile: ViewTile) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray | float]:
    """Give positions from the eye, normals, parts, where anything is seen, and what is a step."""
    frame, camera = tile.frame, tile.camera
    position = np.nan_to_num(frame.position[::-1] - camera.eye)
    part = frame.part[::-1]
    pixel: NDArray | float = float(camera.height or 0.0) / camera.size[1]
    if camera.is_perspective:
        across = 2 * math.tan(math.radians(camera.fov) / 2) / camera.size[1]
        pixel = across * (position @ camera.axes()[2])
    return position, np.nan_to_num(frame.normal[::-1]), part, part != NOTHING, pixel * STEP


def _darken(facing: NDArray) -> NDArray:
    """
    Shade by how much more or less than its reference a surface faces the lamp: 1 none, 0 deepest.

    Nothing is brighter than the legend: what faces the lamp more is shaded too, so that a roof
    stands out from the ground whichever way it slopes.
    """
    return np.clip(1 - np.abs(1 - facing), 0, 1)


def _find_edges(
    position: NDArray, normal: NDArray, part: NDArray, is_seen: NDArray, step: NDArray | float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell which pixels lie at a jump from surface to surface, and which at a crease."""
    jumps, creases = np.zeros((2, *part.shape), np.bool_)
    least = np.broadcast_to(step, part.shape)
    for a, b in (
        (np.s_[:-1], np.s_[1:]),
        (np.s_[:, :-1], np.s_[:, 1:]),
    ):
        gap = position[b] - position[a]
        # How far each of two neighbours stands off the other's plane: on one plane, 0 at any slant.
        off = np.minimum(
            np.abs(np.einsum("ijk,ijk->ij", gap, normal[a])),
            np.abs(np.einsum("ijk,ijk->ij", gap, normal[b])),
        )
        both = is_seen[a] & is_seen[b]
        jump = (both & (off > least[a])) | (is_seen[a] != is_seen[b])
        bend = np.einsum("ijk,ijk->ij", normal[a], normal[b]) < BEND
        jumps[a] |= jump
        jumps[b] |= jump
        creases[a] |= both & ~jump & (bend | (part[a] != part[b]))
    return jumps, creases & ~jumps


def _find_plan_appearance(
    heights: NDArray[np.float64], cell: float, size: tuple[int, int]
) -> Appearance:
    """Find the appearance of a plan's heights above the ground."""
    down, across = np.gradient(heights, cell) if min(heights.shape) > 1 else (0 * heights,) * 2
    steep = np.sqrt(1 + down**2 + across**2)
    # Rows ascend northward: what falls toward the upper left (-x, +y) faces the lamp.
    facing = ((across - down) * 0.5 / math.sqrt(2) + 1) / steep
    shade = _darken(facing)
    jumps, creases = _find_plan_edges(heights, cell)
    shade[jumps] = 1  # a wall seen from above is no roof in the shade
    width = max(1, round(len(heights) / size[0] / FINER))
    return _compose(shade, _widen(jumps, width), creases, size)


def _find_plan_edges(
    heights: NDArray[np.float64], cell: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell which cells of a plan lie at a jump in height, and which at a crease of the surface."""
    jumps, creases = np.zeros((2, *heights.shape), np.bool_)
    if min(heights.shape) < 2:
        return jumps, creases
    least = max(RELIEF, 2 * cell)
    is_smooth = np.ones((heights.shape[0] - 1, heights.shape[1] - 1), np.bool_)
    # Both axes as rows, of views that write through.
    for h, found, smooth in (
        (heights, jumps, is_smooth),
        (heights.T, jumps.T, is_smooth.T),
    ):
        rise = np.pad(np.diff(h, axis=0), ((1, 1), (0, 0)))
        here = rise[1:-1]
        # A steep roof rises by as much from cell to cell; a wall's neighbours do not.
        off = np.minimum(np.abs(here - rise[:-2]), np.abs(here - rise[2:]))
        jump = (np.abs(here) > least) & (off > least)
        found[:-1] |= jump
        found[1:] |= jump
        smooth[...] &= ~(jump[:, :-1] | jump[:, 1:])
    # Normals of the squares between four cells; two that lie one apart are compared, since one
    # that holds a crease has a slope between those of its sides.
    h = heights / cell
    across = (h[:-1, 1:] - h[:-1, :-1] + h[1:, 1:] - h[1:, :-1]) / 2
    up = (h[1:, :-1] - h[:-1, :-1] + h[1:, 1:] - h[:-1, 1:]) / 2
    normal = np.stack([across, up, np.ones_like(up)]) / np.sqrt(1 + across**2 + up**2)
    for n, found, smooth in (
        (normal, creases, is_smooth),
        (normal.transpose(0, 2, 1), creases.T, is_smooth.T),
    ):
        bend = np.einsum("kij,kij->ij", n[:, :-2], n[:, 2:]) < BEND
        found[1:-2, :-1] |= bend & smooth[:-2] & smooth[2:]
    return jumps, creases & ~jumps


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
    size: tuple[int, int],
    sky: NDArray[np.bool_] | None = None,
) -> Appearance:
    """Bring shade and lines to a picture's size."""
    ink, fine = resample(jumps, size), resample(creases, size)
    lines = np.maximum(
        JUMP * ink * _fade(jumps, size, THRONGED), CREASE * fine * _fade(creases, size, CROWDED)
    )
    bright = resample(shade.astype(np.float32), size)

    def pack(values: NDArray) -> NDArray[np.uint8]:
        return (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)

    return Appearance(
        pack(bright), pack(lines), pack(ink), pack(fine),
        None if sky is None else pack(resample(sky, size)),
    )  # fmt: skip


def _fade(edges: NDArray[np.bool_], size: tuple[int, int], crowded: float) -> NDArray[np.float32]:
    """Give how much of their ink edges keep: less where they would cover the surface."""
    crowd = resample(resample(edges, (max(1, size[0] // 8), max(1, size[1] // 8))), size)
    return np.clip(2 - crowd / crowded, 0.15, 1).astype(np.float32)
