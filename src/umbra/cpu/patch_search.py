"""
Search for the rims of shadows on a patch: edges near the sun, projected, and cuts by faces.

The bins that the patch meets in light space list the edges that may lie between it and the sun.
"""

import numpy as np

from umbra.cpu.patch_bins import clamp
from umbra.cpu.patch_cuts import cut_patch_edge
from umbra.kernels import find_lowest, inlined
from umbra.rays.hidden import get
from umbra.rays.lanes import LANES, meet_rectangles

__all__ = ["count_tests", "find_rims", "find_window", "is_covered"]

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
def _four(rows, i, k):
    """Return four values of a row, from the k-th on."""
    return rows[i, k], rows[i, k + 1], rows[i, k + 2], rows[i, k + 3]


@inlined
def find_window(patches, bins, s, i):
    """Find the bins that a patch meets in light space, and its bounds there."""
    b0, b1, b2 = bins.basis[s, 0], bins.basis[s, 1], bins.basis[s, 2]
    b3, b4, b5 = bins.basis[s, 3], bins.basis[s, 4], bins.basis[s, 5]
    b6, b7, b8 = bins.basis[s, 6], bins.basis[s, 7], bins.basis[s, 8]
    p = patches.place
    w, h = patches.size[i, 0] - 1.0, patches.size[i, 1] - 1.0
    gx, gy, scale = bins.grid[s, 0], bins.grid[s, 1], bins.grid[s, 2]
    cols, rows, begin = bins.shape[s, 0], bins.shape[s, 1], bins.shape[s, 2]
    xa, xb = (
        (b0 * p[i, 3] + b1 * p[i, 4] + b2 * p[i, 5]) * w,
        (b0 * p[i, 6] + b1 * p[i, 7] + b2 * p[i, 8]) * h,
    )
    ya, yb = (
        (b3 * p[i, 3] + b4 * p[i, 4] + b5 * p[i, 5]) * w,
        (b3 * p[i, 6] + b4 * p[i, 7] + b5 * p[i, 8]) * h,
    )
    za, zb = (
        (b6 * p[i, 3] + b7 * p[i, 4] + b8 * p[i, 5]) * w,
        (b6 * p[i, 6] + b7 * p[i, 7] + b8 * p[i, 8]) * h,
    )
    x = b0 * p[i, 0] + b1 * p[i, 1] + b2 * p[i, 2] - gx
    y = b3 * p[i, 0] + b4 * p[i, 1] + b5 * p[i, 2] - gy
    z = b6 * p[i, 0] + b7 * p[i, 1] + b8 * p[i, 2]
    slack = 1e-5 + (1e-6 + 4.0 * patches.tau[i]) * scale
    x0 = (x + min(xa, 0.0) + min(xb, 0.0)) * scale - slack
    x1 = (x + max(xa, 0.0) + max(xb, 0.0)) * scale + slack
    y0 = (y + min(ya, 0.0) + min(yb, 0.0)) * scale - slack
    y1 = (y + max(ya, 0.0) + max(yb, 0.0)) * scale + slack
    limits = (
        np.float32(x1),
        np.float32(x0),
        np.float32(y1),
        np.float32(y0),
        np.float32(z + min(za, 0.0) + min(zb, 0.0)),
    )
    j0, j1 = clamp(y0, rows), clamp(y1, rows)
    return begin + clamp(x0, cols), begin + clamp(x1, cols) + 1, j0 * cols, j1 * cols, cols, limits


@inlined
def _project(patches, ends, e, i, way, error, is_known):
    """
    Project an edge from the sun onto a patch, as far as it is above.

    Returns the ends of its rim [squares], and whether that meets the samples.
    """
    f, tau = patches.frame, patches.tau[i]
    f8, f9, f10, f11 = _four(f, i, 8)
    ha = f8 * ends[e, 0] + f9 * ends[e, 1] + f10 * ends[e, 2] + f11
    hb = f8 * ends[e, 3] + f9 * ends[e, 4] + f10 * ends[e, 5] + f11
    if ha <= tau and hb <= tau:
        return (0.0, 0.0, 0.0, 0.0), _MISSES
    f0, f1, f2, f3 = _four(f, i, 0)
    f4, f5, f6, f7 = _four(f, i, 4)
    ha = 0.0 if abs(ha) <= tau else ha
    hb = 0.0 if abs(hb) <= tau else hb
    ua = f0 * ends[e, 0] + f1 * ends[e, 1] + f2 * ends[e, 2] + f3
    va = f4 * ends[e, 0] + f5 * ends[e, 1] + f6 * ends[e, 2] + f7
    ub = f0 * ends[e, 3] + f1 * ends[e, 4] + f2 * ends[e, 5] + f3
    vb = f4 * ends[e, 3] + f5 * ends[e, 4] + f6 * ends[e, 5] + f7
    if ha < 0.0:
        ua, va = cut_patch_edge(ua, va, ha, ub, vb, hb, True)
        ha = 0.0
    elif hb < 0.0:
        ub, vb = cut_patch_edge(ua, va, ha, ub, vb, hb, True)
        hb = 0.0
    su, sv = way
    rim = (ua - ha * su, va - ha * sv, ub - hb * su, vb - hb * sv)
    return rim, _meets(rim, error, patches, i, is_known)


@inlined
def is_covered(patches, bins, edges, tree, s, i, way, error, window, shell):
    """Return whether a shell that hides one sample hides all: none of its rims meets them."""
    for c in range(patches.cut_start[i], patches.cut_start[i + 1]):
        face = patches.cut_face[c]
        if edges.face_shell[tree.source[face]] == shell:
            how = _meets(_four(patches.cuts, c, 0), error, patches, i, False)
            if how == _MEETS or (
                how == _BESIDE and abs(_find_side(bins, tree, s, face)) < _EDGE_ON
            ):
                return False
    left, right, first, last, cols, limits = window
    for row in range(first, last + 1, cols):
        end = bins.starts[right + row]
        for at in range(bins.starts[left + row], end, LANES):
            met = meet_rectangles(bins.table, at, limits)
            if end - at < LANES:
                met &= (1 << (end - at)) - 1
            while met != 0:
                c = at + find_lowest(met)
                met &= met - 1
                if bins.entries[c, 3] == shell:
                    _, how = _project(patches, edges.ends, bins.entries[c, 0], i, way, error, False)
                    if how == _MEETS:
                        return False
    return True


@inlined
def count_tests(bins, window):
    """Return how often eight edges of a patch's bins are tested at once, to find its rims."""
    left, right, first, last, cols, _ = window
    n = 0
    for row in range(first, last + 1, cols):
        n += (bins.starts[right + row] - bins.starts[left + row] + LANES - 1) // LANES
    return n


@inlined
def _find_side(bins, tree, s, face):
    """Return the sine of a sun's angle above a face."""
    m0, m1, m2 = get(tree.normals, face)
    return m0 * bins.basis[s, 6] + m1 * bins.basis[s, 7] + m2 * bins.basis[s, 8]


@inlined
def find_rims(patches, bins, edges, tree, work, s, i, look, way, error, window):
    """
    Project the edges between a patch and the sun onto it, and add its cuts by faces.

    ``way`` and ``error`` are those of ``find_errors``. Returns the number of rims, 0 if none of
    them meets the samples, or -1 if rays must be cast.
    """
    stamp, rims = work.stamp, work.rims
    left, right, first, last, cols, limits = window
    n = 0
    n_meeting = 0
    for row in range(first, last + 1, cols):
        end = bins.starts[right + row]
        for at in range(bins.starts[left + row], end, LANES):
            met = meet_rectangles(bins.table, at, limits)
            if end - at < LANES:
                met &= (1 << (end - at)) - 1
            while met != 0:
                c = at + find_lowest(met)
                met &= met - 1
                e, o, change, shell = _four(bins.entries, c, 0)
                if stamp[o] == look:
                    continue
                stamp[o] = look
                rim, how = _project(patches, edges.ends, e, i, way, error, n_meeting > 0)
                if how == _MISSES:
                    continue
                n_meeting += how == _MEETS
                rims[n, 0], rims[n, 1], rims[n, 2], rims[n, 3] = rim
                rims[n, 4], rims[n, 5] = change, shell
                n += 1
    for c in range(patches.cut_start[i], patches.cut_start[i + 1]):
        rim = _four(patches.cuts, c, 0)
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
