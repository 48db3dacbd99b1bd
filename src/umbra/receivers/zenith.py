"""Topmost surface of a model: the face visible from the zenith in each cell."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.cpu.height_field import Slopes
from umbra.rays.depth import NOTHING, DepthBuffer, rasterise_depth
from umbra.scene import Triangles
from umbra.scene.derived import derive
from umbra.scene.grid import ASIDE, Grid

__all__ = ["Surface", "find_surface"]

_INWARD = (2.0**-10, 0.618 * 2.0**-10)
"""
Offset of the sample point of a rim cell from its centre [cells], large enough for a ray to
separate its face from neighbouring faces that meet in the centre.
"""
_AT_ONCE = 2**18  # faces whose bounds are held in memory


@dataclass(frozen=True, eq=False)
class Surface:
    """
    Topmost surface of a model over its ground, sampled ``ASIDE`` of the cells' centres.

    Parameters
    ----------
    heights : (rows, cols) float64
        z of the topmost surface, or of the ground if higher; local frame [m].
    slopes : Slopes
        Cells whose surface is not level and can face away from the sun.
    face : (rows, cols) int32
        Face of the soup; ``NOTHING`` on the ground.
    rim : (n,) int64
        Flat indices of the cells whose centres lie on the eastern or northern edge of the
        visible surface.
    inward : (n, 2) float64
        Offsets of their sample points from the centres [cells].
    """

    heights: NDArray[np.float64]
    slopes: Slopes
    face: NDArray[np.int32]
    rim: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    inward: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))


def find_surface(
    soup: Triangles, grid: Grid, ground: float, threads: int = 1, *, has_end: bool = False
) -> Surface:
    """
    Find a model's topmost surface.

    Parameters
    ----------
    soup : Triangles
    grid : Grid
        In the local frame.
    ground : float
        z of the ground plane, local frame [m].
    threads : int
    has_end : bool
        Whether cells on the surface's edge belong to it, as there is no ground.

    Returns
    -------
    surface : Surface
    """
    view = _look_down(soup, grid, ground, threads, ASIDE)
    rim, inward = np.zeros(0, np.int64), np.zeros((0, 2))
    if has_end:
        near = _find_near(soup, grid, view.face == NOTHING)
        there = replace(soup, faces=soup.faces[near], part=soup.part[near])
        for way in ((-1, -1), (1, -1), (-1, 1)) if len(near) else ():
            aside = np.multiply(_INWARD, way)
            again = _look_down(there, grid, ground, threads, aside)
            filled = (view.face == NOTHING) & (again.face != NOTHING)
            view.key[filled], view.face[filled] = again.key[filled], near[again.face[filled]]
            rim = np.append(rim, np.flatnonzero(filled))
            inward = np.append(inward, np.tile(aside, (len(rim) - len(inward), 1)), 0)
    seen = np.flatnonzero(view.face.ravel() != NOTHING)
    faces, owner = _list_once(view.face.ravel()[seen], len(soup.faces))
    a, b, c = (soup.vertices[soup.faces[faces, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    # The visible side decides, for either winding.
    normals *= np.where(normals[:, 2:] < 0, -1.0, 1.0)
    level = (normals[:, :2] == 0).all(1)
    sloping = ~level[owner]
    # Level faces take their corners' exact height, which interpolation rounds.
    np.put(view.key, seen[~sloping], a[:, 2][owner[~sloping]])
    planes = np.zeros((4, len(faces)))
    planes[:3] = normals.T
    return Surface(
        view.key, Slopes(seen[sloping], owner[sloping], planes), view.face,
        rim, inward,
    )  # fmt: skip


def _list_once(
    numbers: NDArray[np.int32], count: int
) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Return the numbers below ``count`` that occur, sorted, and which of them each one is."""
    occurs = np.zeros(count, np.bool_)
    occurs[numbers] = True
    position = np.cumsum(occurs, dtype=np.int32) - np.int32(1)
    return np.flatnonzero(occurs), position[numbers]


def _find_near(soup: Triangles, grid: Grid, empty: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return the faces whose bounding rectangles hold centres of empty cells."""
    sums = np.zeros((grid.rows + 1, grid.cols + 1), np.int32)
    sums[1:, 1:] = empty.cumsum(0, dtype=np.int32).cumsum(1, dtype=np.int32)
    cells = grid.to_cells(soup.vertices)[:, :2] - (grid.col, grid.row)
    shape = (grid.cols, grid.rows)
    near = [np.zeros(0, np.int32)]
    for first in range(0, len(soup.faces), _AT_ONCE):
        corners = cells[soup.faces[first : first + _AT_ONCE]]
        low = np.ceil(corners.min(1) - 1e-6)
        high = np.floor(corners.max(1) + 1e-6) + 1
        x0, y0 = np.clip(low, 0, shape).astype(np.int32).T
        x1, y1 = np.clip(high, 0, shape).astype(np.int32).T
        held = sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0]
        near.append(first + np.flatnonzero((held > 0) & (x1 > x0) & (y1 > y0)).astype(np.int32))
    return np.concatenate(near)


def _look_down(
    soup: Triangles, grid: Grid, ground: float, threads: int, aside: ArrayLike
) -> DepthBuffer:
    """Find the topmost faces at an offset from the cells' centres [cells]."""
    east, north = np.asarray(aside, np.float64).tolist()
    matrix = np.array(
        [
            [1 / grid.dx, 0, 0, -grid.x0 / grid.dx - east],
            [0, 1 / grid.dy, 0, -grid.y0 / grid.dy - north],
            [0, 0, 0, 1],
            [0, 0, 1, 0],
        ]
    )
    size = (grid.cols, grid.rows)
    shown = derive(soup, "faces with a plan", None, lambda: _find_plans(soup))
    view = rasterise_depth(
        soup.vertices,
        soup.faces[shown],
        matrix,
        size,
        (ground, np.inf),
        threads,
        (grid.col, grid.row),
    )
    is_seen = view.face != NOTHING
    view.face[is_seen] = shown[view.face[is_seen]]
    return view


def _find_plans(soup: Triangles) -> NDArray[np.int32]:
    """Return the faces without corners above each other, so without walls."""
    plans = [soup.vertices[soup.faces[:, k], :2] for k in range(3)]
    is_upright = np.zeros(len(soup.faces), np.bool_)
    for k in range(3):
        is_upright |= (plans[k] == plans[k - 1]).all(1)
    return np.flatnonzero(~is_upright).astype(np.int32)
