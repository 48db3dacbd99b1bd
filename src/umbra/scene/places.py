"""Points on surfaces, on which shadows fall."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Places"]


@dataclass(frozen=True, eq=False)
class Places:
    """
    Points with normals.

    Parameters
    ----------
    points : (n, 3) float64
        In the scene's local frame [m].
    normals : (n, 3) float64
        Of the side of the surface that is seen; NaN where a point faces every light.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.points)

    def pick(self, which: NDArray[np.intp] | slice) -> "Places":
        """Return some of the points."""
        return Places(self.points[which], self.normals[which])

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
