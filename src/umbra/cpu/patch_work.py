"""Work arrays of a count on patches, and samples that need rays."""

from typing import NamedTuple

import numpy as np

from umbra.cpu.patch_near import NearEdges
from umbra.cpu.patch_rims import CROSSINGS, Crossings
from umbra.cpu.patches import Patches
from umbra.kernels import inlined, inner
from umbra.rays.face_tree import DEEPEST

__all__ = [
    "BLOCK", "PatchWork", "count_blocks", "find_doubts", "find_run", "is_marked", "make_patch_work",
]  # fmt: skip

BLOCK = 128
"""Patches per block of a thread: their bins stay in the cache."""
_ROOM = 1024  # doubtful samples per patch and sun, plus a quarter of its samples


class PatchWork(NamedTuple):
    """
    Work arrays of a thread.

    Parameters
    ----------
    crossings : Crossings
    rims : (n, 6) float64
        From column, row to column, row; change of the count on the left; shell.
    near : NearEdges
    is_doubt : (n,) bool
        Samples of a patch that need rays.
    asked : (n,) int32
        Indices of these samples.
    stack : (DEEPEST,) int32
        Stack for searches in the tree.
    """

    crossings: Crossings
    rims: np.ndarray
    near: NearEdges
    is_doubt: np.ndarray
    asked: np.ndarray
    stack: np.ndarray


def count_blocks(patches: Patches) -> int:
    """Return the number of blocks that threads take one after another."""
    return -(-len(patches.size) // BLOCK)


@inner
def make_patch_work(patches, bins, p0, p1):
    """Make the work arrays for a block of patches."""
    widest, highest, crossings, most, cuts = 0, 0, 0, 0, 0
    for i in range(p0, p1):
        if patches.graze[i] < np.inf:
            cols, rows = patches.size[i, 0], patches.size[i, 1]
            widest, highest = max(widest, cols), max(highest, rows)
            crossings = max(crossings, cols * (rows + CROSSINGS))
            most = max(most, patches.first[i + 1] - patches.first[i])
            cuts = max(cuts, patches.cut_start[i + 1] - patches.cut_start[i])
    room = _ROOM + most // 4
    return PatchWork(
        Crossings(
            np.zeros(widest + 1, np.int32),
            np.zeros(widest + 1, np.int32),
            np.zeros(crossings, np.int64),
            np.zeros(room, np.int64),
            np.zeros((most, 3), np.int64),
            np.zeros(highest + 1, np.int32),
        ),
        np.zeros((bins.most + cuts, 6)),
        NearEdges(
            # Not cleared: the few edges near a patch are written, the rest of many is never met.
            np.empty((6, bins.most)),
            np.empty((bins.most, 3), np.int64),
            np.empty(bins.most + 1, np.int32),
            np.zeros(bins.most, np.int32),
        ),
        np.zeros(most, np.bool_),
        np.zeros(room, np.int32),
        np.zeros(DEEPEST, np.int32),
    )


@inlined
def is_marked(patches, i, k, reach):
    """Return whether a sample lies near another face that is close to the plane."""
    for q in range(patches.mark_start[i], patches.mark_start[i + 1]):
        if patches.mark_far[q] > reach:
            return False
        if patches.marks[q] == k:
            return True
    return False


@inlined
def find_doubts(patches, work, i, n_doubts, reach):
    """List the samples that need rays, each once; return their number, or -1 if too many."""
    cell = patches.cell[i]
    n = 0
    for q in range(n_doubts):
        at = work.crossings.doubts[q]
        k = patches.before[cell + at]
        if patches.before[cell + at + 1] > k and not work.is_doubt[k]:
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


@inlined
def find_run(runs, n, k):
    """Find the run that contains a sample."""
    a, b = 0, n - 1
    while a < b:
        middle = (a + b + 1) // 2
        if runs[middle, 0] <= k:
            a = middle
        else:
            b = middle - 1
    return a
