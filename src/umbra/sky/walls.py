"""
Vertical walls as strips: what lies between an edge and the level below it, all of it wall.

A wall is faces of one vertical plane that are joined by edges. Along the wall, between two of its
corners, the same edge is on top everywhere; a strip is the part below it down to the highest point
of what bounds the wall next below. Strips hide what is behind them as a whole, however the wall is
cut into triangles, and tell without an edge how high the skyline is at least.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import copy_rows, inner, kernel
from umbra.volume.adjacency import sort_along_curve

__all__ = ["find_strips"]

_VERTICAL = 1e-9  # vertical component of a normal
_COPLANAR = 1e-12  # sine of the angle between joined faces
_SAME = 1e-9  # along a wall [m]


def find_strips(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    edges: NDArray[np.int32],
    planes: NDArray[np.float64],
    n_edges: int,
) -> NDArray[np.float64]:
    """
    Find the strips of all vertical walls, parameters as in ``SkyCasters``.

    Returns
    -------
    strips : (n, 8) float64
        Both ends of the upper edge (x, y, z each), the level down to which there is wall, and the
        distance within which a point lies in its plane [m].
    """
    walls = np.flatnonzero(np.abs(planes[:, 2]) <= _VERTICAL).astype(np.int32)
    label = _join_walls(walls, edges, planes, n_edges, len(faces))
    order = walls[np.argsort(label[walls], kind="stable")]
    starts = np.flatnonzero(np.diff(label[order], prepend=-1, append=-1))
    strips = _decompose(vertices, faces, planes, order, starts)
    # Near strips stay together, for boxes around some of them.
    along = sort_along_curve((strips[:, :3] + strips[:, 3:6]) / 2)
    return np.ascontiguousarray(strips[along])


@kernel
def _join_walls(walls, edges, planes, n_edges, n_faces):
    """Give the walls' faces that an edge joins in one plane a common label, (n_faces,)."""
    label = np.arange(n_faces)
    last = np.full(n_edges, -1, np.int64)
    for f in walls:
        for k in range(3):
            number = edges[f, k] >> 1
            g = last[number]
            last[number] = f
            if g < 0:
                continue
            turn = planes[f, 0] * planes[g, 1] - planes[f, 1] * planes[g, 0]
            if abs(turn) > _COPLANAR:
                continue
            first, second = f, g
            while label[first] != first:
                label[first] = label[label[first]]
                first = label[first]
            while label[second] != second:
                label[second] = label[label[second]]
                second = label[second]
            label[max(first, second)] = min(first, second)
    for f in walls:
        first = f
        while label[first] != first:
            first = label[first]
        label[f] = first
    return label


@kernel
def _decompose(vertices, faces, planes, order, starts):
    """Cut each wall into strips."""
    room = 64
    strips = np.empty((room, 8))
    n = 0
    for wall in range(starts.size - 1):
        members = order[starts[wall] : starts[wall + 1]]
        f = members[0]
        ux, uy = -planes[f, 1], planes[f, 0]
        length = np.sqrt(ux * ux + uy * uy)
        ux, uy = ux / length, uy / length
        position = np.empty((members.size, 3))
        touch = 0.0
        for i in range(members.size):
            touch = max(touch, planes[members[i], 3])
            for k in range(3):
                v = vertices[faces[members[i], k]]
                position[i, k] = ux * v[0] + uy * v[1]
        corners = position.ravel()
        marks, last = np.empty(corners.size), -np.inf
        n_marks = 0
        for i in np.argsort(corners):
            marks[n_marks] = corners[i]
            n_marks += corners[i] - last > _SAME
            last = corners[i]
        low, high = np.empty(members.size), np.empty(members.size)
        for s in range(n_marks - 1):
            middle = (marks[s] + marks[s + 1]) / 2
            _, bottom, edge_a, edge_b = _find_top(
                vertices, faces, members, position, middle, low, high
            )
            if edge_a < 0:
                continue
            if n == room:
                more = np.empty((2 * room, 8))
                copy_rows(strips, more)
                strips, room = more, 2 * room
            a, b = vertices[edge_a], vertices[edge_b]
            pa = ux * a[0] + uy * a[1]
            pb = ux * b[0] + uy * b[1]
            for e in range(2):
                share = (marks[s + e] - pa) / (pb - pa)
                # At a corner the strip ends in the corner itself, so that walls meet without a gap.
                share = 0.0 if abs(share) * abs(pb - pa) <= _SAME else share
                share = 1.0 if abs(share - 1.0) * abs(pb - pa) <= _SAME else share
                for j in range(3):
                    strips[n, 3 * e + j] = a[j] if share == 0.0 else a[j] + share * (b[j] - a[j])
                    if share == 1.0:
                        strips[n, 3 * e + j] = b[j]
            level = -np.inf
            for e in range(2):
                beside = marks[s] + (1e-7 if e == 0 else 1.0 - 1e-7) * (marks[s + 1] - marks[s])
                _, under, _, _ = _find_top(vertices, faces, members, position, beside, low, high)
                level = max(level, under)
            strips[n, 6], strips[n, 7] = max(level, bottom), touch
            n += 1
    return strips[:n]


@inner
def _find_top(vertices, faces, members, position, at, low, high):
    """
    Find the upper edge of a wall at a place along it, and how far down there is wall.

    Returns both heights [m] and the two vertices of the edge.
    """
    top = -np.inf
    edge_a, edge_b = -1, -1
    for i in range(members.size):
        low[i], high[i] = np.inf, -np.inf
        for k in range(3):
            after = k + 1 if k < 2 else 0
            p, q = position[i, k], position[i, after]
            if (p > at) == (q > at):
                continue
            a, b = faces[members[i], k], faces[members[i], after]
            if p > q:
                p, q, a, b = q, p, b, a
            z = vertices[a, 2] + (at - p) / (q - p) * (vertices[b, 2] - vertices[a, 2])
            low[i], high[i] = min(low[i], z), max(high[i], z)
            if z > top:
                top, edge_a, edge_b = z, a, b
    bottom = top
    again = True
    while again:
        again = False
        for i in range(members.size):
            if low[i] < bottom <= high[i] + _SAME:
                bottom = low[i]
                again = True
    return top, bottom, edge_a, edge_b
