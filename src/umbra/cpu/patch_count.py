"""
Shadows on planar patches, counted by the rims of shadow volumes.

For a patch that faces the sun, the silhouette edges that may lie between it and the sun are
projected onto its plane; where a casting face passes through the plane, the intersection closes
their chains. Crossings determine the count at every sample up to a constant, which rays find. One
is cast first, from the sample that was lit under the last sun: if it is lit, its count is 0; if a
shell without rims across the patch hides it, every sample is in shadow. Else a ray from a sample of
least count decides: if that is hidden, every sample is. A patch without rims needs only the first.

Rays decide where crossings in float64 cannot: samples within rounding of a rim, or near another
face that is almost in the plane. They count patches of few samples, patches at grazing sun, and
those whose bins hold many edges for each sample, as under low suns: there rays are faster.
"""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.patch_bins import EdgeBinner
from umbra.cpu.patch_near import find_errors, find_near_edges, pick_near
from umbra.cpu.patch_rays import ask, ask_all, darken, get_sun
from umbra.cpu.patch_rims import add_rim, clear, find_rim_runs
from umbra.cpu.patch_search import find_rims, is_covered
from umbra.cpu.patch_work import (
    BLOCK,
    count_blocks,
    find_doubts,
    find_run,
    is_marked,
    make_patch_work,
)
from umbra.cpu.patches import Patches
from umbra.cpu.sun_groups import find_groups
from umbra.kernels import borrowing, inlined, kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.face_tree import FaceTree

__all__ = ["PatchCounter"]

_SUNS = 64  # suns binned at a time
_IN_SHADOW, _IN_SUN = 1.0, 0.1
"""
Samples for each edge near a patch up to which rays take less time than rims. After one in shadow
rays cost little, as the face that hid it hides its neighbours, too. Measured.
"""
_PER_TEST = 0.2  # samples and suns for each eight edges in its bins, the same


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
        masks = np.zeros((len(suns), self.size), np.uint8)
        nothing = np.zeros((0, 0), np.int32)
        for which, first in _batch(suns):
            found = np.zeros((len(which), self.size), np.uint8)
            self._run(suns[which], first, found, (nothing, nothing))
            for sun, mask in zip(which, found, strict=True):
                masks[sun, self._patches.where] = mask
        return masks

    def add_weights(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """
        Add to each sample the weights of the suns that leave it in shadow.

        Parameters
        ----------
        suns : (n, 3) float64
        weights : (n, k) int32
        sums : (k, n_samples) int32
            Added to.
        progress : callable
            Called now and then with the number of suns done.
        """
        nothing = np.zeros((0, 0), np.uint8)
        change = np.zeros((self.size, len(sums)), np.int32)
        for which, first in _batch(suns):
            own = np.ascontiguousarray(weights[which])
            self._run(suns[which], first, nothing, (own, change))
            progress(len(which))
        patches = self._patches
        run_shared(count_blocks(patches), _add_changes, patches.first, patches.where, change, sums)

    def _run(
        self,
        suns: NDArray[np.float64],
        first: NDArray[np.int64],
        masks: NDArray[np.uint8],
        sums: tuple[NDArray[np.int32], NDArray[np.int32]],
    ) -> None:
        """Fill in masks, if any; otherwise add to the changes of sums, given as in ``darken``."""
        use_threads(self._threads)
        bins = self._binner.bin(suns, first)
        patches, n = self._patches, len(self._patches.size)

        def count(taken: NDArray[np.int64]) -> None:
            work = make_patch_work(patches, bins, 0, n)
            last, known = np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.int64)
            _count_blocks(
                patches, bins, self._binner.edges, self._tree, sums, masks, work, last, known, n,
                taken,
            )  # fmt: skip

        run_shared(count_blocks(patches), count)


def _batch(
    suns: NDArray[np.float64],
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.int64]]]:
    """Give the suns that are counted at once, and the first of each of their groups."""
    order, first = find_groups(suns)
    g = 0
    while g < len(first) - 1:
        end = max(g + 1, int(np.searchsorted(first, first[g] + _SUNS, "right")) - 1)
        yield order[first[g] : first[end]], first[g : end + 1] - first[g]
        g = end


@kernel
def _add_changes(first, where, change, sums, taken):
    """Add up the changes from sample to sample of each patch, and add them to the sums."""
    n = first.size - 1
    while True:
        p0 = BLOCK * take_next(taken)
        if p0 >= n:
            return
        for i in range(p0, min(n, p0 + BLOCK)):
            for c in range(change.shape[1]):
                held = np.int32(0)
                for k in range(first[i], first[i + 1]):
                    held += change[k, c]
                    sums[c, where[k]] += held


@borrowing
def _count_blocks(patches, bins, edges, tree, sums, masks, work, last, known, n, taken):
    """
    Count blocks of patches until all ``n`` patches are taken.

    For each patch of a block, ``last`` is the face that hid the last sun, as it usually still does,
    and ``known`` the sample whose ray is cast first.
    """
    look = 0
    n_suns = bins.suns.shape[0]
    while True:
        p0 = BLOCK * take_next(taken)
        if p0 >= n:
            return
        p1 = min(n, p0 + BLOCK)
        for i in range(p0, p1):
            last[i - p0] = -1
            known[i - p0] = (patches.first[i] + patches.first[i + 1]) // 2
            if patches.graze[i] == np.inf:  # few samples
                ask_all(patches, bins, tree, work.stack, sums, masks, i, 0, n_suns, -1)
        for g in range(bins.first.size - 1):
            for i in range(p0, p1):
                if patches.graze[i] == np.inf:
                    continue
                look += 1
                s0, s1 = bins.first[g], bins.first[g + 1]
                n_near = find_near_edges(patches, bins, edges, work.near, g, i, look, _PER_TEST)
                if n_near < 0:
                    last[i - p0] = ask_all(
                        patches, bins, tree, work.stack, sums, masks, i, s0, s1, last[i - p0]
                    )
                    continue
                for s in range(s0, s1):
                    last[i - p0], known[i - p0] = _count_patch(
                        patches, bins, edges, tree, sums, masks, work, n_near, s, i, last[i - p0],
                        known[i - p0],
                    )  # fmt: skip


@partial(borrowing, inline="always")  # here alone: it is compiled once
def _count_patch(patches, bins, edges, tree, sums, masks, work, n_near, s, i, last, k):
    """
    Count a patch for one sun, with ``n_near`` edges near it under the sun's group.

    ``last`` is a face that may hide the sun, and ``k`` the sample that is asked first. Returns both
    for the next sun.
    """
    d, f = get_sun(bins, s), patches.frame
    sine = f[i, 8] * d[0] + f[i, 9] * d[1] + f[i, 10] * d[2]
    first, end = patches.first[i], patches.first[i + 1]
    if sine <= -patches.graze[i]:
        darken(sums, masks, s, first, end, end)
        return last, k
    face, changes, n_asked = np.int64(-1), 0, -1
    if sine >= patches.graze[i]:
        way, error = find_errors(patches, i, d, sine)
        face = ask(patches, tree, work.stack, k, d, last)
        last = last if face < 0 else face
        n = pick_near(patches, bins, work.near, n_near, s, i, way, error)
        share = _IN_SUN if face < 0 else _IN_SHADOW
        if end - first > share * n:
            n_rims = -1
            # Faces close to the plane may hide this sample without any rims.
            if face >= 0 and not is_marked(patches, i, k - first, error[2]):
                shell = edges.face_shell[tree.source[face]]
                if is_covered(patches, bins, edges, tree, work.near, n, s, i, way, error, shell):
                    n_rims = 0
            if n_rims < 0:
                n_rims = find_rims(patches, bins, edges, tree, work, n, s, i, way, error)
            changes, n_asked = _add_rims(patches, work, i, n_rims, error)
    if n_asked < 0:
        return ask_all(patches, bins, tree, work.stack, sums, masks, i, s, s + 1, last), k
    if changes == 0 and n_asked == 0:
        if face >= 0:
            darken(sums, masks, s, first, end, end)
        return last, k
    return _settle(patches, tree, sums, masks, work, s, i, d, n_asked, last, k, face < 0)


@inlined
def _add_rims(patches, work, i, n_rims, error):
    """
    Add the rims found, and list doubtful samples.

    Returns whether the count changes anywhere, and the number of doubtful samples, or -1 if rays
    must be cast.
    """
    cols, rows = patches.size[i, 0], patches.size[i, 1]
    changes, n_doubts, r, c = 0, 0, work.rims, work.crossings
    for q in range(n_rims):
        t, n_doubts = add_rim(
            r[q, 0], r[q, 1], r[q, 2], r[q, 3], np.int64(r[q, 4]), error[0], error[1], cols, rows,
            c, n_doubts,
        )  # fmt: skip
        if t < 0 or n_doubts > c.doubts.size:
            n_rims = -1
            break
        changes += t
    n_asked = -1
    if n_rims >= 0:
        n_asked = find_doubts(patches, work, i, n_doubts, error[2])
    if n_asked < 0:
        clear(cols, c)
    return changes, n_asked


@inlined
def _settle(patches, tree, sums, masks, work, s, i, d, n_asked, last, known, is_lit):
    """
    Find the samples in shadow by crossings and one ray; cast rays for doubtful samples.

    ``is_lit`` tells of the sample ``known``. Returns a face that hides the sun, and a lit sample.
    """
    first, end = patches.first[i], patches.first[i + 1]
    runs = work.crossings.runs
    n = find_rim_runs(
        patches.size[i, 0], patches.size[i, 1], patches.before, patches.cell[i], work.crossings
    )
    is_known = not work.is_doubt[known - first]
    least = runs[find_run(runs, n, known - first), 2]
    pick = -1
    if not (is_known and is_lit):
        lowest, pick = _find_lowest(runs, n, work.is_doubt, n_asked)
        is_lit = False
        if is_known and least == lowest:
            pick = -1  # known to be hidden
        least = lowest
    for q in range(-1, n_asked):
        k = pick if q < 0 else np.int64(work.asked[q])
        face = np.int64(-1)
        if k >= 0:
            face = ask(patches, tree, work.stack, first + k, d, last)
            last = last if face < 0 else face
        if q < 0:
            if pick >= 0:
                known, is_lit = first + pick, face < 0
            if is_lit:
                for t in range(n):
                    if runs[t, 2] != least:
                        darken(sums, masks, s, first + runs[t, 0], first + runs[t, 1], end)
            else:
                darken(sums, masks, s, first, end, end)
            continue
        work.is_doubt[k] = False
        was = 1
        if is_lit:
            was = np.int64(runs[find_run(runs, n, k), 2] != least)
        now = np.int64(face >= 0)
        if masks.size > 0:
            masks[s, first + k] = now
        else:
            weights, change = sums
            for c in range(weights.shape[1]):
                more = np.int32(now - was) * weights[s, c]
                change[first + k, c] += more
                if first + k + 1 < end:
                    change[first + k + 1, c] -= more
    return last, known


@inlined
def _find_lowest(runs, n, is_doubt, n_asked):
    """Find the least count, and a sample of its longest run that is not doubtful; -1 for none."""
    least, longest, pick = 1 << 60, 0, np.int64(-1)
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
