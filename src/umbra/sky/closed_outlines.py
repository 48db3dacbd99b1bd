"""Closed outlines of the free sky, from its pieces between meridians."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.sky.gather import HORIZON, PLANE
from umbra.sky.meridians import ZENITH
from umbra.sky.sweep import Pieces

__all__ = ["Outline", "trace_outlines"]

_SAME = 1e-10  # altitudes on a meridian that are one place [radians]
_UPRIGHT = -5  # an edge along a meridian
_LONGEST = 2.0  # of an edge, so that its two ends tell its great circle [radians]
_BESIDE = (1e-6, 1e-8)  # from an edge to what obstructs behind it [radians]

Node = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Outline:
    """
    A closed loop around free sky, or around what obstructs within it.

    Parameters
    ----------
    directions : (n, 3) float64
        Unit vectors; the edge from each to the next, and from the last to the first, is the shorter
        arc of a great circle. The free sky is to the left, seen from outside the sphere.
    part : tuple of (str or None), n
        What obstructs behind each edge; None for the horizon and the receiver's own plane.
    """

    directions: NDArray[np.float64]
    part: tuple[str | None, ...]


@dataclass(frozen=True)
class _Edge:
    start: Node
    end: Node
    code: int


def trace_outlines(
    pieces: Pieces, name: Callable[[NDArray[np.float64]], list[str | None]]
) -> tuple[Outline, ...]:
    """
    Join the edges of pieces to closed outlines; meridians between free pieces drop out.

    ``name`` returns what obstructs in each of some directions (n, 3), None where nothing does.
    """
    edges, position = _find_edges(pieces)
    loops = [_merge(loop, position) for loop in _trace(edges, position)]
    loops = [loop for loop in loops if len(loop) > 2]
    outlines = []
    for loop in loops:
        points = np.array([position[edge.start] for edge in loop])
        after = np.roll(points, -1, 0)
        normal = np.cross(points, after)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        middle = points + after
        middle /= np.linalg.norm(middle, axis=1)[:, None]
        parts: list[str | None] = [None] * len(loop)
        for beside in _BESIDE:
            hit = name(middle - beside * normal)
            parts = [
                None if edge.code in {HORIZON, PLANE} else known or other
                for edge, known, other in zip(loop, parts, hit, strict=True)
            ]
        outlines.append(Outline(points, tuple(parts)))
    return tuple(outlines)


def _find_edges(pieces: Pieces) -> tuple[list[_Edge], dict[Node, NDArray[np.float64]]]:
    """List the edges between nodes: an event and the number of an altitude on its meridian."""
    turn = len(pieces.events) - 1
    ends: dict[
        int, list[tuple[int, int, float, float]]
    ] = {}  # by event: altitudes of the pieces before and after it
    for which, (s, b, a) in enumerate(zip(pieces.slice, pieces.below, pieces.above, strict=True)):
        for k in range(2):
            bottom = math.atan2(b[2 * k + 1], b[2 * k])
            top = max(math.atan2(a[2 * k + 1], a[2 * k]), bottom)
            ends.setdefault((int(s) + k) % turn, []).append((which, k, bottom, top))
    node: dict[tuple[int, int, int], Node] = {}  # piece, meridian, below or above
    position: dict[Node, NDArray[np.float64]] = {}
    edges: list[_Edge] = []
    for event, rows in ends.items():
        angles = np.array([angle for row in rows for angle in row[2:]])
        order = np.argsort(angles)
        number = np.zeros(len(angles), int)
        number[order] = np.cumsum(np.diff(angles[order], prepend=-9.0) > _SAME) - 1
        rise = np.zeros(int(number.max()) + 2, int)
        for q, (which, k, _, _) in enumerate(rows):
            low, high = int(number[2 * q]), int(number[2 * q + 1])
            node[which, k, 0], node[which, k, 1] = (event, low), (event, high)
            rise[low:high] += 1 if k else -1
        x, y = pieces.events[event]
        for q in range(int(number.max()) + 1):
            angle = float(angles[number == q].mean())
            at = (event, q)
            if angle > math.pi / 2 - _SAME:
                at = (-1, 0)
                angle = math.pi / 2
            level = math.cos(angle)
            position[event, q] = np.array([level * x, level * y, math.sin(angle)])
            if at[0] < 0:
                position[at] = position[event, q] = np.array([0.0, 0.0, 1.0])
                node.update({key: at for key, value in node.items() if value == (event, q)})
        zenith = {
            (event, q): (-1, 0)
            for q in range(int(number.max()) + 1)
            if position[event, q][2] == 1.0
        }
        for q, up in enumerate(rise[:-1]):
            pair = [zenith.get((event, e), (event, e)) for e in (q, q + 1)]
            if up > 0:
                edges.append(_Edge(pair[0], pair[1], _UPRIGHT))
            elif up < 0:
                edges.append(_Edge(pair[1], pair[0], _UPRIGHT))
    for which in range(len(pieces.slice)):
        edges.append(_Edge(node[which, 0, 0], node[which, 1, 0], int(pieces.under[which])))
        if pieces.over[which] != ZENITH:
            edges.append(_Edge(node[which, 1, 1], node[which, 0, 1], int(pieces.over[which])))
    return [edge for edge in edges if edge.start != edge.end], position


def _trace(edges: list[_Edge], position: dict[Node, NDArray[np.float64]]) -> list[list[_Edge]]:
    """Join edges to loops; where several leave a node the leftmost follows."""
    leaving: dict[Node, list[_Edge]] = {}
    for edge in edges:
        leaving.setdefault(edge.start, []).append(edge)
    loops = []
    for edge in edges:
        if edge not in leaving[edge.start]:
            continue
        loop = [edge]
        leaving[edge.start].remove(edge)
        while loop[-1].end != loop[0].start:
            choices = leaving.get(loop[-1].end)
            if not choices:  # rounding: a node without a way on; the gap is of its size
                break
            best = max(choices, key=lambda choice: _find_turn(loop[-1], choice, position))
            choices.remove(best)
            loop.append(best)
        loops.append(loop)
    return loops


def _find_turn(edge: _Edge, after: _Edge, position: dict[Node, NDArray[np.float64]]) -> float:
    """Return the angle by which one edge turns left into another [radians]."""
    p, q, r = position[edge.start], position[edge.end], position[after.end]
    on, way = q * (p @ q) - p, r - q * (r @ q)
    return math.atan2(float(np.cross(on, way) @ q), float(on @ way))


def _merge(loop: list[_Edge], position: dict[Node, NDArray[np.float64]]) -> list[_Edge]:
    """Join neighbours of one great circle."""
    merged: list[_Edge] = []
    for edge in loop:
        if merged and _is_one(merged[-1], edge, position):
            merged[-1] = _Edge(merged[-1].start, edge.end, edge.code)
        else:
            merged.append(edge)
    while len(merged) > 3 and _is_one(merged[-1], merged[0], position):
        last = merged.pop()
        merged[0] = _Edge(last.start, merged[0].end, last.code)
    return merged


def _is_one(first: _Edge, second: _Edge, position: dict[Node, NDArray[np.float64]]) -> bool:
    if first.code != second.code or (first.code == _UPRIGHT and first.start[0] != second.end[0]):
        return False
    return float(position[first.start] @ position[second.end]) > math.cos(_LONGEST)
