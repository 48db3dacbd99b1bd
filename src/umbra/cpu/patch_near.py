"""
Edges near a patch: all that may cast a rim on it under some sun of a group.

They are looked up once for a group, in the patch's frame and cut off at its plane, so that little
is left to do for each sun.
"""

from typing import NamedTuple

import numpy as np

from umbra.cpu.patch_bins import clamp
from umbra.cpu.patch_cuts import cut_patch_edge
from umbra.kernels import find_lowest, inlined
from umbra.rays.lanes import LANES, meet_rectangles

__all__ = ["NearEdges", "find_errors", "find_near_edges", "four", "pick_near"]

_EPS = 1e-7  # rounding error of a rim [squares]
_FAR = 2.0**-9  # bins: above float32's rounding of what a slope adds
_ABOVE = 1e-3  # m


class NearEdges(NamedTuple):
    """
    Edges near a patch.

    Parameters
    ----------
    ends : (6, n) float64
        Column, row and height of both ends.
    which : (n, 3) int64
        The edge's first multiplicity, its shell, and a bit for each sun in whose silhouette it is.
    picks : (n,) int32
        Indices of the edges whose rims may meet the patch under one sun.
    stamp : (n,) int32
        Last search that found each edge of a group.
    """

    ends: np.ndarray
    which: np.ndarray
    picks: np.ndarray
    stamp: np.ndarray


@inlined
def find_errors(patches, i, d, sine):
    """
    Find the shift of a shadow on a patch per metre of height, and error bounds.

    ``d`` is the direction toward the sun, and ``sine`` that of its angle above the patch. The
    errors are those of rims along both axes, like the shift in columns and rows, and the distance
    up to which a face close to the plane may cast a shadow [m].
    """
    f = patches.frame
    su = (f[i, 0] * d[0] + f[i, 1] * d[1] + f[i, 2] * d[2]) / sine
    sv = (f[i, 4] * d[0] + f[i, 5] * d[1] + f[i, 6] * d[2]) / sine
    # Heights up to tau count as 0, so rims can be off by this much.
    most = 2.0 * patches.tau[i]
    return (su, sv), (_EPS + most * abs(su), _EPS + most * abs(sv), most / sine)


@inlined
def four(rows, i, k):
    """Return four values of a row, from the k-th on."""
    return rows[i, k], rows[i, k + 1], rows[i, k + 2], rows[i, k + 3]


@inlined
def _find_window(patches, bins, g, i):
    """Find the bins that may hold edges near a patch, and their limits and slopes there."""
    b0, b1, b2 = bins.basis[g, 0], bins.basis[g, 1], bins.basis[g, 2]
    b3, b4, b5 = bins.basis[g, 3], bins.basis[g, 4], bins.basis[g, 5]
    b6, b7, b8 = bins.basis[g, 6], bins.basis[g, 7], bins.basis[g, 8]
    p = patches.place
    w, h = patches.size[i, 0] - 1.0, patches.size[i, 1] - 1.0
    gx, gy, gz, scale = four(bins.grid, g, 0)
    cols, rows, begin = bins.shape[g, 0], bins.shape[g, 1], bins.shape[g, 2]
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
    z = b6 * p[i, 0] + b7 * p[i, 1] + b8 * p[i, 2] - gz
    slack = 1e-5 + (1e-6 + 4.0 * patches.tau[i]) * scale
    x0 = (x + min(xa, 0.0) + min(xb, 0.0)) * scale - slack
    x1 = (x + max(xa, 0.0) + max(xb, 0.0)) * scale + slack
    y0 = (y + min(ya, 0.0) + min(yb, 0.0)) * scale - slack
    y1 = (y + max(ya, 0.0) + max(yb, 0.0)) * scale + slack
    z0 = z + min(za, 0.0) + min(zb, 0.0)
    # How far toward the suns edges may be, as high as the casters.
    reach = bins.spread[g, 5] - z0
    rise = bins.spread[g, 4]
    if rise > 0.0:
        low = p[i, 2] + min(p[i, 5] * w, 0.0) + min(p[i, 8] * h, 0.0)
        reach = min(reach, (bins.top - low) / rise)
    reach = max(reach, 0.0) + _ABOVE
    sx0, sx1, sy0, sy1 = four(bins.spread, g, 0)
    sx0, sx1, sy0, sy1 = sx0 * scale, sx1 * scale, sy0 * scale, sy1 * scale
    limits = (
        np.float32(x1 - sx1 * z0 + _FAR),
        np.float32(x0 - sx0 * z0 - _FAR),
        np.float32(y1 - sy1 * z0 + _FAR),
        np.float32(y0 - sy0 * z0 - _FAR),
        np.float32(z0),
    )
    slopes = (np.float32(sx1), np.float32(sx0), np.float32(sy1), np.float32(sy0))
    left, right = clamp(x0 + sx0 * reach, cols), clamp(x1 + sx1 * reach, cols) + 1
    j0, j1 = clamp(y0 + sy0 * reach, rows), clamp(y1 + sy1 * reach, rows)
    return begin + left, begin + right, j0 * cols, j1 * cols, cols, limits, slopes


@inlined
def _find_range(patches, bins, g, i):
    """
    Find the range of a group's shifts on a patch, and the greatest errors, as in ``find_errors``.

    Suns that do not shine on it are left out; their number is returned last.
    """
    f = patches.frame
    u0, u1, v0, v1 = np.inf, -np.inf, np.inf, -np.inf
    bu, bv, n = 0.0, 0.0, 0
    for s in range(bins.first[g], bins.first[g + 1]):
        d = bins.suns[s, 0], bins.suns[s, 1], bins.suns[s, 2]
        sine = f[i, 8] * d[0] + f[i, 9] * d[1] + f[i, 10] * d[2]
        if sine >= patches.graze[i]:
            (su, sv), error = find_errors(patches, i, d, sine)
            u0, u1, v0, v1 = min(u0, su), max(u1, su), min(v0, sv), max(v1, sv)
            bu, bv = max(bu, error[0]), max(bv, error[1])
            n += 1
    return (u0, u1, v0, v1), bu, bv, n


@inlined
def find_near_edges(patches, bins, edges, near, g, i, look, share):
    """
    Find the edges near a patch under a group's suns; return how many there are.

    ``look`` is the number of the search, so that each is found once. -1 is returned if so many
    eight edges are to be tested that the patch has less than ``share`` samples and suns for each.
    """
    ranges, bu, bv, n_suns = _find_range(patches, bins, g, i)
    if n_suns == 0:
        return 0
    left, right, first, last, cols, limits, slopes = _find_window(patches, bins, g, i)
    base, lot, n_all = bins.shape[g, 3], bins.shape[g, 4], bins.first[g + 1] - bins.first[g]
    if share > 0.0:
        tests = 0
        for row in range(first, last + 1, cols):
            tests += (bins.starts[right + row] - bins.starts[left + row]) // LANES + 1
        if (patches.first[i + 1] - patches.first[i]) * n_suns < share * tests:
            return -1
    n = 0
    for row in range(first, last + 1, cols):
        end = bins.starts[right + row]
        for at in range(bins.starts[left + row], end, LANES):
            met = meet_rectangles(bins.table, at, limits, slopes)
            if end - at < LANES:
                met &= (1 << (end - at)) - 1
            while met != 0:
                c = at + find_lowest(met)
                met &= met - 1
                o = bins.entries[c, 1]
                if near.stamp[o] == look:
                    continue
                near.stamp[o] = look
                if _add(patches, edges.ends, bins.entries[c, 0], i, ranges, bu, bv, near.ends, n):
                    which = near.which
                    which[n, 0], which[n, 1] = lot + o * n_all, bins.entries[c, 2]
                    which[n, 2] = bins.united[base + o]
                    n += 1
    return n


@inlined
def _add(patches, ends, e, i, ranges, bu, bv, near, n):
    """Write an edge in a patch's frame, as far as it is above; return whether it may cast a rim."""
    f, tau = patches.frame, patches.tau[i]
    f8, f9, f10, f11 = four(f, i, 8)
    ha = f8 * ends[e, 0] + f9 * ends[e, 1] + f10 * ends[e, 2] + f11
    hb = f8 * ends[e, 3] + f9 * ends[e, 4] + f10 * ends[e, 5] + f11
    if ha <= tau and hb <= tau:
        return False
    f0, f1, f2, f3 = four(f, i, 0)
    f4, f5, f6, f7 = four(f, i, 4)
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
    w, h = patches.size[i, 0] - 1.0, patches.size[i, 1] - 1.0
    u0, u1, v0, v1 = ranges
    if (
        (va - ha * v1 > h + bv and vb - hb * v1 > h + bv)
        or (va - ha * v0 < -bv and vb - hb * v0 < -bv)
        or (ua - ha * u1 > w + bu and ub - hb * u1 > w + bu)
        or (ua - ha * u0 < -bu and ub - hb * u0 < -bu)
    ):
        return False
    near[0, n], near[1, n], near[2, n] = ua, va, ha
    near[3, n], near[4, n], near[5, n] = ub, vb, hb
    return True


@inlined
def pick_near(patches, bins, near, n_near, s, i, way, error):
    """
    Pick the edges of a sun's silhouette whose rims may meet the patch.

    ``way`` and ``error`` are those of ``find_errors``. Returns the number of ``picks``.
    """
    (su, sv), bu, bv, ends = way, error[0], error[1], near.ends
    w, h = patches.size[i, 0] - 1.0 + bu, patches.size[i, 1] - 1.0 + bv
    number = bins.number[s]
    n = 0
    for c in range(n_near):
        ha, hb = ends[2, c], ends[5, c]
        u0, u1 = ends[0, c] - ha * su, ends[3, c] - hb * su
        v0, v1 = ends[1, c] - ha * sv, ends[4, c] - hb * sv
        near.picks[n] = c
        n += np.int64(
            (near.which[c, 2] >> number & 1 == 1)
            & (min(v0, v1) <= h) & (max(v0, v1) >= -bv)
            & (min(u0, u1) <= w) & (max(u0, u1) >= -bu)
        )  # fmt: skip
    return n
