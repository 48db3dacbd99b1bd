"""The altitude up to which a meridian is covered, for horizons."""

import math

import numpy as np
from numba import njit

from umbra.sky.meridians import cut_face

__all__ = ["find_heights"]


@njit(cache=True, nogil=True)
def find_heights(seen, toward):
    """
    Find the lowest free altitude of meridians [radians].

    Parameters
    ----------
    seen : SeenFaces
    toward : (n, 2) float64
        Horizontal unit directions.

    Returns
    -------
    heights : (n,) float64
    """
    n_faces = seen.size.size
    low, high = np.empty(n_faces), np.empty(n_faces)
    found = np.zeros(toward.shape[0])
    for k in range(toward.shape[0]):
        n = 0
        for i in range(n_faces):
            one, two, _, _ = cut_face(seen.corners[i], seen.size[i], toward[k, 0], toward[k, 1])
            if one < math.inf:
                low[n], high[n] = one, two
                n += 1
        order = np.argsort(low[:n])
        top = 0.0
        for q in order:
            if low[q] > top + 1e-12 * (1.0 + top * top):
                break
            top = max(top, high[q])
        found[k] = math.pi / 2 if top == math.inf else math.atan(top)
    return found
