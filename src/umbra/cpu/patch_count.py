"""
Shadows on planar patches, counted by the rims of shadow volumes.

A patch that faces the sun takes from the bins the silhouette edges that may lie between it
and the sun, and throws them onto its plane; where a casting face passes through the plane,
that segment closes their chains. Crossings then tell the count at every sample up to a
constant. One ray settles the constant, from a sample where the count is least: if that
is lit, the least count is 0; if not, every sample is in shadow. A patch that no rim meets
needs the ray alone.

Rays answer whatever float64 cannot tell by crossings: samples as near to a rim as rounding
reaches, or near another face that hardly rises from the plane; patches of a few samples, and
patches under a sun that grazes them.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.cpu.patch_bins import EdgeBinner, clamp
from umbra.cpu.patch_cuts import cut_edge
from umbra.cpu.patch_rims import (
    MEETS,
    MISSES,
    Crossings,
    add_rim,
    clear,
    covers,
    find_runs,
    meets,
)
from umbra.cpu.patches import Patches
from umbra.machine import use_threads
from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import is_hidden
from umbra.volume.adjacency import Caster

__all__ = ["PatchCounter"]

_BLOCK = 32  # patches that a thread takes at a time: their bins stay in the cache
_SUNS = 64  # suns that are binned at a time
_ROOM = 1024  # doubts of a patch under one sun, besides a quarter of its samples
_CROSSINGS = 16  # of a column, besides one a row; with more of them rays are asked
_EPS = 1e-7  # squares that a rim can be off by rounding
_EDGE_ON = 1e-9  # sine of the sun over a face that passes through a patch


class PatchCounter:
    """
    Counts shadows on samples of surfaces.

    Parameters
    ----------
    patches : Patches
        The samples.
    caster : Caster
    tree : FaceTree
        Of the caster.
    threads : int
    """

    def __init__(self, patches: Patches, caster: Caster, tree: FaceTree, threads: int = 1) -> None:
        self._patches, self._threads = patches, threads
        self._binner = EdgeBinner(caster)
        self._tree = _Faces(tree.boxes, tree.links, tree.corners, tree.ids, tree.normals)

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """
        Tell for each sun which samples are in shadow, cast or attached.

        Parameters
        ----------
        suns : (n, 3) float64
            Unit directions toward the sun.

        Returns
        -------
        masks : (n, n_samples) uint8
            0 or 1.
        """
        where = self._patches.where
        masks = np.zeros((len(suns), len(where)), np.uint8)
        for first in range(0, len(suns), _SUNS):
            some = suns[first : first + _SUNS]
            found = np.zeros((len(some), len(where)), np.uint8)
            self._run(some, found)
            masks[first : first + len(some), where] = found
        return masks

    def add_steps(
        self,
        suns: NDArray[np.float64],
        steps: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """
        Count for each sample how many suns leave it in shadow.

        Parameters
        ----------
        suns : (n, 3) float64
        steps : (n_samples,) int32
            Added to.
        progress : callable
            Told how many suns were done, now and then.
        """
        nothing = np.zeros((0, 0), np.uint8)
        for first in range(0, len(suns), _SUNS):
            some = suns[first : first + _SUNS]
            steps[self._patches.where] += self._run(some, nothing)
            progress(len(some))

    def _run(self, suns: NDArray[np.float64], masks: NDArray[np.uint8]) -> NDArray[np.int32]:
        """Fill masks in, if there are any; else give the suns that leave each sample in shadow."""
        use_threads(self._threads)
        suns = np.ascontiguousarray(suns)
        change = np.zeros(0 if masks.size else len(self._patches.where), np.int32)
        bins = self._binner.bin(suns)
        _count(self._patches, bins, self._binner.ends, self._tree, change, masks)
        return change


class _Faces(NamedTuple):
    """The arrays of a ``FaceTree``."""

    boxes: NDArray[np.float64]
    links: NDArray[np.int32]
    corners: NDArray[np.float64]
    ids: NDArray[np.int32]
    normals: NDArray[np.float64]


class _Work(NamedTuple):
    """
    Memory of a thread.

    Parameters
    ----------
    crossings : Crossings
    rims : (n, 5) float64
        From column, row to column, row; how the count changes to the left.
    stamp : (most,) int32
        Of each edge of a silhouette, the last look that came upon it.
    is_doubt : (n,) bool
        Samples of a patch that rays must tell.
    asked : (n,) int32
        Those samples.
    """

    crossings: Crossings
    rims: np.ndarray
    stamp: np.ndarray
    is_doubt: np.ndarray
    asked: np.ndarray


@njit(cache=True, nogil=True, parallel=True)
def _count(patches, bins, ends, tree, change, masks):
    n = patches.size.shape[0]
    for block in prange((n + _BLOCK - 1) // _BLOCK):
        _count_block(
            patches, bins, ends, tree, change, masks, block * _BLOCK, min(n, (block + 1) * _BLOCK)
        )


@njit(cache=True, nogil=True)
def _count_block(patches, bins, ends, tree, change, masks, p0, p1):
    widest, highest, most, cuts = 0, 0, 0, 0
    for i in range(p0, p1):
        if patches.graze[i] < np.inf:
            widest = max(widest, patches.size[i, 0])
            highest = max(highest, patches.size[i, 1])
            most = max(most, patches.first[i + 1] - patches.first[i])
            cuts = max(cuts, patches.cut_start[i + 1] - patches.cut_start[i])
    at_once = _CROSSINGS + highest
    room = _ROOM + most // 4
    work = _Work(
        Crossings(
            np.zeros(widest + 1, np.int32),
            np.zeros(widest + 1, np.int32),
            np.zeros((widest, at_once), np.int32),
            np.zeros((widest, at_once), np.int32),
            np.zeros(room, np.int64),
            np.zeros((most, 3), np.int64),
            np.zeros(highest + 1, np.int32),
        ),
        np.zeros((bins.most + cuts, 5)),
        np.zeros(bins.most, np.int32),
        np.zeros(most, np.bool_),
        np.zeros(room, np.int32),
    )
    last = np.full(p1 - p0, -1, np.int64)  # what hid the sun before mostly still does
    look = 0
    for i in range(p0, p1):
        if patches.graze[i] == np.inf:
            _ask_one_by_one(patches, bins, tree, change, masks, i)
    for s in range(bins.basis.shape[0]):
        for i in range(p0, p1):
            if patches.graze[i] == np.inf:
                continue
            look += 1
            last[i - p0] = _count_patch(
                patches, bins, ends, tree, change, masks, work, s, i, look, last[i - p0]
            )
    if masks.size == 0:
        for i in range(p0, p1):
            for k in range(patches.first[i] + 1, patches.first[i + 1]):
                change[k] += change[k - 1]


@njit(cache=True, nogil=True)
def _count_patch(patches, bins, ends, tree, change, masks, work, s, i, look, last):
    """Count a patch under a sun; give a face that hides it, or the one given."""
    d = bins.basis[s, 6:9]
    f = patches.frame[i]
    sine = f[8] * d[0] + f[9] * d[1] + f[10] * d[2]
    first, end = patches.first[i], patches.first[i + 1]
    graze = patches.graze[i]
    if sine <= -graze:
        _darken(change, masks, s, first, end, end)
        return last
    if sine < graze:
        return _ask_all(patches, tree, change, masks, s, i, d, last)
    su = (f[0] * d[0] + f[1] * d[1] + f[2] * d[2]) / sine
    sv = (f[4] * d[0] + f[5] * d[1] + f[6] * d[2]) / sine
    tau = patches.tau[i]
    cols, rows = patches.size[i, 0], patches.size[i, 1]
    # As heights up to tau count as 0, rims can be off by this much.
    bu, bv = _EPS + 2.0 * tau * abs(su), _EPS + 2.0 * tau * abs(sv)
    if last >= 0 and covers(tree.corners[last], f, su, sv, cols - 1.0, rows - 1.0, tau, bu, bv):
        _darken(change, masks, s, first, end, end)
        return last
    n_rims = _find_rims(patches, bins, ends, work, s, i, look, su, sv, bu, bv)
    if n_rims < 0:
        return _ask_all(patches, tree, change, masks, s, i, d, last)
    changes, n_doubts = 0, 0
    c = work.crossings
    for k in range(n_rims):
        r = work.rims[k]
        t, n_doubts = add_rim(
            r[0], r[1], r[2], r[3], np.int64(r[4]), bu, bv, cols, rows, c, n_doubts
        )
        if t < 0 or n_doubts > c.doubts.size:
            clear(cols, c)
            return _ask_all(patches, tree, change, masks, s, i, d, last)
        changes += t
    n_asked = _find_doubts(patches, work, i, n_doubts, 2.0 * tau / sine)
    if n_asked < 0:
        clear(cols, c)
        return _ask_all(patches, tree, change, masks, s, i, d, last)
    if changes == 0 and n_asked == 0:
        k = (first + end) // 2
        face = _ask(patches, tree, k, d, last)
        if face < 0:
            return last
        _darken(change, masks, s, first, end, end)
        return face
    return _settle(patches, tree, change, masks, work, s, i, d, n_asked, last)


@njit(cache=True, nogil=True)
def _find_rims(patches, bins, ends, work, s, i, look, su, sv, bu, bv):
    """
    Throw the edges between a patch and the sun onto it, and add where faces pass through it.

    Gives their number, 0 if none meets the samples, or -1 where rays must be asked.
    """
    b, f, p, hull = bins.basis[s], patches.frame[i], patches.place[i], patches.hull[i]
    tau = patches.tau[i]
    w, h = patches.size[i, 0] - 1.0, patches.size[i, 1] - 1.0
    gx, gy, scale = bins.grid[s, 0], bins.grid[s, 1], bins.grid[s, 2]
    cols, rows, begin = bins.shape[s, 0], bins.shape[s, 1], bins.shape[s, 2]
    stamp, rims = work.stamp, work.rims
    # The patch's rectangle in light space: its bins, and how far it is from the sun.
    xa, xb = (
        (b[0] * p[3] + b[1] * p[4] + b[2] * p[5]) * w,
        (b[0] * p[6] + b[1] * p[7] + b[2] * p[8]) * h,
    )
    ya, yb = (
        (b[3] * p[3] + b[4] * p[4] + b[5] * p[5]) * w,
        (b[3] * p[6] + b[4] * p[7] + b[5] * p[8]) * h,
    )
    za, zb = (
        (b[6] * p[3] + b[7] * p[4] + b[8] * p[5]) * w,
        (b[6] * p[6] + b[7] * p[7] + b[8] * p[8]) * h,
    )
    x = b[0] * p[0] + b[1] * p[1] + b[2] * p[2] - gx
    y = b[3] * p[0] + b[4] * p[1] + b[5] * p[2] - gy
    z = b[6] * p[0] + b[7] * p[1] + b[8] * p[2]
    slack = 1e-5 + (1e-6 + 4.0 * tau) * scale
    i0 = clamp((x + min(xa, 0.0) + min(xb, 0.0)) * scale - slack, cols)
    i1 = clamp((x + max(xa, 0.0) + max(xb, 0.0)) * scale + slack, cols)
    j0 = clamp((y + min(ya, 0.0) + min(yb, 0.0)) * scale - slack, rows)
    j1 = clamp((y + max(ya, 0.0) + max(yb, 0.0)) * scale + slack, rows)
    low = np.float32(z + min(za, 0.0) + min(zb, 0.0))
    n = 0
    n_meeting = 0
    for j in range(j0, j1 + 1):
        row = begin + j * cols
        for at in range(row + i0, row + i1 + 1):
            for c in range(bins.starts[at], bins.starts[at + 1]):
                if bins.top[c] < low:
                    break  # all others are farther from the sun than the patch
                o = bins.order[c]
                if stamp[o] == look:
                    continue
                stamp[o] = look
                e = ends[bins.edge[c]]
                ha = f[8] * e[0] + f[9] * e[1] + f[10] * e[2] + f[11]
                hb = f[8] * e[3] + f[9] * e[4] + f[10] * e[5] + f[11]
                if ha <= tau and hb <= tau:
                    continue
                ha = 0.0 if abs(ha) <= tau else ha
                hb = 0.0 if abs(hb) <= tau else hb
                ua = f[0] * e[0] + f[1] * e[1] + f[2] * e[2] + f[3]
                va = f[4] * e[0] + f[5] * e[1] + f[6] * e[2] + f[7]
                ub = f[0] * e[3] + f[1] * e[4] + f[2] * e[5] + f[3]
                vb = f[4] * e[3] + f[5] * e[4] + f[6] * e[5] + f[7]
                if ha < 0.0:
                    ua, va = cut_edge(ua, va, ha, ub, vb, hb, True)
                    ha = 0.0
                elif hb < 0.0:
                    ub, vb = cut_edge(ua, va, ha, ub, vb, hb, True)
                    hb = 0.0
                ua, va, ub, vb = ua - ha * su, va - ha * sv, ub - hb * su, vb - hb * sv
                how = meets(ua, va, ub, vb, bu, bv, w, h, hull)
                if how == MISSES:
                    continue
                n_meeting += how == MEETS
                rims[n, 0], rims[n, 1], rims[n, 2], rims[n, 3] = ua, va, ub, vb
                rims[n, 4] = bins.change[c]
                n += 1
    for c in range(patches.cut_start[i], patches.cut_start[i + 1]):
        m, g = patches.cut_normal[c], patches.cuts[c]
        how = meets(g[0], g[1], g[2], g[3], bu, bv, w, h, hull)
        if how == MISSES:
            continue
        side = m[0] * b[6] + m[1] * b[7] + m[2] * b[8]
        if abs(side) < _EDGE_ON:
            return -1
        n_meeting += how == MEETS
        rims[n, :4] = g
        rims[n, 4] = 1.0 if side > 0.0 else -1.0
        n += 1
    return n if n_meeting > 0 else 0


@njit(cache=True, nogil=True)
def _find_doubts(patches, work, i, n_doubts, reach):
    """List the samples that rays must tell, each once; give their number, or -1 if too many."""
    before = patches.before[patches.cell[i] : patches.cell[i + 1]]
    n = 0
    for q in range(n_doubts):
        at = work.crossings.doubts[q]
        k = before[at]
        if before[at + 1] > k and not work.is_doubt[k]:
            if n == work.asked.size:
                n = -1
                break
            work.is_doubt[k] = True
            work.asked[n] = k
            n += 1
    if n >= 0:
        for q in range(patches.mark_start[i], patches.mark_start[i + 1]):
            if patches.mark_far[q] > reach:
                break
            k = patches.marks[q]
            if work.is_doubt[k]:
                continue
            if n == work.asked.size:
                n = -1
                break
            work.is_doubt[k] = True
            work.asked[n] = k
            n += 1
    if n < 0:
        work.is_doubt[:] = False
    return n


@njit(cache=True, nogil=True)
def _settle(patches, tree, change, masks, work, s, i, d, n_asked, last):
    """Find from crossings and one ray what is in shadow, and ask rays for samples in doubt."""
    first, end = patches.first[i], patches.first[i + 1]
    before = patches.before[patches.cell[i] : patches.cell[i + 1]]
    runs = work.crossings.runs
    n = find_runs(patches.size[i, 0], patches.size[i, 1], before, work.crossings)
    least, longest, pick = 1 << 60, 0, -1
    for q in range(n):
        a, b, count = runs[q, 0], runs[q, 1], runs[q, 2]
        if count > least or (count == least and b - a <= longest):
            continue
        k = (a + b) // 2
        if n_asked > 0 and work.is_doubt[k]:
            k = a
            while k < b and work.is_doubt[k]:
                k += 1
            if k == b:
                continue
        least, longest, pick = count, b - a, k
    is_lit = False
    if pick >= 0:
        face = _ask(patches, tree, first + pick, d, last)
        is_lit = face < 0
        if not is_lit:
            last = face
    if is_lit:
        for q in range(n):
            if runs[q, 2] != least:
                _darken(change, masks, s, first + runs[q, 0], first + runs[q, 1], end)
    else:
        _darken(change, masks, s, first, end, end)
    for q in range(n_asked):
        k = work.asked[q]
        work.is_doubt[k] = False
        was = 1
        if is_lit:
            a, b = 0, n - 1  # the run that holds it
            while a < b:
                middle = (a + b + 1) // 2
                if runs[middle, 0] <= k:
                    a = middle
                else:
                    b = middle - 1
            was = np.int64(runs[a, 2] != least)
        face = _ask(patches, tree, first + k, d, last)
        if face >= 0:
            last = face
        now = np.int64(face >= 0)
        if masks.size > 0:
            masks[s, first + k] = now
        else:
            change[first + k] += now - was
            if first + k + 1 < end:
                change[first + k + 1] -= now - was
    return last


@njit(cache=True, nogil=True)
def _darken(change, masks, s, a, b, end):
    """Put samples from a to b in shadow, in a patch that ends at ``end``."""
    if masks.size > 0:
        masks[s, a:b] = 1
        return
    change[a] += 1
    if b < end:
        change[b] -= 1


@njit(cache=True, nogil=True)
def _ask(patches, tree, k, d, last):
    """Find a face between a sample and the sun by a ray; -1 if there is none."""
    return is_hidden(
        patches.points[k], patches.normals[k], d, tree.boxes, tree.links, tree.corners, tree.ids,
        tree.normals, last,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _ask_one_by_one(patches, bins, tree, change, masks, i):
    """Ask rays for every sample of a patch, under all suns one after another."""
    first, end = patches.first[i], patches.first[i + 1]
    for k in range(first, end):
        m = patches.normals[k]
        last = -1
        for s in range(bins.basis.shape[0]):
            d = bins.basis[s, 6:9]
            if m[0] * d[0] + m[1] * d[1] + m[2] * d[2] > 0.0:
                face = _ask(patches, tree, k, d, last)
                if face < 0:
                    continue
                last = face
            _darken(change, masks, s, k, k + 1, end)


@njit(cache=True, nogil=True)
def _ask_all(patches, tree, change, masks, s, i, d, last):
    """Ask rays for every sample of a patch; give a face that hides some, or the one given."""
    first, end = patches.first[i], patches.first[i + 1]
    for k in range(first, end):
        m = patches.normals[k]
        if m[0] * d[0] + m[1] * d[1] + m[2] * d[2] > 0.0:
            face = _ask(patches, tree, k, d, last)
            if face < 0:
                continue
            last = face
        _darken(change, masks, s, k, k + 1, end)
    return last
