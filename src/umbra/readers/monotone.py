"""
Triangulation of large polygons with holes: a sweep into monotone pieces, then triangles.

Ear clipping takes O(corners² + corners holes) time, this O(n log n) (de Berg et al.,
Computational Geometry, chapter 3). A line sweeps from left to right over the corners and keeps
its intervals of the inside, from below upward, in a skip list. Rings that cross or touch
themselves may be refused.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel

__all__ = ["cut_by_sweep", "is_tangled"]

_LEVELS = 16  # of the skip list


def cut_by_sweep(
    points: NDArray[np.float64], following: NDArray[np.int64]
) -> NDArray[np.int64] | None:
    """
    Cut a polygon of corners (n, 2) into counter-clockwise triangles (m, 3).

    ``following`` (n,) is the next corner in each corner's ring; the outside is counter-clockwise,
    holes clockwise. None if the rings cross or touch, so that triangles would not cover what the
    rings enclose once.
    """
    n = len(points)
    order = np.lexsort((points[:, 1], points[:, 0]))
    rank = np.zeros(n, np.int64)
    rank[order] = np.arange(n)
    before = np.zeros(n, np.int64)
    before[following] = np.arange(n)
    x, y = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
    diagonals = _find_diagonals(x, y, before, following, order, rank)
    if (diagonals < 0).any():
        return None
    origin, onward = _link(points, following, diagonals)
    triangles = _cut_pieces(x, y, origin, onward, rank)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    doubled = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    near = points - points[0]
    after = near[following]
    whole = (near[:, 0] * after[:, 1] - near[:, 1] * after[:, 0]).sum()
    exact = abs(doubled.sum() - whole) <= 1e-9 * abs(whole)
    return triangles if exact and doubled.min(initial=0.0) >= -1e-9 * abs(whole) / n else None


def _link(
    points: NDArray[np.float64], following: NDArray[np.int64], diagonals: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """
    Link the pieces: return each half-edge's origin, and the next half-edge.

    Half-edges are the rings' edges, by their origin, then each diagonal both ways.
    """
    n, m = len(points), len(diagonals)
    origin = np.concatenate([np.arange(n), diagonals.ravel()])
    end = np.concatenate([following, diagonals[:, ::-1].ravel()])
    ahead = points[following[origin]] - points[origin]
    way = points[end] - points[origin]
    angle = np.arctan2(ahead[:, 0] * way[:, 1] - ahead[:, 1] * way[:, 0], (ahead * way).sum(1)) % (
        2 * np.pi
    )
    angle[:n] = -1.0
    # Half-edges out of a corner, counter-clockwise from the ring's own.
    by_corner = np.lexsort((angle, origin))
    position = np.zeros(n + 2 * m, np.int64)
    position[by_corner] = np.arange(n + 2 * m)
    last = np.cumsum(np.bincount(origin, minlength=n)) - 1
    onward = np.zeros(n + 2 * m, np.int64)
    onward[:n] = by_corner[last[following]]
    twin = n + (np.arange(2 * m) ^ 1)
    onward[n:] = by_corner[position[twin] - 1]
    return origin, onward


@kernel
def _turn(x, y, a, b, c):
    """Return twice the signed area of the corners a, b, c: positive if c is left of a to b."""
    return (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])


@kernel
def _find_diagonals(x, y, before, following, order, rank):
    """
    Find the diagonals that leave monotone pieces; one row of -1 if the rings forbid it.

    An edge is named by the corner that it begins at. Each interval has the edge below it, which
    runs to the right, and the one above, which runs to the left.
    """
    n = len(order)
    failed = np.full((1, 2), -1, np.int64)
    diagonals = np.zeros((2 * n, 2), np.int64)
    count = 0
    below = np.full(n + 1, -1, np.int64)
    above = np.full(n + 1, -1, np.int64)
    helper = np.full(n + 1, -1, np.int64)
    merges = np.zeros(n + 1, np.bool_)
    interval = np.full(n, -1, np.int64)  # of each edge that the line meets
    head = n
    right = np.full((n + 1, _LEVELS), -1, np.int64)
    left = np.full((n + 1, _LEVELS), -1, np.int64)
    height = np.zeros(n + 1, np.int64)
    path = np.zeros(_LEVELS, np.int64)
    used = 0
    for v in order:
        p, q = before[v], following[v]
        p_left, q_left = rank[p] < rank[v], rank[q] < rank[v]
        if p_left != q_left:
            edge = p if p_left else v
            node = interval[edge]
            if node < 0 or (below[node] if p_left else above[node]) != edge:
                return failed
            if merges[node]:
                diagonals[count] = v, helper[node]
                count += 1
            if p_left:
                below[node] = v
                interval[v] = node
            else:
                above[node] = p
                interval[p] = node
            helper[node], merges[node] = v, False
        elif p_left:
            upper, lower = interval[p], interval[v]
            if upper < 0 or lower < 0 or below[upper] != p or above[lower] != v:
                return failed
            if merges[upper]:
                diagonals[count] = v, helper[upper]
                count += 1
            if upper != lower:
                if merges[lower]:
                    diagonals[count] = v, helper[lower]
                    count += 1
                above[lower] = above[upper]
                interval[above[upper]] = lower
                helper[lower], merges[lower] = v, True
            for level in range(height[upper]):
                earlier, later = left[upper, level], right[upper, level]
                right[earlier, level] = later
                if later >= 0:
                    left[later, level] = earlier
        else:
            at = head
            for k in range(_LEVELS):
                level = _LEVELS - 1 - k
                while True:
                    later = right[at, level]
                    if later < 0:
                        break
                    edge = below[later]
                    if _turn(x, y, edge, following[edge], v) < 0:
                        break
                    at = later
                path[level] = at
            node = used
            used += 1
            below[node], helper[node] = v, v
            interval[v] = node
            if _turn(x, y, p, v, q) > 0:
                above[node] = p
                interval[p] = node
            else:
                if at == head:
                    return failed
                edge = above[at]
                if _turn(x, y, following[edge], edge, v) > 0:
                    return failed
                diagonals[count] = v, helper[at]
                count += 1
                above[node] = edge
                interval[edge] = node
                above[at] = p
                interval[p] = at
                helper[at], merges[at] = v, False
            # One of two nodes is a level higher, by bits of a multiple: deterministic.
            tall = 1
            bits = (node * 2654435761) & 0xFFFFFFFF
            while tall < _LEVELS and bits & (1 << (31 - tall)):
                tall += 1
            height[node] = tall
            for level in range(tall):
                earlier = path[level]
                later = right[earlier, level]
                right[earlier, level], left[node, level] = node, earlier
                right[node, level] = later
                if later >= 0:
                    left[later, level] = node
    return diagonals[:count]


@kernel
def _cut_pieces(x, y, origin, onward, rank):
    """Cut monotone pieces, each a ring of half-edges, into triangles."""
    total = len(onward)
    triangles = np.zeros((total, 3), np.int64)
    count = 0
    done = np.zeros(total, np.bool_)
    ring = np.zeros(total, np.int64)
    merged = np.zeros(total, np.int64)
    side = np.zeros(total, np.int64)
    stack = np.zeros(total, np.int64)
    for first in range(total):
        if done[first]:
            continue
        size = 0
        edge = first
        while not done[edge]:
            done[edge] = True
            ring[size] = origin[edge]
            size += 1
            edge = onward[edge]
        if size < 3:
            continue
        low = 0
        for k in range(size):
            if rank[ring[k]] < rank[ring[low]]:
                low = k
        # Both ways from the leftmost corner, in the order of the sweep.
        forward, backward = 1, 1
        merged[0] = low
        for k in range(1, size):
            a, b = (low + forward) % size, (low - backward) % size
            if rank[ring[a]] <= rank[ring[b]]:
                merged[k], side[k] = a, 0
                forward += 1
            else:
                merged[k], side[k] = b, 1
                backward += 1
        for k in range(size):
            merged[k] = ring[merged[k]]
        stack[0], stack[1] = 0, 1
        top = 2
        for k in range(2, size):
            if k == size - 1 or side[k] != side[stack[top - 1]]:
                upward = side[stack[top - 1]] == 0
                for i in range(top - 1):
                    a, b = merged[stack[i]], merged[stack[i + 1]]
                    if not upward:
                        a, b = b, a
                    triangles[count] = a, b, merged[k]
                    count += 1
                stack[0], stack[1] = stack[top - 1], k
                top = 2
                continue
            while top > 1:
                a, b, c = merged[stack[top - 2]], merged[stack[top - 1]], merged[k]
                turn = _turn(x, y, a, b, c)
                if side[k] == 0 and turn > 0:
                    triangles[count] = a, b, c
                elif side[k] == 1 and turn < 0:
                    triangles[count] = c, b, a
                else:
                    break
                count += 1
                top -= 1
            stack[top] = k
            top += 1
    return triangles[:count]


TESTS = 500  # pairs of edges tested per edge


def is_tangled(points: NDArray[np.float64], following: NDArray[np.int64]) -> bool:
    """
    Return whether edges cross or touch more than half as often as there are corners (n, 2).

    Also true where too many pairs of edges are near each other to tell.
    """
    ends = np.stack([points, points[following]])
    low, high = ends.min(0), ends.max(0)
    # Along the axis on which edges overlap less.
    axis = int((high - low).sum(0).argmin())
    order = np.argsort(low[:, axis], kind="stable")
    return bool(_count(points, following, low, high, order, axis, len(points) // 2 + 20))


@kernel
def _count(points, following, low, high, order, axis, most):
    n = len(order)
    crossings = tests = 0
    for i in range(n):
        a = order[i]
        b = following[a]
        for j in range(i + 1, n):
            c = order[j]
            if low[c, axis] > high[a, axis]:
                break
            tests += 1
            if tests > TESTS * n:
                return True
            if low[c, 1 - axis] > high[a, 1 - axis] or high[c, 1 - axis] < low[a, 1 - axis]:
                continue
            d = following[c]
            if c in (a, b) or d in (a, b):
                continue
            across_ab = _side(points, a, b, c) * _side(points, a, b, d)
            across_cd = _side(points, c, d, a) * _side(points, c, d, b)
            if across_ab <= 0 and across_cd <= 0:
                crossings += 1
                if crossings > most:
                    return True
    return False


@kernel
def _side(points, a, b, c):
    turn = (points[b, 0] - points[a, 0]) * (points[c, 1] - points[a, 1]) - (
        points[b, 1] - points[a, 1]
    ) * (points[c, 0] - points[a, 0])
    return np.sign(turn)
