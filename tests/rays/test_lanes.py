"""Eight boxes or rectangles at a time: against the same comparisons one by one."""

import numpy as np
from numba import njit

from umbra.kernels import find_lowest
from umbra.rays.lanes import LANES, meet_rectangles


@njit
def ask(table, at, limits, slopes):
    met = meet_rectangles(table, at, limits, slopes)
    return met, find_lowest(met) if met else -1


def test_rectangles_are_told_as_one_by_one():
    rng = np.random.default_rng(1)
    table = np.asfortranarray(rng.uniform(0, 4, (40, 5)).astype(np.float32))
    seen = 0
    for at in range(40 - LANES):
        limits = tuple(np.float32(x) for x in rng.uniform(0, 2, 5) + [2, 0, 2, 0, 0])
        slopes = tuple(np.float32(x) for x in rng.uniform(0, 0.2, 4) * [1, -1, 1, -1])
        met, lowest = ask(table, at, limits, slopes)
        t = table[at : at + LANES]
        most_x, least_x, most_y, least_y = (limits[k] + slopes[k] * t[:, 4] for k in range(4))
        alone = (t[:, 0] <= most_x) & (t[:, 1] >= least_x) & (t[:, 2] <= most_y)
        alone &= (t[:, 3] >= least_y) & (t[:, 4] >= limits[4])
        assert [bool(met >> k & 1) for k in range(LANES)] == alone.tolist()
        assert lowest == (np.argmax(alone) if alone.any() else -1)
        seen += alone.sum()
    assert 20 < seen < 200  # of 256
