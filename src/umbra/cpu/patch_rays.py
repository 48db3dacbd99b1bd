"""Shadow of patch samples by rays."""

import numpy as np

from umbra.kernels import borrowing, inlined
from umbra.rays.hidden import get, is_hidden

__all__ = ["ask", "ask_all", "darken", "get_sun"]


@inlined
def ask(patches, tree, stack, k, d, last):
    """Find a face between a sample and the sun; -1 if there is none."""
    return is_hidden(get(patches.points, k), get(patches.normals, k), d, tree, stack, last)


@borrowing
def ask_all(patches, bins, tree, stack, sums, masks, i, s0, s1, last):
    """
    Cast rays from every sample of a patch to the suns from ``s0`` to ``s1``.

    Returns a face that hides one, or ``last``.
    """
    first, end = patches.first[i], patches.first[i + 1]
    tried = np.int64(last)  # of no use after a lit sample: the next one is probably lit, too
    for k in range(first, end):
        m = get(patches.normals, k)
        for s in range(s0, s1):
            d = get_sun(bins, s)
            if m[0] * d[0] + m[1] * d[1] + m[2] * d[2] > 0.0:
                tried = ask(patches, tree, stack, k, d, tried)
                if tried < 0:
                    continue
                last = tried
            darken(sums, masks, s, k, k + 1, end)
    return last


@inlined
def get_sun(bins, s):
    """Return the direction toward a sun."""
    return bins.suns[s, 0], bins.suns[s, 1], bins.suns[s, 2]


@inlined
def darken(sums, masks, s, a, b, end):
    """
    Mark samples from a to b as in shadow, in a patch that ends at ``end``.

    ``sums`` holds the weights of the suns (n_suns, k), and the changes of their sums from sample to
    sample (n_samples, k), which are added to if there are no masks.
    """
    if masks.size > 0:
        for k in range(a, b):
            masks[s, k] = 1
        return
    weights, change = sums
    for c in range(weights.shape[1]):
        change[a, c] += weights[s, c]
        if b < end:
            change[b, c] -= weights[s, c]
