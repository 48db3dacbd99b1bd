"""
The exact answer of a town's ground: a ray in float64 from each cell to each sun.

It shares nothing with the engines that it judges. Each triangle is asked only by the
cells that its shadow's bounds hold, which changes no answer and makes it quick enough
to ask again beside each cell, where a shadow's edge may pass.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.scene.grid import Grid

__all__ = ["Exact", "Mistakes", "find_exact"]

_PROBES = 16
"""Rays around each cell, at each of two distances."""


@dataclass(frozen=True)
class Mistakes:
    """
    How far an answer is from the exact one.

    Parameters
    ----------
    near : int
        Cells and instants that differ within half a cell's diagonal of a shadow's edge.
    wrong : int
        All others that differ.
    of : int
        How many were compared.
    mean_hours, most_hours : float
        Of a cell's hours of shadow, without sign [h].
    """

    near: int
    wrong: int
    of: int
    mean_hours: float
    most_hours: float


@dataclass(frozen=True, eq=False)
class Exact:
    """
    What is in shadow, and where edges are near.

    Parameters
    ----------
    masks : (n_suns, rows, cols) bool
        In shadow at the cell's centre.
    near : (n_suns, rows, cols) bool
        Whether some place within half a cell's diagonal of the centre has another answer.
    open : (rows, cols) bool
        The cells to compare: open ground.
    hours : float
        What an instant stands for [h].
    """

    masks: NDArray[np.bool_]
    near: NDArray[np.bool_]
    open: NDArray[np.bool_]
    hours: float

    def judge(self, masks: NDArray[np.bool_]) -> Mistakes:
        """
        Compare an answer.

        Parameters
        ----------
        masks : (n_suns, rows, cols) bool

        Returns
        -------
        mistakes : Mistakes
        """
        differ = (masks != self.masks) & self.open
        near = int((differ & self.near).sum())
        late = self.hours * np.abs(masks.sum(0) - self.masks.sum(0, dtype=np.int64))[self.open]
        return Mistakes(
            near, int(differ.sum()) - near, len(masks) * int(self.open.sum()),
            float(late.mean()), float(late.max()),
        )  # fmt: skip


def find_exact(
    corners: NDArray[np.float64],
    suns: NDArray[np.float64],
    grid: Grid,
    is_open: NDArray[np.bool_],
    hours: float,
) -> Exact:
    """
    Ask rays for the plane z = 0.

    Parameters
    ----------
    corners : (n_faces, 3, 3) float64
        Of the casting triangles [m].
    suns : (n_suns, 3) float64
        Directions toward the sun, above the horizon.
    grid : Grid
    is_open : (rows, cols) bool
        The cells to compare.
    hours : float
        What an instant stands for [h].

    Returns
    -------
    exact : Exact
    """
    masks = _ask(corners, suns, grid, 0.0, 0.0)
    near = np.zeros_like(masks)
    reach = np.hypot(grid.dx, grid.dy) / 2
    for angle in 2 * np.pi * np.arange(_PROBES) / _PROBES:
        for distance in (reach / 2, reach):
            beside = _ask(corners, suns, grid, distance * np.cos(angle), distance * np.sin(angle))
            near |= beside != masks
    return Exact(masks, near, is_open, hours)


def _ask(
    corners: NDArray[np.float64], suns: NDArray[np.float64], grid: Grid, aside: float, up: float
) -> NDArray[np.bool_]:
    """Ask all cells, each at its centre and so far to the east and to the north [m]."""
    masks = np.zeros((len(suns), grid.rows, grid.cols), np.bool_)
    _cast(corners, suns, grid.x0 + aside, grid.y0 + up, grid.dx, grid.dy, masks)
    return masks


@kernel
def _cast(corners, suns, x0, y0, dx, dy, masks):
    rows, cols = masks.shape[1:]
    for k in range(len(suns)):
        sx, sy, sz = suns[k]
        for face in range(len(corners)):
            a, b, c = corners[face]
            if max(a[2], b[2], c[2]) <= 0:
                continue
            # Where each corner falls on the plane: the shadow lies between.
            ax, bx, cx = a[0] - a[2] * sx / sz, b[0] - b[2] * sx / sz, c[0] - c[2] * sx / sz
            ay, by, cy = a[1] - a[2] * sy / sz, b[1] - b[2] * sy / sz, c[1] - c[2] * sy / sz
            west = max(int(np.floor((min(ax, bx, cx) - x0) / dx)), 0)
            east = min(int(np.ceil((max(ax, bx, cx) - x0) / dx)), cols - 1)
            south = max(int(np.floor((min(ay, by, cy) - y0) / dy)), 0)
            north = min(int(np.ceil((max(ay, by, cy) - y0) / dy)), rows - 1)
            # Möller and Trumbore: Fast, Minimum Storage Ray/Triangle Intersection. 1997.
            e, f = b - a, c - a
            px, py, pz = sy * f[2] - sz * f[1], sz * f[0] - sx * f[2], sx * f[1] - sy * f[0]
            across = e[0] * px + e[1] * py + e[2] * pz
            if across == 0:
                continue
            for row in range(south, north + 1):
                for col in range(west, east + 1):
                    if masks[k, row, col]:
                        continue
                    tx, ty, tz = x0 + col * dx - a[0], y0 + row * dy - a[1], -a[2]
                    u = (tx * px + ty * py + tz * pz) / across
                    if u < 0 or u > 1:
                        continue
                    qx, qy, qz = (
                        ty * e[2] - tz * e[1], tz * e[0] - tx * e[2], tx * e[1] - ty * e[0],
                    )  # fmt: skip
                    v = (sx * qx + sy * qy + sz * qz) / across
                    if v < 0 or u + v > 1:
                        continue
                    ahead = (f[0] * qx + f[1] * qy + f[2] * qz) / across
                    masks[k, row, col] = ahead > 0
