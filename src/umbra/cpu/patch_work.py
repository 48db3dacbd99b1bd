"""Work arrays of a count on patches, and samples that need rays."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import get_num_threads, types
from numba.extending import intrinsic

from umbra.cpu.patch_rims import CROSSINGS, Crossings
from umbra.kernels import inlined, inner
from umbra.rays.face_tree import DEEPEST

__all__ = [
    "BLOCK", "PatchWork", "find_doubts", "find_errors", "find_run", "is_marked", "make_patch_work",
    "run_blocks", "take_next",
]  # fmt: skip

BLOCK = 32
"""Patches per block of a thread: their bins stay in the cache."""
_ROOM = 1024  # doubtful samples per patch and sun, plus a quarter of its samples
_EPS = 1e-7  # rounding error of a rim [squares]


class PatchWork(NamedTuple):
    """
    Work arrays of a thread.

    Parameters
    ----------
    crossings : Crossings
    rims : (n, 6) float64
        From column, row to column, row; change of the count on the left; shell.
    stamp : (most,) int32
        Last search that found each silhouette edge.
    is_doubt : (n,) bool
        Samples of a patch that need rays.
    asked : (n,) int32
        Indices of these samples.
    stack : (DEEPEST,) int32
        Stack for searches in the tree.
    """

    crossings: Crossings
    rims: np.ndarray
    stamp: np.ndarray
    is_doubt: np.ndarray
    asked: np.ndarray
    stack: np.ndarray


def run_blocks(kernel: Callable[..., None], *arguments: Any) -> None:
    """
    Run a kernel on numba's number of threads; it takes blocks by ``take_next`` of its last array.

    numba's own parallel loops take long to compile for so many arrays.
    """
    taken = np.zeros(1, np.int64)
    threads = get_num_threads()
    if threads == 1:
        kernel(*arguments, taken)
        return
    with ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(kernel, *arguments, taken) for _ in range(threads)]:
            done.result()


@intrinsic
def take_next(_: Any, taken: Any) -> Any:  # numpydoc ignore=RT01
    """Return the number in an array of one int64, and add one for the next thread."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.atomic_rmw("add", data, ir.IntType(64)(1), "monotonic")

    return types.int64(taken), generate


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
        np.zeros(bins.most, np.int32),
        np.zeros(most, np.bool_),
        np.zeros(room, np.int32),
        np.zeros(DEEPEST, np.int32),
    )


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
