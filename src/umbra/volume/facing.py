"""Which faces are lit, for up to 64 lights at once: one bit a light."""

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

__all__ = ["LIGHTS_AT_ONCE", "find_lit", "find_sides"]

LIGHTS_AT_ONCE = 64
_BLOCK = 512  # faces whose planes stay in the first-level cache while lights pass


@njit(cache=True, nogil=True, parallel=True)
def find_lit(planes, lights, lit, edge_on):
    """
    Find which faces each light lights; a plane exactly through the light is unlit.

    Parameters
    ----------
    planes : (4, n_faces) float64
        Outward normals and offsets.
    lights : (n_lights, 4) float64
        Homogeneous, at most 64.
    lit : (n_faces,) uint8 or uint64
        Written: bit k is set where light k lights the face.
    edge_on : (n_blocks,) uint64
        Written: bit k is set where some face of the block of 512 is seen exactly
        edge-on by light k.
    """
    n = planes.shape[1]
    none = lit.dtype.type(0)
    for block in prange((n + _BLOCK - 1) // _BLOCK):
        low = block * _BLOCK
        high = min(n, low + _BLOCK)
        x = planes[0, low:high]
        y = planes[1, low:high]
        z = planes[2, low:high]
        w = planes[3, low:high]
        bits = lit[low:high]
        for i in range(high - low):
            bits[i] = 0
        flat = np.uint64(0)
        for k in range(lights.shape[0]):
            l0, l1, l2, l3 = lights[k, 0], lights[k, 1], lights[k, 2], lights[k, 3]
            bit = np.uint64(1) << np.uint64(k)
            mark = lit.dtype.type(bit)
            zeros = 0
            for i in range(high - low):
                side = x[i] * l0 + y[i] * l1 + z[i] * l2 + w[i] * l3
                bits[i] |= mark if side > 0.0 else none
                zeros += 1 if side == 0.0 else 0
            if zeros > 0:
                flat |= bit
        edge_on[block] = flat


def find_sides(planes: NDArray[np.float64], light: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Tell on which side of faces a light is: above 0 it lights them, at 0 in their plane.

    Summed up as ``find_lit`` does, to the last bit. A matrix product would round otherwise,
    and its caps would not fit the silhouette where a light is as good as in a face's plane.
    ``planes`` are (4, ...), the light (4,) or (4, ...).
    """
    sides = planes[0] * light[0]
    for k in (1, 2, 3):
        sides += planes[k] * light[k]
    return sides
