"""
Canopy rasters: a closed body between the trunk zone and the tree tops.

Each cell with a height is a column over its square, from the crown's base to its height;
adjacent columns share no wall, so that the body is closed and casts as one. Walls of
different heights that meet at a corner share vertices there: two faces that share an edge
share all of it.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.kernels import kernel
from umbra.readers.model import CrownRaster
from umbra.scene import Mesh, Part

__all__ = ["stand_crowns"]


def stand_crowns(part: Part, crowns: CrownRaster, ground: NDArray[np.float64]) -> tuple[Part, int]:
    """
    Make the body of a canopy over the ground (n_cells,) [m]; count the cells without one.

    The part is that of ``read_raster``, its corners in any coordinates.
    """
    high = crowns.tops if crowns.is_absolute else ground + crowns.tops
    if crowns.trunk is None:
        low = ground + crowns.share * (high - ground)
    else:
        low = np.maximum(ground, crowns.trunk if crowns.is_absolute else ground + crowns.trunk)
    is_body = high > low
    if not is_body.any():
        msg = "has no crown above the ground and its trunk zone" + (
            "; if heights are above the ground, leave canopy_heights='absolute' out"
            if crowns.is_absolute
            else ""
        )
        raise InputError(msg, option="canopy_heights")
    plan = part.mesh.vertices[:, :2]
    a, b, c = (plan[crowns.corners[0, k]] for k in range(3))
    (ux, uy), (vx, vy) = b - a, c - b
    is_left = bool(ux * vy - uy * vx > 0)
    corner, z = make_body(crowns.cells, crowns.corners, low, high, is_left)
    order = np.lexsort((z, corner))
    is_first = np.ones(len(order), np.bool_)
    is_first[1:] = (np.diff(corner[order]) != 0) | (np.diff(z[order]) != 0)
    unique = order[is_first]
    index = np.zeros(len(order), np.int32)
    index[order] = np.cumsum(is_first, dtype=np.int32) - 1
    vertices = np.column_stack([plan[corner[unique]], z[unique]])
    body = Part(part.name, part.kind, Mesh(vertices, index.reshape(-1, 3)), layer=part.layer)
    return body, int((~is_body).sum())


def make_body(
    cells: NDArray[np.int32],
    corners: NDArray[np.int32],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    is_left: bool,
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """
    Make the triangles of columns that share no walls.

    ``cells`` (rows, cols) has the index of each cell's column, -1 for none; ``corners`` (n, 4) are
    those about it in the order of `CrownRaster`, counter-clockwise in the plan if ``is_left``. A
    column goes from ``low`` to ``high`` (n,) [m]; there is none where high <= low. Returned are
    the plan's corner and the height of the triangles' vertices, (3 * n_triangles,) each,
    counter-clockwise seen from outside.
    """
    count = _fill(cells, corners, low, high, is_left, np.zeros(0, np.int32), np.zeros(0))
    corner, z = np.zeros(3 * count, np.int32), np.zeros(3 * count)
    _fill(cells, corners, low, high, is_left, corner, z)
    return corner, z


@kernel
def _fill(cells, corners, low, high, is_left, corner, z):
    """Write the triangles if there is room; return their number."""
    rows, cols = cells.shape
    down = (-1, 0, 1, 0)
    right = (0, 1, 0, -1)
    left_z = np.empty(10)
    right_z = np.empty(10)
    n = 0
    for r in range(rows):
        for c in range(cols):
            i = cells[r, c]
            if i < 0 or not high[i] > low[i]:
                continue
            a = corners[i]
            one, two, three = (1, 2, 3) if is_left else (3, 2, 1)
            for first, second in ((one, two), (two, three)):
                n = _add(corner, z, n, a[0], high[i], a[first], high[i], a[second], high[i])
                n = _add(corner, z, n, a[0], low[i], a[second], low[i], a[first], low[i])
            for side in range(4):
                p, q = (side, (side + 1) % 4) if is_left else ((side + 1) % 4, side)
                j = -1
                y, x = r + down[side], c + right[side]
                if 0 <= y < rows and 0 <= x < cols:
                    j = cells[y, x]
                if j < 0 or not high[j] > low[j]:
                    spans = ((low[i], high[i]), (0.0, 0.0))
                else:
                    spans = ((low[i], min(high[i], low[j])), (max(low[i], high[j]), high[i]))
                for start, end in spans:
                    if not end > start:
                        continue
                    m = _find_levels(cells, low, high, r, c, p, start, end, left_z)
                    k = _find_levels(cells, low, high, r, c, q, start, end, right_z)
                    # Triangulate a strip whose two sides have different vertices.
                    s = t = 0
                    while s < m - 1 or t < k - 1:
                        zs, zt = left_z[s], right_z[t]
                        if t == k - 1 or (s < m - 1 and left_z[s + 1] <= right_z[t + 1]):
                            s += 1
                            n = _add(corner, z, n, a[p], zs, a[q], zt, a[p], left_z[s])
                        else:
                            t += 1
                            n = _add(corner, z, n, a[p], zs, a[q], zt, a[q], right_z[t])
    return n


@kernel
def _add(corner, z, n, i, zi, j, zj, k, zk):
    if corner.size:
        corner[3 * n], corner[3 * n + 1], corner[3 * n + 2] = i, j, k
        z[3 * n], z[3 * n + 1], z[3 * n + 2] = zi, zj, zk
    return n + 1


@kernel
def _find_levels(cells, low, high, r, c, which, start, end, levels):
    """List the heights, ascending, at which columns about a corner begin or end in a span."""
    levels[0] = start
    n = 1
    down = 1 if which >= 2 else 0
    right = 1 if which in (1, 2) else 0
    for y in range(r + down - 1, r + down + 1):
        for x in range(c + right - 1, c + right + 1):
            if not (0 <= y < cells.shape[0] and 0 <= x < cells.shape[1]):
                continue
            j = cells[y, x]
            if j < 0 or not high[j] > low[j]:
                continue
            for level in (low[j], high[j]):
                if not start < level < end or (levels[:n] == level).any():
                    continue
                k = n
                while levels[k - 1] > level:
                    levels[k] = levels[k - 1]
                    k -= 1
                levels[k] = level
                n += 1
    levels[n] = end
    return n + 1
