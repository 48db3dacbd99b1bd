"""
Nearest hits of rays: of points in many directions, and of plumb lines at places of the plan.

Weights of directions are summed by the group of faces that takes them.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, dot, kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.hidden import get, list_hiding

__all__ = ["add_taken", "drop_plumb"]

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


@kernel
def _add(tree, owner, points, normals, facing, directions, weights, taken, blocks):
    n = points.shape[0]
    while True:
        block = take_next(blocks)
        if block >= (n + _BLOCK - 1) // _BLOCK:
            return
        stack = np.zeros(DEEPEST, np.int32)
        hits = np.zeros(owner.size, np.int32)
        first, end = block * _BLOCK, min(n, (block + 1) * _BLOCK)
        _add_block(
            tree, owner, points, normals, facing, directions, weights, taken, stack, hits, first,
            end,
        )  # fmt: skip


@borrowing
def _add_block(
    tree, owner, points, normals, facing, directions, weights, taken, stack, hits, first, end
):
    for i in range(first, end):
        p, n, up = get(points, i), get(normals, i), get(facing, i)
        for k in range(directions.shape[0]):
            d = get(directions, k)
            cosine = dot(up, d)
            if cosine <= 0.0:
                continue
            best, nearest = -1, np.inf
            for which in range(list_hiding(p, n, d, tree, stack, hits)):
                f = np.int64(hits[which])
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


_PLACES = 64  # places per block of a thread
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
        blocks = -(-len(plan) // _PLACES)
        run_shared(blocks, _drop, np.ascontiguousarray(plan), floor, tree, z, normals, count)
    return z, normals, count


@kernel
def _drop(plan, floor, tree, z, normals, count, taken):
    n = plan.shape[0]
    while True:
        block = take_next(taken)
        if block >= (n + _PLACES - 1) // _PLACES:
            return
        stack = np.zeros(DEEPEST, np.int32)
        hits = np.zeros(tree.corners.shape[0], np.int32)
        for i in range(block * _PLACES, min(n, (block + 1) * _PLACES)):
            p = plan[i, 0], plan[i, 1], floor
            met = list_hiding(p, (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), tree, stack, hits)
            count[i] = met
            for k in range(met):
                f = np.int64(hits[k])
                x, y, up = get(tree.normals, f)
                if abs(up) < _UPRIGHT:
                    continue
                a, b, c = get(tree.corners, f)
                height = c + (x * (a - p[0]) + y * (b - p[1])) / up
                if not height <= z[i]:
                    z[i] = height
                    side = 1.0 if up > 0.0 else -1.0
                    normals[i] = side * x, side * y, side * up
