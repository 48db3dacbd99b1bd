"""
Search for the rims of shadows on a patch: edges near it, projected, and cuts by faces.

``patch_near`` finds the edges that may lie between the patch and the suns of a group.
"""

import numpy as np

from umbra.cpu.patch_near import four
from umbra.kernels import inlined
from umbra.rays.hidden import get

__all__ = ["find_rims", "is_covered"]

_MISSES, _BESIDE, _MEETS = 0, 1, 2
_EDGE_ON = 1e-9  # sine of the sun over a face that passes through a patch


@inlined
def _meets(rim, error, patches, i, is_known):
    """
    Classify a rim: outside the rectangle, clear of its samples, or possibly across them.

    With ``is_known`` one of the last two, without looking which.
    """
    (u0, v0, u1, v1), (bu, bv, _), hull = rim, error, patches.hull
    w, h = patches.size[i, 0] - 1.0, patches.size[i, 1] - 1.0
    if (
        (v0 > h + bv and v1 > h + bv) or (v0 < -bv and v1 < -bv)
        or (u0 > w + bu and u1 > w + bu) or (u0 < -bu and u1 < -bu)
    ):  # fmt: skip
        return _MISSES
    du, dv = u1 - u0, v1 - v0
    a, b = 0.5 * w + bu, 0.5 * h + bv
    slack = 1e-9 * (abs(du) + abs(dv)) * (1.0 + w + h)
    across = dv * (0.5 * (u0 + u1) - 0.5 * w) - du * (0.5 * (v0 + v1) - 0.5 * h)
    if abs(across) > abs(dv) * a + abs(du) * b + slack:
        return _MISSES
    if is_known:
        return _BESIDE
    b = bu + bv + 1e-6
    if max(u0 + v0, u1 + v1) < hull[i, 0] - b or min(u0 + v0, u1 + v1) > hull[i, 1] + b:
        return _BESIDE
    if max(u0 - v0, u1 - v1) < hull[i, 2] - b or min(u0 - v0, u1 - v1) > hull[i, 3] + b:
        return _BESIDE
    least, most = np.inf, -np.inf
    for q in range(4, 20, 2):
        side = dv * (hull[i, q] - u0) - du * (hull[i, q + 1] - v0)
        least, most = min(least, side), max(most, side)
    far = hull[i, 20] * (abs(du) + abs(dv)) + abs(dv) * bu + abs(du) * bv
    return _BESIDE if least > far or most < -far else _MEETS


@inlined
def _project(near, c, way):
    """Project an edge near a patch from the sun onto it: the ends of its rim [squares]."""
    (su, sv), e = way, near.ends
    ha, hb = e[2, c], e[5, c]
    return e[0, c] - ha * su, e[1, c] - ha * sv, e[3, c] - hb * su, e[4, c] - hb * sv


@inlined
def is_covered(patches, bins, edges, tree, near, n_picks, s, i, way, error, shell):
    """Return whether a shell that hides one sample hides all: none of its rims meets them."""
    for c in range(patches.cut_start[i], patches.cut_start[i + 1]):
        face = patches.cut_face[c]
        if edges.face_shell[tree.source[face]] == shell:
            how = _meets(four(patches.cuts, c, 0), error, patches, i, False)
            if how == _MEETS or (
                how == _BESIDE and abs(_find_side(bins, tree, s, face)) < _EDGE_ON
            ):
                return False
    for q in range(n_picks):
        c = near.picks[q]
        if near.which[c, 1] != shell:
            continue
        if _meets(_project(near, c, way), error, patches, i, False) == _MEETS:
            return False
    return True


@inlined
def _find_side(bins, tree, s, face):
    """Return the sine of a sun's angle above a face."""
    m0, m1, m2 = get(tree.normals, face)
    return m0 * bins.suns[s, 0] + m1 * bins.suns[s, 1] + m2 * bins.suns[s, 2]


@inlined
def find_rims(patches, bins, edges, tree, work, n_picks, s, i, way, error):
    """
    Project the edges between a patch and the sun onto it, and add its cuts by faces.

    ``n_picks`` edges are picked under the sun; ``way`` and ``error`` are those of ``find_errors``.
    Returns the number of rims, 0 if none of them meets the samples, or -1 if rays must be cast.
    """
    near, rims, number = work.near, work.rims, bins.number[s]
    n = 0
    n_meeting = 0
    for p in range(n_picks):
        c = near.picks[p]
        rim = _project(near, c, way)
        how = _meets(rim, error, patches, i, n_meeting > 0)
        if how == _MISSES:
            continue
        n_meeting += how == _MEETS
        rims[n, 0], rims[n, 1], rims[n, 2], rims[n, 3] = rim
        rims[n, 4], rims[n, 5] = bins.changes[near.which[c, 0] + number], near.which[c, 1]
        n += 1
    for c in range(patches.cut_start[i], patches.cut_start[i + 1]):
        rim = four(patches.cuts, c, 0)
        how = _meets(rim, error, patches, i, n_meeting > 0)
        if how == _MISSES:
            continue
        face = patches.cut_face[c]
        side = _find_side(bins, tree, s, face)
        if abs(side) < _EDGE_ON:
            return -1
        n_meeting += how == _MEETS
        rims[n, 0], rims[n, 1], rims[n, 2], rims[n, 3] = rim
        rims[n, 4] = 1.0 if side > 0.0 else -1.0
        rims[n, 5] = edges.face_shell[tree.source[face]]
        n += 1
    return n if n_meeting > 0 else 0
