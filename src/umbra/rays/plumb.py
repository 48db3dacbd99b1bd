"""What a plumb line meets: the height and the face of a surface at places of the plan."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.kernels import run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.hidden import get, list_hiding

__all__ = ["drop_plumb"]

_BLOCK = 64  # places per block of a thread
_UPRIGHT = 1e-9  # upward part of a normal of a face that has no height at a place


def drop_plumb(
    tree: FaceTree, plan: NDArray[np.float64], floor: float, threads: int = 1
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.intp]]:
    """
    Find the topmost face at places of the plan.

    Parameters
    ----------
    tree : FaceTree
    plan : (n, 2) float64
        In the tree's frame [m].
    floor : float
        A height below all faces [m].
    threads : int

    Returns
    -------
    z : (n,) float64
        Height of the topmost face [m]; NaN where there is none.
    normals : (n, 3) float64
        Its upward unit normal; NaN where there is none.
    count : (n,) int
        Number of faces above the floor.
    """
    z, normals = np.full(len(plan), np.nan), np.full((len(plan), 3), np.nan)
    count = np.zeros(len(plan), np.intp)
    if len(tree.corners):
        use_threads(threads)
        blocks = -(-len(plan) // _BLOCK)
        run_shared(blocks, _drop, np.ascontiguousarray(plan), floor, tree, z, normals, count)
    return z, normals, count


@njit(cache=True, nogil=True)
def _drop(plan, floor, tree, z, normals, count, taken):
    n = plan.shape[0]
    while True:
        block = take_next(taken)
        if block >= (n + _BLOCK - 1) // _BLOCK:
            return
        stack = np.zeros(DEEPEST, np.int32)
        found = np.zeros(tree.corners.shape[0], np.int64)
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            p = plan[i, 0], plan[i, 1], floor
            met = list_hiding(p, (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), tree, stack, found)
            count[i] = met
            for k in range(met):
                f = found[k]
                x, y, up = get(tree.normals, f)
                if abs(up) < _UPRIGHT:
                    continue
                a, b, c = get(tree.corners, f)
                height = c + (x * (a - p[0]) + y * (b - p[1])) / up
                if not height <= z[i]:
                    z[i] = height
                    side = 1.0 if up > 0.0 else -1.0
                    normals[i] = side * x, side * y, side * up
