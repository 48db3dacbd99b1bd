"""Pixels compared with a side many at once: against the same comparisons one by one."""

import numpy as np
import pytest
from numba import njit

from umbra.cpu.nearer import add_where_nearer


@njit
def add(lanes, keys, counts, at, side, slope, rest, m):
    if lanes == 8:
        add_where_nearer(8, keys, counts, at, side, slope, rest, m)
    elif lanes == 16:
        add_where_nearer(16, keys, counts, at, side, slope, rest, m)
    else:
        add_where_nearer(32, keys, counts, at, side, slope, rest, m)


@pytest.mark.parametrize("dtype", [np.int16, np.int32])
@pytest.mark.parametrize("lanes", [8, 16, 32])
def test_lanes_are_compared_as_one_by_one(lanes, dtype):
    rng = np.random.default_rng(2)
    keys = rng.uniform(0, 1, 64)
    for rest in (0, 1, lanes // 2 + 1, lanes, 90):
        side, slope = rng.uniform(0, 1), rng.uniform(-0.02, 0.02)
        keys[12] = side + slope * 2  # as near as the side: not counted
        counts = np.arange(64, dtype=dtype)
        add(lanes, keys, counts, np.uint64(10), side, slope, np.int32(rest), dtype(-3))
        expected = np.arange(64)
        for k in range(min(rest, lanes)):
            expected[10 + k] -= 3 * (keys[10 + k] < side + slope * k)
        np.testing.assert_array_equal(counts, expected)
