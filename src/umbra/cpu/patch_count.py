"""
Shadows on planar patches, counted by the rims of shadow volumes.

For a patch that faces the sun, the silhouette edges that may lie between it and the sun are
projected onto its plane; where a casting face passes through the plane, the intersection closes
their chains. Crossings determine the count at every sample up to a constant, which rays find. One
is cast first, from the sample that was lit under the last sun: if it is lit, its count is 0; if a
shell without rims across the patch hides it, every sample is in shadow. Else a ray from a sample of
least count decides: if that is hidden, every sample is. A patch without rims needs only the first.

Rays decide where crossings in float64 cannot: samples within rounding of a rim, or near another
face that is almost in the plane; patches of few samples, and patches at grazing sun.
"""

from collections.abc import Callable

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.cpu.patch_bins import EdgeBinner
from umbra.cpu.patch_rays import ask, ask_all, ask_one_by_one, darken
from umbra.cpu.patch_rims import add_rim, clear, find_rims, find_runs
from umbra.cpu.patch_work import (
    BLOCK,
    find_doubts,
    find_errors,
    find_run,
    is_marked,
    make_patch_work,
)
from umbra.cpu.patches import Patches
from umbra.kernels import borrowing, inlined
from umbra.machine import use_threads
from umbra.rays.face_tree import FaceTree

__all__ = ["PatchCounter"]

_SUNS = 64  # suns binned at a time


class PatchCounter:
    """
    Counts shadows on samples of surfaces.

    Parameters
    ----------
    patches : Patches
        The samples.
    binner : EdgeBinner
        Edges of the caster; counters of other samples may share it.
    tree : FaceTree
        Hierarchy over the caster's faces.
    threads : int
    """

    def __init__(
        self, patches: Patches, binner: EdgeBinner, tree: FaceTree, threads: int = 1
    ) -> None:
        self._patches, self._threads = patches, threads
        self._binner, self._tree = binner, tree

    @property
    def size(self) -> int:
        """Number of samples."""
        return len(self._patches.where)

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """
        Return the samples in cast or attached shadow for each sun.

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
        Add to each sample the number of suns that leave it in shadow.

        Parameters
        ----------
        suns : (n, 3) float64
        steps : (n_samples,) int32
            Added to.
        progress : callable
            Called now and then with the number of suns done.
        """
        nothing = np.zeros((0, 0), np.uint8)
        for first in range(0, len(suns), _SUNS):
            some = suns[first : first + _SUNS]
            steps[self._patches.where] += self._run(some, nothing)
            progress(len(some))

    def _run(self, suns: NDArray[np.float64], masks: NDArray[np.uint8]) -> NDArray[np.int32]:
        """Fill in masks, if any; otherwise return each sample's number of suns in shadow."""
        use_threads(self._threads)
        suns = np.ascontiguousarray(suns)
        change = np.zeros(0 if masks.size else len(self._patches.where), np.int32)
        bins = self._binner.bin(suns)
        _count(self._patches, bins, self._binner.edges, self._tree, change, masks)
        return change


@njit(cache=True, nogil=True, parallel=True)
def _count(patches, bins, edges, tree, change, masks):
    n = patches.size.shape[0]
    for block in prange((n + BLOCK - 1) // BLOCK):
        _count_block(
            patches, bins, edges, tree, change, masks, block * BLOCK, min(n, (block + 1) * BLOCK)
        )


@njit(cache=True, nogil=True)
def _count_block(patches, bins, edges, tree, change, masks, p0, p1):
    work = make_patch_work(patches, bins, p0, p1)
    last = np.full(p1 - p0, -1, np.int64)
    asked = (patches.first[p0:p1] + patches.first[p0 + 1 : p1 + 1]) // 2
    _count_patches(patches, bins, edges, tree, change, masks, work, p0, p1, last, asked)


@borrowing
def _count_patches(patches, bins, edges, tree, change, masks, work, p0, p1, last, asked):
    """
    Count a block of patches.

    For each patch, ``last`` is the face that hid the last sun, as it usually still does, and
    ``asked`` the sample whose ray is cast first.
    """
    look = 0
    for i in range(p0, p1):
        if patches.graze[i] == np.inf:
            ask_one_by_one(patches, bins, tree, work.stack, change, masks, i)
    for s in range(bins.basis.shape[0]):
        for i in range(p0, p1):
            if patches.graze[i] == np.inf:
                continue
            look += 1
            last[i - p0], asked[i - p0] = _count_patch(
                patches, bins, edges, tree, change, masks, work, s, i, look, last[i - p0],
                asked[i - p0],
            )  # fmt: skip
    if masks.size == 0:
        for i in range(p0, p1):
            for k in range(patches.first[i] + 1, patches.first[i + 1]):
                change[k] += change[k - 1]


@inlined
def _count_patch(patches, bins, edges, tree, change, masks, work, s, i, look, last, k):
    """
    Count a patch for one sun.

    ``last`` is a face that may hide the sun, and ``k`` the sample that is asked first. Returns both
    for the next sun.
    """
    d = (bins.basis[s, 6], bins.basis[s, 7], bins.basis[s, 8])
    f = patches.frame
    sine = f[i, 8] * d[0] + f[i, 9] * d[1] + f[i, 10] * d[2]
    if sine <= -patches.graze[i]:
        end = patches.first[i + 1]
        darken(change, masks, s, patches.first[i], end, end)
        return last, k
    if sine >= patches.graze[i]:
        is_counted, last, k = _count_rims(
            patches, bins, edges, tree, change, masks, work, s, i, look, last, k
        )
        if is_counted:
            return last, k
    return ask_all(patches, tree, work.stack, change, masks, s, i, d, last), k


@inlined
def _count_rims(
    patches, bins, edges, tree, change, masks, work, s, i, look, last, k
):  # fmt: skip
    """Count a patch by its rims; return whether it could be, and ``last`` and ``k`` anew."""
    d = (bins.basis[s, 6], bins.basis[s, 7], bins.basis[s, 8])
    f = patches.frame
    sine = f[i, 8] * d[0] + f[i, 9] * d[1] + f[i, 10] * d[2]
    first, end = patches.first[i], patches.first[i + 1]
    tau = patches.tau[i]
    cols, rows = patches.size[i, 0], patches.size[i, 1]
    way, (bu, bv) = find_errors(patches, i, d, sine)
    face = ask(patches, tree, work.stack, k, d, last)
    shell = -1
    if face >= 0:
        last = face
        if not is_marked(patches, i, k - first, 2.0 * tau / sine):
            shell = edges.face_shell[tree.source[face]]
    n_rims = find_rims(patches, bins, edges, tree, work, s, i, look, way, (bu, bv), shell)
    if n_rims < 0:
        return False, last, k
    changes, n_doubts = 0, 0
    c = work.crossings
    for q in range(n_rims):
        r = work.rims
        t, n_doubts = add_rim(
            r[q, 0], r[q, 1], r[q, 2], r[q, 3], np.int64(r[q, 4]), bu, bv, cols, rows, c, n_doubts
        )
        if t < 0 or n_doubts > c.doubts.size:
            clear(cols, c)
            return False, last, k
        changes += t
    n_asked = find_doubts(patches, work, i, n_doubts, 2.0 * tau / sine)
    if n_asked < 0:
        clear(cols, c)
        return False, last, k
    if changes == 0 and n_asked == 0:
        if face >= 0:
            darken(change, masks, s, first, end, end)
        return True, last, k
    last, k = _settle(
        patches, tree, change, masks, work, s, i, d, n_asked, last, k, face < 0
    )  # fmt: skip
    return True, last, k


@inlined
def _settle(patches, tree, change, masks, work, s, i, d, n_asked, last, known, is_lit):
    """
    Find the samples in shadow by crossings and one ray; cast rays for doubtful samples.

    ``is_lit`` tells of the sample ``known``. Returns a face that hides the sun, and a lit sample.
    """
    first, end = patches.first[i], patches.first[i + 1]
    runs = work.crossings.runs
    n = find_runs(
        patches.size[i, 0], patches.size[i, 1], patches.before, patches.cell[i], work.crossings
    )
    is_known = not work.is_doubt[known - first]
    least = runs[find_run(runs, n, known - first), 2]
    if not (is_known and is_lit):
        lowest, pick = _find_lowest(runs, n, work.is_doubt, n_asked)
        is_lit = False
        if pick >= 0 and not (is_known and least == lowest):  # else it is known to be hidden
            known = first + pick
            face = ask(patches, tree, work.stack, known, d, last)
            is_lit = face < 0
            last = last if is_lit else face
        least = lowest
    if is_lit:
        for q in range(n):
            if runs[q, 2] != least:
                darken(change, masks, s, first + runs[q, 0], first + runs[q, 1], end)
    else:
        darken(change, masks, s, first, end, end)
    for q in range(n_asked):
        k = work.asked[q]
        work.is_doubt[k] = False
        was = 1
        if is_lit:
            was = np.int64(runs[find_run(runs, n, k), 2] != least)
        face = ask(patches, tree, work.stack, first + k, d, last)
        if face >= 0:
            last = face
        now = np.int64(face >= 0)
        if masks.size > 0:
            masks[s, first + k] = now
        else:
            change[first + k] += now - was
            if first + k + 1 < end:
                change[first + k + 1] -= now - was
    return last, known


@inlined
def _find_lowest(runs, n, is_doubt, n_asked):
    """Find the least count, and a sample of its longest run that is not doubtful; -1 for none."""
    least, longest, pick = 1 << 60, 0, -1
    for q in range(n):
        a, b, count = runs[q, 0], runs[q, 1], runs[q, 2]
        if count > least or (count == least and b - a <= longest):
            continue
        k = (a + b) // 2
        if n_asked > 0 and is_doubt[k]:
            k = a
            while k < b and is_doubt[k]:
                k += 1
            if k == b:
                continue
        least, longest, pick = count, b - a, k
    return least, pick
