"""
The heights of a plot as one closed mesh.

Walls meet at the corners of cells, where each wall has a vertex at the height of every cell around,
so that each edge has two faces. Where two cells touch along an upright edge alone, one of them is
drawn back from it by a millimetre: the mesh then stays a solid, and is never larger than the boxes.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.massing.plot import Plot
from umbra.scene import Mesh

__all__ = ["make_solid"]

_BACK = 1e-3  # by which a cell draws back from an edge [m], at most a quarter of its side
_LOWEST = 1e-3  # lower boxes are left out [m]


def make_solid(plot: Plot, tops: NDArray[np.float64]) -> Mesh | None:
    """
    Make the mesh of boxes from the plot's lowest ground up to the tops of its cells.

    Parameters
    ----------
    plot : Plot
    tops : (n_cells,) float64
        Local frame [m].

    Returns
    -------
    mesh : Mesh or None
        Closed, wound outward; None where nothing stands.
    """
    stands = tops > plot.ground + _LOWEST
    if not stands.any():
        return None
    base = float(plot.foot[stands].min())
    raster = np.full(np.array(plot.index.shape) + 2, base)
    rows, cols = plot.places
    raster[rows + 1, cols + 1] = np.where(stands, tops, base)
    back = min(_BACK, plot.cell / 4)
    vertices, faces = _build(raster, base, plot.x0, plot.y0, plot.cell, back)
    used, index = np.unique(faces, return_inverse=True)
    return Mesh(vertices[used], index.reshape(-1, 3).astype(np.int32))


@kernel
def _build(raster, base, x0, y0, side, back):
    """Build the faces; the raster (rows + 2, cols + 2) has an empty margin."""
    rows, cols = raster.shape[0] - 1, raster.shape[1] - 1  # corners of cells
    levels = np.full((rows, cols, 5), np.inf)
    vertices = np.zeros((rows * cols * 10, 3))
    # The cell that draws back at a corner (0 to 3, from south-west, in rows), above which height.
    who = np.full((rows, cols), -1, np.int64)
    above = np.zeros((rows, cols))
    for r in range(rows):
        for c in range(cols):
            around = (raster[r, c], raster[r, c + 1], raster[r + 1, c], raster[r + 1, c + 1])
            steps = np.sort(np.array([base, around[0], around[1], around[2], around[3]]))
            count = 0
            for z in steps:
                if count == 0 or z > levels[r, c, count - 1]:
                    levels[r, c, count] = z
                    count += 1
            for one, two, three, four in ((0, 3, 1, 2), (1, 2, 0, 3)):
                low = max(around[three], around[four])
                if min(around[one], around[two]) > low:
                    who[r, c] = one
                    above[r, c] = low
            x, y = x0 + c * side, y0 + r * side
            for k in range(count):
                for drawn in range(2):
                    at = ((r * cols + c) * 5 + k) * 2 + drawn
                    vertices[at, 0], vertices[at, 1], vertices[at, 2] = x, y, levels[r, c, k]
                    if drawn and who[r, c] >= 0 and levels[r, c, k] > above[r, c]:
                        vertices[at, 0] += back if who[r, c] % 2 else -back
                        vertices[at, 1] += back if who[r, c] >= 2 else -back
    faces = np.zeros((raster.size * 4 * 10, 3), np.int64)
    n = 0
    chain = np.zeros((2, 5), np.int64)
    height = np.zeros((2, 5))
    size = np.zeros(2, np.int64)
    # Corners of a cell counter-clockwise, each as row, column and the cell's own place there.
    for r in range(1, raster.shape[0] - 1):
        for c in range(1, raster.shape[1] - 1):
            top = raster[r, c]
            if top <= base:
                continue
            ring = ((r - 1, c - 1, 3), (r - 1, c, 2), (r, c, 0), (r, c - 1, 1))
            beside = (raster[r - 1, c], raster[r, c + 1], raster[r + 1, c], raster[r, c - 1])
            for z, turned in ((top, False), (base, True)):
                a = _find(levels, who, above, cols, ring[0], z)
                b = _find(levels, who, above, cols, ring[1], z)
                d = _find(levels, who, above, cols, ring[2], z)
                e = _find(levels, who, above, cols, ring[3], z)
                if turned:
                    b, e = e, b
                faces[n, 0], faces[n, 1], faces[n, 2] = a, b, d
                faces[n + 1, 0], faces[n + 1, 1], faces[n + 1, 2] = a, d, e
                n += 2
            for k in range(4):
                if beside[k] >= top:
                    continue
                for end in range(2):
                    corner = ring[(k + end) % 4]
                    size[end] = 0
                    for z in levels[corner[0], corner[1]]:
                        if beside[k] <= z <= top:
                            chain[end, size[end]] = _find(levels, who, above, cols, corner, z)
                            height[end, size[end]] = z
                            size[end] += 1
                i = j = 0
                while i + 1 < size[0] or j + 1 < size[1]:
                    up = j + 1 >= size[1] or (
                        i + 1 < size[0] and height[0, i + 1] <= height[1, j + 1]
                    )
                    faces[n, 0], faces[n, 1] = chain[0, i], chain[1, j]
                    if up:
                        i += 1
                        faces[n, 2] = chain[0, i]
                    else:
                        j += 1
                        faces[n, 2] = chain[1, j]
                    n += 1
    return vertices, faces[:n]


@kernel
def _find(levels, who, above, cols, corner, z):
    """Return the vertex of a corner at a height, as one of the cells around it has it."""
    r, c, cell = corner
    k = 0
    while levels[r, c, k] != z:
        k += 1
    drawn = 1 if who[r, c] == cell and z > above[r, c] else 0
    return ((r * cols + c) * 5 + k) * 2 + drawn
