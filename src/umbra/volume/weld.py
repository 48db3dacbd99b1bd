"""Welding: vertices at the same place become one, so that faces find their neighbours."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["weld_vertices"]


@njit(cache=True, nogil=True)
def _first_at_place(bits, table, first):
    """Fill ``first`` with the lowest index that has the same 192 bits (open addressing)."""
    mask = np.uint64(table.size - 1)
    for i in range(bits.shape[0]):
        h = bits[i, 0] * np.uint64(0x9E3779B97F4A7C15)
        h = (h ^ (h >> np.uint64(29)) ^ bits[i, 1]) * np.uint64(0xBF58476D1CE4E5B9)
        h = (h ^ (h >> np.uint64(32)) ^ bits[i, 2]) * np.uint64(0x94D049BB133111EB)
        slot = (h ^ (h >> np.uint64(31))) & mask
        while True:
            j = table[slot]
            if j < 0:
                table[slot] = i
                first[i] = i
                break
            if bits[j, 0] == bits[i, 0] and bits[j, 1] == bits[i, 1] and bits[j, 2] == bits[i, 2]:
                first[i] = j
                break
            slot = (slot + np.uint64(1)) & mask


def weld_vertices(vertices: NDArray[np.float64]) -> NDArray[np.int32]:
    """
    Find, for each vertex, the first one at exactly the same place.

    Only equal coordinates weld (and -0 equals 0): a tolerance would move walls,
    and the open rule keeps shadows exact across cracks anyway.

    Parameters
    ----------
    vertices : (n, 3) float64
        Finite.

    Returns
    -------
    first : (n,) int32
        ``first[i] <= i``, and ``first[first] == first``.
    """
    count = len(vertices)
    bits = np.ascontiguousarray(vertices + 0.0).view(np.uint64).reshape(count, 3)
    table = np.full(1 << max(4, int(2 * count).bit_length()), -1, np.int32)
    first = np.zeros(count, np.int32)
    _first_at_place(bits, table, first)
    return first
