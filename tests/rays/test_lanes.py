"""Eight boxes or rectangles at a time: against the same comparisons one by one."""

import numpy as np
from numba import njit

from umbra.kernels import find_lowest
from umbra.rays.lanes import LANES, meet_rectangles


@njit
def ask(table, at, limits):
    met = meet_rectangles(table, at, limits)
    return met, find_lowest(met) if met else -1


def test_rectangles_are_told_as_one_by_one():
    rng = np.random.default_rng(1)
    table = np.asfortranarray(rng.uniform(0, 4, (40, 5)).astype(np.float32))
    seen = 0
    for at in range(40 - LANES):
        limits = tuple(np.float32(x) for x in rng.uniform(0, 2, 5) + [2, 0, 2, 0, 0])
        met, lowest = ask(table, at, limits)
        t = table[at : at + LANES]
        alone = (t[:, 0] <= limits[0]) & (t[:, 1] >= limits[1]) & (t[:, 2] <= limits[2])
        alone &= (t[:, 3] >= limits[3]) & (t[:, 4] >= limits[4])
        assert [bool(met >> k & 1) for k in range(LANES)] == alone.tolist()
        assert lowest == (np.argmax(alone) if alone.any() else -1)
        seen += alone.sum()
    assert 20 < seen < 200  # of 256
