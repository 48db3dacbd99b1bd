"""Counters of suns asked for sums: how often each receiver is hidden, and any weights."""

import numpy as np


def count_suns(counter, suns, shape):
    """Return the number of suns that leave each receiver in shadow."""
    steps = np.zeros((1, *shape), np.int32)
    counter.add_weights(suns, np.ones((len(suns), 1), np.int32), steps)
    return steps[0]


def check_weights(counter, suns, hidden):
    """Check sums of equal and of distinct weights, negative ones too, against masks (n, ...)."""
    rng = np.random.default_rng(len(suns))
    np.testing.assert_array_equal(
        count_suns(counter, suns, hidden.shape[1:]), hidden.sum(0, dtype=np.int32)
    )
    for columns in (1, 3):
        weights = rng.integers(-(2**20), 2**20, (len(suns), columns), np.int32)
        sums = rng.integers(-9, 9, (columns, *hidden.shape[1:]), np.int32)
        wanted = sums + np.tensordot(weights.T, hidden.astype(np.int32), 1)
        counter.add_weights(suns, weights, sums)
        np.testing.assert_array_equal(sums, wanted)
