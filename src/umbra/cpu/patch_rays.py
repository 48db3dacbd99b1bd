"""Shadow of patch samples by rays."""

import numpy as np
from numba import njit

from umbra.rays.hidden import get, is_hidden

__all__ = ["ask", "ask_all", "ask_one_by_one", "covers", "darken"]


@njit(cache=True, nogil=True, inline="always")
def ask(patches, tree, stack, k, d, last):
    """Find a face between a sample and the sun; -1 if there is none."""
    return is_hidden(get(patches.points, k), get(patches.normals, k), d, tree, stack, last)


@njit(cache=True, nogil=True, inline="always")
def ask_one_by_one(patches, bins, tree, stack, change, masks, i):
    """Cast rays from every sample of a patch to each sun."""
    first, end = patches.first[i], patches.first[i + 1]
    for k in range(first, end):
        m = get(patches.normals, k)
        last = -1
        for s in range(bins.basis.shape[0]):
            d = (bins.basis[s, 6], bins.basis[s, 7], bins.basis[s, 8])
            if m[0] * d[0] + m[1] * d[1] + m[2] * d[2] > 0.0:
                face = ask(patches, tree, stack, k, d, last)
                if face < 0:
                    continue
                last = face
            darken(change, masks, s, k, k + 1, end)


@njit(cache=True, nogil=True, inline="always")
def ask_all(patches, tree, stack, change, masks, s, i, d, last):
    """Cast rays from every sample of a patch; return a face that hides some, or ``last``."""
    first, end = patches.first[i], patches.first[i + 1]
    for k in range(first, end):
        m = get(patches.normals, k)
        if m[0] * d[0] + m[1] * d[1] + m[2] * d[2] > 0.0:
            face = ask(patches, tree, stack, k, d, last)
            if face < 0:
                continue
            last = face
        darken(change, masks, s, k, k + 1, end)
    return last


@njit(cache=True, nogil=True, inline="always")
def darken(change, masks, s, a, b, end):
    """Mark samples from a to b as in shadow, in a patch that ends at ``end``."""
    if masks.size > 0:
        for k in range(a, b):
            masks[s, k] = 1
        return
    change[a] += 1
    if b < end:
        change[b] -= 1


@njit(cache=True, nogil=True)
def covers(tree, face, f, i, su, sv, w, h, tau, bu, bv):
    """
    Return whether the shadow of a face covers the whole rectangle of a patch.

    Parameters
    ----------
    tree : FaceTree
    face : int
    f : (n, 12) float64
        Frames of the patches.
    i : int
        Index of the patch.
    su, sv : float
        Shift of a point's shadow per metre of height [squares].
    w, h, tau, bu, bv : float
    """
    turn = 1.0
    u, v = np.zeros(3), np.zeros(3)
    for k in range(3):
        x, y, z = (
            tree.corners[face, 3 * k],
            tree.corners[face, 3 * k + 1],
            tree.corners[face, 3 * k + 2],
        )
        a = f[i, 8] * x + f[i, 9] * y + f[i, 10] * z + f[i, 11]
        if a <= 3.0 * tau:
            return False
        u[k] = f[i, 0] * x + f[i, 1] * y + f[i, 2] * z + f[i, 3] - a * su
        v[k] = f[i, 4] * x + f[i, 5] * y + f[i, 6] * z + f[i, 7] - a * sv
    if (u[1] - u[0]) * (v[2] - v[0]) <= (v[1] - v[0]) * (u[2] - u[0]):
        turn = -1.0
    for k in range(3):
        j = (k + 1) % 3
        eu, ev = turn * (u[j] - u[k]), turn * (v[j] - v[k])
        x = w + bu if ev > 0.0 else -bu  # the outermost corner
        y = -bv if eu > 0.0 else h + bv
        if eu * (y - v[k]) - ev * (x - u[k]) <= 0.0:
            return False
    return True
