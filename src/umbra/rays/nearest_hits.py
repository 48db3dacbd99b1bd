"""What is nearest to points in many directions: weights of directions, summed by who takes them."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.kernels import borrowing, dot, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.hidden import get, list_hiding

__all__ = ["add_taken"]

_BLOCK = 16  # points per block of a thread


def add_taken(
    tree: FaceTree,
    owner: NDArray[np.int32],
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    facing: NDArray[np.float64],
    directions: NDArray[np.float64],
    weights: NDArray[np.float64],
    taken: NDArray[np.float64],
    threads: int = 1,
) -> None:
    """
    Add what the nearest face takes of each direction before a point's plane, by its owner.

    Parameters
    ----------
    tree : FaceTree
    owner : (n_faces,) int32
        Owner of each of the tree's faces.
    points, normals : (n, 3) float64
        As of ``find_hidden``: which faces hide a direction is decided alike.
    facing : (n, 3) float64
        Unit normals of the planes.
    directions : (m, 3) float64
    weights : (m,) float64
        Each is taken times the cosine at the plane's normal.
    taken : (n, n_owners) float64
        Added to. Of equally near faces the lower owner takes all.
    threads : int
    """
    use_threads(threads)
    given = tree, owner, points, normals, facing, directions, weights, taken
    run_shared(-(-len(points) // _BLOCK), _add, *given)


@njit(cache=True, nogil=True)
def _add(tree, owner, points, normals, facing, directions, weights, taken, blocks):
    n = points.shape[0]
    while True:
        block = take_next(blocks)
        if block >= (n + _BLOCK - 1) // _BLOCK:
            return
        stack = np.zeros(DEEPEST, np.int32)
        found = np.zeros(owner.size, np.int32)
        first, end = block * _BLOCK, min(n, (block + 1) * _BLOCK)
        _add_block(
            tree, owner, points, normals, facing, directions, weights, taken, stack, found, first,
            end,
        )  # fmt: skip


@borrowing
def _add_block(
    tree, owner, points, normals, facing, directions, weights, taken, stack, found, first, end
):
    for i in range(first, end):
        p, n, up = get(points, i), get(normals, i), get(facing, i)
        for k in range(directions.shape[0]):
            d = get(directions, k)
            cosine = dot(up, d)
            if cosine <= 0.0:
                continue
            best, nearest = -1, np.inf
            for which in range(list_hiding(p, n, d, tree, stack, found)):
                f = np.int64(found[which])
                away = _find_distance(tree, f, p, d)
                if away < nearest or (away == nearest and owner[f] < best):
                    best, nearest = owner[f], away
            if best >= 0:
                taken[i, best] += cosine * weights[k]


@borrowing
def _find_distance(tree, f, p, d):
    """Return the distance along a direction to the plane of a face, 0 if it lies in the plane."""
    m, c = get(tree.normals, f), get(tree.corners, f)
    along = dot(m, d)
    if along == 0.0:
        return 0.0
    return (m[0] * (c[0] - p[0]) + m[1] * (c[1] - p[1]) + m[2] * (c[2] - p[2])) / along
