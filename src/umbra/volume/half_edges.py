"""Directed edges of faces, sorted: which faces they join into components, and their pairs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel

__all__ = ["HalfEdges", "find_roots", "renumber", "sort"]


@kernel
def sort(numbers, order):
    """Sort an order of things by their numbers, (n,) int32 both; of equal ones the first stays."""
    ordered = np.zeros(order.size, np.int32)
    if not order.size:
        return ordered
    least = most = numbers[0]
    for number in numbers:
        least, most = min(least, number), max(most, number)
    starts = np.zeros(most - least + 2, np.int32)
    for number in numbers:
        starts[number - least + 1] += 1
    for k in range(1, starts.size):
        starts[k] += starts[k - 1]
    for i in order:
        ordered[starts[numbers[i] - least]] = i
        starts[numbers[i] - least] += 1
    return ordered


@kernel
def find_roots(first, second, n):
    """
    Find for each of n things the lowest that is connected to it (union-find, path halving).

    ``first`` and ``second`` (n_pairs,) int32 are connected pairs. Returns (n,) int32.
    """
    root = np.zeros(n, np.int32)
    for i in range(n):
        root[i] = i
    for i in range(first.size):
        a, b = first[i], second[i]
        while root[a] != a:
            root[a] = root[root[a]]
            a = root[a]
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        root[max(a, b)] = min(a, b)
    for i in range(n):
        root[i] = root[root[i]]  # a root is lower than its things, so it is final
    return root


def renumber(labels: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return labels numbered from 0 without gaps, in their order."""
    occurs = np.zeros(int(labels.max(initial=-1)) + 1, np.bool_)
    occurs[labels] = True
    return (np.cumsum(occurs, dtype=np.int32) - np.int32(1))[labels]


@dataclass(frozen=True, eq=False)
class HalfEdges:
    """Directed edges of all faces, sorted so that half-edges of one edge are adjacent."""

    key: NDArray[np.uint64]  # lower vertex << 32 | higher vertex, ascending
    face: NDArray[np.int32]
    sign: NDArray[np.int8]  # +1 where the face runs from lower to higher
    start: NDArray[np.bool_]  # first half-edge of its run

    @classmethod
    def of(cls, faces: NDArray[np.int32]) -> "HalfEdges":
        """Split faces (n, 3) of welded vertices."""
        return cls(*_split(faces))

    def within(self, chosen: NDArray[np.bool_], group: NDArray[np.int32]) -> "HalfEdges":
        """Keep the chosen faces, and split the runs by group."""
        indices = np.flatnonzero(chosen[self.face])
        key, face, sign = self.key[indices], self.face[indices], self.sign[indices]
        order = np.lexsort((group[face], key))
        key, face, sign = key[order], face[order], sign[order]
        return HalfEdges(key, face, sign, _run_starts(key) | _run_starts(group[face]))

    def join(self, n_faces: int) -> NDArray[np.int32]:
        """Return each face's component, connected by edges, (n_faces,) int32."""
        again = np.flatnonzero(~self.start)
        return renumber(find_roots(self.face.take(again - 1), self.face.take(again), n_faces))

    def find_closed(self, component: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Find the components whose every edge has signed incidences that sum to 0."""
        is_closed = np.ones(int(component.max(initial=-1)) + 1, np.bool_)
        if len(self.face):
            starts = np.flatnonzero(self.start)
            sums = np.add.reduceat(self.sign, starts, dtype=np.int32)
            is_closed[component[self.face[starts[sums != 0]]]] = False
        return is_closed

    def pair(
        self, closed: NDArray[np.bool_]
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.bool_], NDArray[np.int8]]:
        """
        Pair the half-edges of every edge, closed faces with closed and open with open.

        ``closed`` (n_faces,) are faces of closed components. Returns a caster's edges,
        edge_faces, turn and weight.
        """
        key, face, sign, closed = self.key, self.face, self.sign, closed.take(self.face)
        runs = np.diff(np.append(np.flatnonzero(self.start), len(key)))
        if (runs > 2).any() or closed.any() != closed.all():
            # In a run sorted by sign the first half is opposite to the second.
            order = np.lexsort((-sign, closed, key))
            key, face, sign, closed = key[order], face[order], sign[order], closed[order]
        starts = np.flatnonzero(_run_starts(key) | _run_starts(closed))
        return _pair(np.append(starts, len(key)), key, face, sign, closed)


def _run_starts(values: NDArray) -> NDArray[np.bool_]:
    starts = np.ones(len(values), np.bool_)
    starts[1:] = values[1:] != values[:-1]
    return starts


@kernel
def _split(faces):
    """Return the fields of the faces' half-edges."""
    low, high = np.zeros(faces.size, np.int32), np.zeros(faces.size, np.int32)
    for f in range(faces.shape[0]):
        for k in range(3):
            tail, head = faces[f, k], faces[f, (k + 1) % 3]
            low[3 * f + k], high[3 * f + k] = min(tail, head), max(tail, head)
    order = np.zeros(faces.size, np.int32)
    for i in range(faces.size):
        order[i] = i
    order = sort(low, sort(high, order))
    key, face = np.zeros(order.size, np.uint64), np.zeros(order.size, np.int32)
    sign, start = np.zeros(order.size, np.int8), np.zeros(order.size, np.bool_)
    for i in range(order.size):
        j = order[i]
        key[i] = np.uint64(low[j]) << np.uint64(32) | np.uint64(high[j])
        face[i] = j // 3
        sign[i] = 1 if faces[j // 3, j % 3] == low[j] else -1
        start[i] = i == 0 or key[i] != key[i - 1]
    return key, face, sign, start


@kernel
def _pair(ends, key, face, sign, closed):
    """Pair the first half of every run with the second; a leftover last one with itself."""
    first, second = np.zeros(key.size, np.int32), np.zeros(key.size, np.int32)
    n = 0
    for r in range(ends.size - 1):
        half = (ends[r + 1] - ends[r]) // 2
        for a in range(ends[r], ends[r] + half):
            first[n], second[n] = a, a + half
            n += 1
    for r in range(ends.size - 1):
        if (ends[r + 1] - ends[r]) % 2:
            first[n] = second[n] = ends[r + 1] - 1
            n += 1
    lower, order = np.zeros(n, np.int32), np.zeros(n, np.int32)
    for i in range(n):
        lower[i], order[i] = min(face[first[i]], face[second[i]]), i
    order = sort(lower, order)
    edges, edge_faces = np.zeros((n, 2), np.int32), np.zeros((n, 2), np.int32)
    turn, weight = np.zeros(n, np.bool_), np.zeros(n, np.int8)
    for i in range(n):
        a, b = first[order[i]], second[order[i]]
        edges[i, 0], edges[i, 1] = key[a] >> np.uint64(32), key[a] & np.uint64(0xFFFFFFFF)
        edge_faces[i, 0], edge_faces[i, 1] = face[a], face[b]
        turn[i] = sign[a] == sign[b]  # true of a border, which is its own partner
        weight[i] = sign[a] if closed[a] or a == b else 2 * sign[a]
    return edges, edge_faces, turn, weight
