"""
Delaunay triangulation of points on a grid of whole numbers, that holds given edges.

scipy triangulates the points. Edges that it lacks are made by flips (Sloan 1993), and what they
left is flipped until it is Delaunay again. Coordinates below 2^24 make every turn exact.

Blades of ground: long, thin triangles that stand up between near corners of different heights.

A surface through feet alone runs from two corners that are near each other, one high and one low,
straight to the next building, however far that is.
"""

from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel

__all__ = ["find_blades", "find_mean_heights", "triangulate_with_edges"]

_ROUNDS = 30  # of restoring Delaunay's rule; a few suffice
_LEAST = 1e-9  # of an incircle's size: below it four points lie on one circle


def triangulate_with_edges(
    points: NDArray[np.int64], edges: NDArray[np.int64]
) -> tuple[NDArray[np.int32], NDArray[np.int32], int]:
    """
    Triangulate points so that edges between them are edges of triangles.

    An edge through a further point becomes several. An edge that crosses an earlier one is left
    out.

    Parameters
    ----------
    points : (n, 2) int64
        Distinct, 0 to 2^24; those of the hull are corners of it.
    edges : (m, 2) int64

    Returns
    -------
    triangles : (k, 3) int32
        Counter-clockwise.
    neighbours : (k, 3) int32
        Triangle opposite to each corner; -1 beyond the hull.
    crossing : int
        Number of edges left out.

    Raises
    ------
    ValueError
        If the points have no triangulation, as they lie on one line.
    """
    from scipy.spatial import Delaunay, QhullError  # noqa: PLC0415 - comes with pvlib; 0.2 s

    try:
        mesh = Delaunay(points.astype(np.float64))
    except QhullError as error:
        msg = "the points have no triangulation"
        raise ValueError(msg) from error
    triangles = mesh.simplices.astype(np.int32)
    neighbours = mesh.neighbors.astype(np.int32)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    turns = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    if (turns == 0).any() or len(np.unique(triangles)) < len(points):
        msg = "the points have no triangulation"
        raise ValueError(msg)
    wrong = turns < 0
    triangles[wrong] = triangles[wrong][:, [0, 2, 1]]
    neighbours[wrong] = neighbours[wrong][:, [0, 2, 1]]
    fixed = np.zeros(triangles.shape, np.bool_)
    at = np.zeros(len(points), np.int32)
    at[triangles.ravel()] = np.repeat(np.arange(len(triangles), dtype=np.int32), 3)
    missed = _insert(points, triangles, neighbours, fixed, at, edges.astype(np.int64))
    for _ in range(_ROUNDS):
        if not _restore(points, triangles, neighbours, fixed, at):
            break
    return triangles, neighbours, int(missed)


@partial(kernel, inline="always")
def _turn(points, a, b, c):
    """Return the sign of the turn from a over b to c, exactly: positive to the left."""
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    return np.sign(ux * vy - uy * vx)


@partial(kernel, inline="always")
def _find(row, value):
    return 0 if row[0] == value else 1 if row[1] == value else 2


@kernel
def _flip(triangles, neighbours, fixed, at, t, k):
    """Turn the edge opposite to corner k of a triangle to the other diagonal of its two."""
    o = neighbours[t, k]
    p, b, c = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
    m = _find(neighbours[o], t)
    q = triangles[o, m]  # o is q, c, b
    beyond_b, fixed_b = neighbours[t, (k + 1) % 3], fixed[t, (k + 1) % 3]  # over p, c
    beyond_c, fixed_c = neighbours[t, (k + 2) % 3], fixed[t, (k + 2) % 3]  # over p, b
    over_c, fixed_oc = neighbours[o, (m + 1) % 3], fixed[o, (m + 1) % 3]  # over q, b
    over_b, fixed_ob = neighbours[o, (m + 2) % 3], fixed[o, (m + 2) % 3]  # over q, c
    triangles[t, 0], triangles[t, 1], triangles[t, 2] = p, b, q
    neighbours[t, 0], neighbours[t, 1], neighbours[t, 2] = over_c, o, beyond_c
    fixed[t, 0], fixed[t, 1], fixed[t, 2] = fixed_oc, False, fixed_c
    triangles[o, 0], triangles[o, 1], triangles[o, 2] = p, q, c
    neighbours[o, 0], neighbours[o, 1], neighbours[o, 2] = over_b, beyond_b, t
    fixed[o, 0], fixed[o, 1], fixed[o, 2] = fixed_ob, fixed_b, False
    if over_c >= 0:
        neighbours[over_c, _find(neighbours[over_c], o)] = t
    if beyond_b >= 0:
        neighbours[beyond_b, _find(neighbours[beyond_b], t)] = o
    at[p], at[b], at[q], at[c] = t, t, t, o


@kernel
def _insert(points, triangles, neighbours, fixed, at, edges):
    """Insert the edges, each as far as it crosses no other; return how many do."""
    missed = 0
    for e in range(edges.shape[0]):
        u, v = edges[e, 0], edges[e, 1]
        while u != v:
            u = _advance(points, triangles, neighbours, fixed, at, u, v)
            if u < 0:
                missed += 1
                break
    return missed


@kernel
def _advance(points, triangles, neighbours, fixed, at, u, v):
    """Make the edge from u toward v up to the first point on it; return the point, -1 if none."""
    t, k = _look(points, triangles, neighbours, at, u, v)
    if t < 0:
        return -1
    a, b = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
    if _turn(points, u, v, a) == 0:
        _fix(neighbours, fixed, t, (k + 2) % 3)
        return a
    # The point at which the way ends: v, or one that lies on it.
    end = v
    count, o, m = 0, t, k
    crossed = np.zeros((64, 2), np.int64)
    while True:
        if fixed[o, m]:
            return -1
        if count == len(crossed):
            wider = np.zeros((2 * count, 2), np.int64)
            wider[:count] = crossed
            crossed = wider
        crossed[count, 0], crossed[count, 1] = a, b
        count += 1
        beyond = neighbours[o, m]
        m = _find(neighbours[beyond], o)
        o, apex = beyond, triangles[beyond, m]
        side = _turn(points, u, v, apex)
        if side == 0:
            end = apex
            break
        # Leave through the edge on the other side of the way.
        if side < 0:
            a = apex
            m = _find(triangles[o], crossed[count - 1, 0])
        else:
            b = apex
            m = _find(triangles[o], crossed[count - 1, 1])
    head, waiting, tries = 0, count, 0  # the edges wait in a ring of ``count`` places
    while waiting > 0:
        tries += 1
        if tries > 64 * (count + 4) * (count + 4):
            return -1
        a, b = crossed[head, 0], crossed[head, 1]
        head, waiting = (head + 1) % count, waiting - 1
        t, k = _find_edge(triangles, neighbours, at, a, b)
        o = neighbours[t, k]
        p, q = triangles[t, k], triangles[o, _find(neighbours[o], t)]
        c, d = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
        if _turn(points, p, c, q) > 0 and _turn(points, p, q, d) > 0:
            _flip(triangles, neighbours, fixed, at, t, k)
            if _turn(points, u, end, p) * _turn(points, u, end, q) >= 0:
                continue
            a, b = p, q
        slot = (head + waiting) % count
        crossed[slot, 0], crossed[slot, 1] = a, b
        waiting += 1
    t, k = _find_edge(triangles, neighbours, at, u, end)
    _fix(neighbours, fixed, t, k)
    return end


@kernel
def _fix(neighbours, fixed, t, k):
    """Hold the edge opposite to corner k of a triangle."""
    fixed[t, k] = True
    o = neighbours[t, k]
    if o >= 0:
        fixed[o, _find(neighbours[o], t)] = True


@kernel
def _look(points, triangles, neighbours, at, u, v):
    """Find the triangle at a point u whose angle there holds the way to v; -1 if none does."""
    start = at[u]
    for way in (1, 2):
        t = start
        while t >= 0:
            k = _find(triangles[t], u)
            a, b = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            if _turn(points, u, a, v) >= 0 and _turn(points, u, v, b) > 0:
                return t, k
            t = neighbours[t, (k + way) % 3]
            if t == start:
                return -1, 0
    return -1, 0


@kernel
def _find_edge(triangles, neighbours, at, a, b):
    """Find a triangle with an edge, and the corner opposite to it; -1 if there is none."""
    start = at[a]
    for way in (1, 2):
        t = start
        while t >= 0:
            k = _find(triangles[t], a)
            if triangles[t, (k + 1) % 3] == b:
                return t, (k + 2) % 3
            if triangles[t, (k + 2) % 3] == b:
                return t, (k + 1) % 3
            t = neighbours[t, (k + way) % 3]
            if t == start:
                return -1, 0
    return -1, 0


@kernel
def _restore(points, triangles, neighbours, fixed, at):
    """Flip each edge that is not held, and whose circle holds the fourth point; count them."""
    flips = 0
    for t in range(triangles.shape[0]):
        for k in range(3):
            o = neighbours[t, k]
            if o < 0 or fixed[t, k]:
                continue
            p, q = triangles[t, k], triangles[o, _find(neighbours[o], t)]
            c, d = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            if _turn(points, p, c, q) <= 0 or _turn(points, p, q, d) <= 0:
                continue
            if _holds(points, p, c, d, q):
                _flip(triangles, neighbours, fixed, at, t, k)
                flips += 1
    return flips


@kernel
def _holds(points, a, b, c, d):
    """Return whether the circle of three corners, counter-clockwise, holds a fourth."""
    ax, ay = float(points[a, 0] - points[d, 0]), float(points[a, 1] - points[d, 1])
    bx, by = float(points[b, 0] - points[d, 0]), float(points[b, 1] - points[d, 1])
    cx, cy = float(points[c, 0] - points[d, 0]), float(points[c, 1] - points[d, 1])
    aa, bb, cc = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
    minor_a, minor_b, minor_c = bx * cy - by * cx, ax * cy - ay * cx, ax * by - ay * bx
    size = aa * abs(minor_a) + bb * abs(minor_b) + cc * abs(minor_c)
    return aa * minor_a - bb * minor_b + cc * minor_c > _LEAST * size


_JUMP = 1.0  # height of a corner over the opposite edge, and the same in widths
_LONG = 10.0  # [m]
_CLEAR = 2.5  # distance of a new corner to a foot [m]
_APART = 1.0  # distance of new corners [m]
_MEAN = 256  # corners of feet of which the height between them is the mean


class Triangulated(Protocol):
    """Triangulated bases, as ``_Bases`` of `umbra.ground.surface`."""

    @property
    def plan(self) -> NDArray[np.float64]:
        """Corners (n, 3), those of feet first."""

    @property
    def triangles(self) -> NDArray[np.int32]:
        """Corners of each triangle, (t, 3)."""

    @property
    def neighbours(self) -> NDArray[np.int32]:
        """Triangle opposite to each corner, (t, 3); -1 beyond the hull."""

    @property
    def label(self) -> NDArray[np.int32]:
        """Base face that holds each triangle, (t,); -1 between the buildings."""

    @property
    def own(self) -> int:
        """Number of corners of feet."""


def find_mean_heights(
    tree: Any, plan: NDArray[np.float64], places: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the mean height (n,) of the feet near places (n, 2), by the square of distance."""
    away, near = tree.query(places, range(1, min(_MEAN, tree.n) + 1))
    weight = 1.0 / np.maximum(away, 1e-6) ** 2
    return np.asarray((weight * plan[near, 2]).sum(1) / weight.sum(1), np.float64)


def find_blades(
    base: Triangulated, heights: NDArray[np.float64], known: NDArray[np.float64]
) -> NDArray[np.float64]:
    """
    Find places at which the blades of a surface are cut, with the mean height of the feet nearby.

    A blade is a triangle between buildings, more than 10 m long, of which one corner lies more
    than 1 m above or below the opposite edge and nearer to it than that. It is cut in the middle of
    its longest edge, or at both quarters where a foot is near.

    Parameters
    ----------
    base : Triangulated
    heights : (t, 3) float64
        Of each triangle's corners [m].
    known : (k, 3) float64
        Corners that were added before.

    Returns
    -------
    corners : (n, 3) float64
        [m]
    """
    from scipy.spatial import cKDTree  # noqa: PLC0415 - comes with pvlib; 0.2 s

    plan, triangles = base.plan, base.triangles
    places = plan[triangles, :2]
    sides = np.roll(places, -2, 1) - np.roll(places, -1, 1)  # opposite to each corner
    length = np.linalg.norm(sides, axis=2)
    k, row = length.argmax(1), np.arange(len(triangles))
    i, j = (k + 1) % 3, (k + 2) % 3
    start, along, whole = places[row, i], sides[row, k], np.maximum(length[row, k], 1e-9)
    aside = places[row, k] - start
    share = np.einsum("ij,ij->i", aside, along) / whole**2
    width = np.abs(aside[:, 0] * along[:, 1] - aside[:, 1] * along[:, 0]) / whole
    low, high, top = heights[row, i], heights[row, j], heights[row, k]
    jump = np.abs(top - (low + share * (high - low)))
    beyond = base.neighbours[row, k]
    is_open = (base.label < 0) & (beyond >= 0) & (base.label[beyond] < 0)
    blades = np.flatnonzero(is_open & (whole > _LONG) & (jump > _JUMP) & (jump > width))
    tree = cKDTree(plan[: base.own, :2])
    middle = start[blades] + 0.5 * along[blades]
    is_near = tree.query(middle)[0] < _CLEAR
    crowded = blades[is_near]
    quarters = [start[crowded] + share * along[crowded] for share in (0.25, 0.75)]
    candidates = np.concatenate([middle[~is_near], *quarters])
    candidates = candidates[tree.query(candidates)[0] >= _CLEAR]
    if len(known):
        candidates = candidates[cKDTree(known[:, :2]).query(candidates)[0] >= _APART]
    _, first = np.unique(np.rint(candidates / _APART), axis=0, return_index=True)
    candidates = candidates[first]
    return np.column_stack([candidates, find_mean_heights(tree, plan, candidates)])
