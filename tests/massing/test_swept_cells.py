"""The height below which a cell leaves all rays of a piece free, against many rays between."""

import numpy as np
import pytest

from umbra.massing.planes import SunPieces, cross_cells
from umbra.massing.plot import Plot

RISE = 0.7  # of all rays, per metre of their plan
RAYS = 4001


@pytest.mark.parametrize("turn", [0, 90, 180, 270])
@pytest.mark.parametrize("azimuths", [(1.0, 13.0), (-18.0, -2.0)])
def test_rays_between_two_instants_are_lowest_at_corners(turn, azimuths):
    """Rays of one slope are lowest over a cell where it is nearest between their directions."""
    rows, cols = 5, 6
    index = np.arange(rows * cols, dtype=np.int32).reshape(rows, cols)
    index[1, 2] = -1  # a cell that is not of the plot
    angle = np.radians(turn)
    cos, sin = np.round([np.cos(angle), np.sin(angle)])
    middle = np.array([[cos, -sin], [sin, cos]]) @ (14.0, 1.0 if azimuths[0] > 0 else -1.5)
    x0, y0 = middle - (cols / 2, rows / 2)
    none = np.zeros(rows * cols)
    plot = Plot(x0, y0, 1.0, index, none, none, None)
    point = np.array([[0.3, 0.2, 1.0]])

    def aim(degrees):
        azimuth = np.radians(degrees) + angle
        ways = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.full(len(azimuth), RISE)])
        return ways / np.linalg.norm(ways, axis=1)[:, None]

    one = np.zeros(1, np.int64)
    piece = SunPieces(one, one, one + 1, np.ones(1), np.zeros(1, np.bool_))
    found = cross_cells(plot, piece, point, aim(np.array(azimuths)))
    between = aim(np.linspace(*azimuths, RAYS))
    lowest = np.full(rows * cols, np.inf)
    for row in range(rows):
        for col in range(cols):
            if index[row, col] < 0:
                continue
            low = np.array([x0 + col, y0 + row]) - point[0, :2]
            with np.errstate(divide="ignore"):
                ends = np.sort([low / between[:, :2], (low + 1.0) / between[:, :2]], axis=0)
            enters, leaves = ends[0].max(1), ends[1].min(1)
            met = (enters < leaves) & (leaves > 0)
            if met.any():
                lowest[index[row, col]] = 1.0 + (enters[met] * between[met, 2]).min()
    clear = np.full(rows * cols, np.inf)
    clear[found.cell] = found.clear
    crossed = np.isfinite(lowest)
    assert crossed.sum() > 4
    np.testing.assert_allclose(clear[crossed], lowest[crossed], rtol=1e-4)
    # Cells that only touch a corner of the fan may be listed; none of them is lower.
    assert (clear[~crossed] >= lowest[crossed].min()).all()
