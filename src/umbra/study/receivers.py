"""What a plan's shadows fall on: the ground, or whatever is topmost."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.depth import NOTHING, see
from umbra.cpu.field import Slopes
from umbra.scene import Triangles
from umbra.scene.grid import Grid

__all__ = ["Places", "Surface", "find_surface"]


@dataclass(frozen=True, eq=False)
class Places:
    """
    Receivers as points.

    Parameters
    ----------
    points : (n, 3) float64
        In the scene's local frame [m].
    normals : (n, 3) float64
        Of the side of the surface that is seen.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]

    def find_reached(
        self, low: NDArray[np.float64], high: NDArray[np.float64], suns: NDArray[np.float64]
    ) -> NDArray[np.intp]:
        """
        Find the points that the shadow of a box can reach; rather too many than too few.

        Parameters
        ----------
        low, high : (3,) float64
            Corners of the box.
        suns : (n, 3) float64
            Above the horizon.

        Returns
        -------
        which : (k,) int
        """
        margin = 1e-6 * (1.0 + np.abs([low, high]).max())
        x, y, z = self.points.T
        climb = high[2] - z
        found = climb >= -margin
        for at, k in ((x, 0), (y, 1)):
            slope = suns[:, k] / suns[:, 2]
            rise = np.maximum(climb, 0.0)
            nearest, farthest = at + min(slope.min(), 0.0) * rise, at + max(slope.max(), 0.0) * rise
            found &= (farthest >= low[k] - margin) & (nearest <= high[k] + margin)
        return np.flatnonzero(found)


@dataclass(frozen=True, eq=False)
class Surface:
    """
    The plan of a model over its ground.

    Parameters
    ----------
    heights : (rows, cols) float64
        z of the topmost surface, the ground where nothing stands higher; local frame [m].
    slopes : Slopes
        The cells whose surface is not level, which can turn from the sun.
    face : (rows, cols) int32
        Of the soup; ``NOTHING`` where there is only the ground.
    """

    heights: NDArray[np.float64]
    slopes: Slopes
    face: NDArray[np.int32]


def find_surface(soup: Triangles, grid: Grid, ground: float, threads: int = 1) -> Surface:
    """
    Look at a model from the zenith.

    Parameters
    ----------
    soup : Triangles
    grid : Grid
        In the local frame.
    ground : float
        z of the ground plane, local frame [m].
    threads : int

    Returns
    -------
    surface : Surface
    """
    matrix = np.array(
        [
            [1 / grid.dx, 0, 0, -grid.x0 / grid.dx],
            [0, 1 / grid.dy, 0, -grid.y0 / grid.dy],
            [0, 0, 0, 1],
            [0, 0, 1, 0],
        ]
    )
    size = (grid.cols, grid.rows)
    view = see(soup.vertices, soup.faces, matrix, size, (ground, np.inf), threads)
    seen = np.flatnonzero(view.face.ravel() != NOTHING)
    faces, owner = np.unique(view.face.ravel()[seen], return_inverse=True)
    a, b, c = (soup.vertices[soup.faces[faces, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    # The visible side decides, however the face is wound.
    normals *= np.where(normals[:, 2:] < 0, -1.0, 1.0)
    level = (normals[:, :2] == 0).all(1)
    sloping = ~level[owner]
    planes = np.zeros((4, len(faces)))
    planes[:3] = normals.T
    return Surface(
        view.key, Slopes(seen[sloping], owner[sloping].astype(np.int32), planes), view.face
    )
