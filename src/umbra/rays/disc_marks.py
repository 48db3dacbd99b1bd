"""
Which discs an edge may cut: of all others the middle tells whether they are free or hidden.

Seen from a point, a disc is cut by an edge that bounds what covers it, by the point's own surface,
or by a face that touches the point. Edges are entered in bins before the disc, each as wide as the
penumbra that it casts on the lowest point of the bin; each point asks the edges of its own bin.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, cross, dot, inlined, kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.disc_sides import make_frame
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.hidden import get
from umbra.rays.lanes import LANES

__all__ = ["FaceEdges", "find_touching", "make_face_edges", "mark_cut_discs"]

_WIDER = 1.001  # of the disc's radius
_GRAZING = 1.5  # radii by which a disc is clear of a plane
_NEAR = 1e-6  # of a point and an edge, or a face's plane [m]
_BESIDE = 1e-3  # of a point and a face on whose plane it is [m]
_COARSE = 2.0**-36  # of coordinates
_PARALLEL = 1e-9  # of normals
_LEVEL = 1e-9  # height of an edge that one row holds [m]
_BLOCK = 64
_FEWEST, _MOST = 16, 2**19  # bins


class FaceEdges(NamedTuple):
    """
    Edges of the faces of a tree.

    Parameters
    ----------
    ends : (n, 6) float64
        First and last vertex [m].
    starts : (n + 1,) int64
        First of each edge's faces.
    codes : (k,) int64
        The faces: twice their index, and 1 more where they run along the edge from its last vertex.
    """

    ends: NDArray[np.float64]
    starts: NDArray[np.int64]
    codes: NDArray[np.int64]


def make_face_edges(tree: FaceTree) -> FaceEdges:
    """Return the edges of a tree's faces, each once."""
    n = len(tree.ids)
    first, last = tree.ids.ravel().astype(np.int64), np.roll(tree.ids, -1, 1).ravel()
    keys = np.minimum(first, last) << 32 | np.maximum(first, last)
    order = np.argsort(keys, kind="stable")
    _, starts, number = np.unique(keys[order], return_index=True, return_counts=True)
    leading = order[starts]
    corners = tree.corners.reshape(n, 3, 3)
    ends = np.stack([corners, np.roll(corners, -1, 1)], 2).reshape(-1, 6)[leading]
    is_back = first[order] != np.repeat(first[leading], number)
    return FaceEdges(ends, np.append(starts, len(order)), 2 * (order // 3) + is_back)


def find_touching(
    tree: FaceTree, points: NDArray[np.float64], normals: NDArray[np.float64], threads: int = 1
) -> NDArray[np.bool_]:
    """
    Return which points (n, 3) touch a face that is not of their own surface's plane.

    Rounding tells on which side of it they are. ``normals`` (n, 3) are as of ``find_free_disc``.
    """
    found = np.zeros(len(points), np.bool_)
    use_threads(threads)
    run_shared(-(-len(points) // _BLOCK), _touch, tree, points, normals, found)
    return found


def mark_cut_discs(
    tree: FaceTree,
    edges: FaceEdges,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    touching: NDArray[np.bool_],
    toward: NDArray[np.float64],
    radius: float,
    threads: int = 1,
) -> NDArray[np.bool_]:
    """
    Return which discs an edge or the point's own surface may cut, (m, n) bool.

    All others are wholly free, or wholly hidden, as their middle. Neither land nor horizon counts.

    Parameters
    ----------
    edges : FaceEdges
        Of the tree.
    touching : (n,) bool
        As of ``find_touching``.
    tree, points, normals, toward, radius, threads
        As of ``find_free_disc``.
    """
    marks = np.zeros((len(toward), len(points)), np.bool_)
    if not len(points):
        return marks
    use_threads(threads)
    most = max(float(np.abs(at).max(initial=0.0)) for at in (points, tree.corners))
    near, slope = _NEAR + _COARSE * most, math.tan(math.radians(radius))
    run_shared(
        len(toward), _mark, tree, edges, (points, normals, touching), toward, (slope, near), marks
    )
    return marks


@kernel
def _touch(tree, points, normals, found, taken):
    n = points.shape[0]
    stack = np.zeros(DEEPEST, np.int32)
    while True:
        block = take_next(taken)
        if block >= (n + _BLOCK - 1) // _BLOCK:
            return
        _touch_block(
            tree, points, normals, found, stack, block * _BLOCK, min(n, (block + 1) * _BLOCK)
        )


@borrowing
def _touch_block(tree, points, normals, found, stack, first, end):
    """Find which points of a block touch a face whose box meets the block's."""
    low, high = get(points, first), get(points, first)
    for i in range(first, end):
        p = get(points, i)
        low = (min(low[0], p[0]), min(low[1], p[1]), min(low[2], p[2]))
        high = (max(high[0], p[0]), max(high[1], p[1]), max(high[2], p[2]))
    boxes = tree.boxes
    stack[0] = 0
    size = 1 if boxes.shape[0] else 0
    while size > 0:
        size -= 1
        node = np.int64(stack[size])
        for q in range(LANES):
            if (
                boxes[node, 0, q] > high[0] + _NEAR or boxes[node, 3, q] < low[0] - _NEAR
                or boxes[node, 1, q] > high[1] + _NEAR or boxes[node, 4, q] < low[1] - _NEAR
                or boxes[node, 2, q] > high[2] + _NEAR or boxes[node, 5, q] < low[2] - _NEAR
            ):  # fmt: skip
                continue
            child = np.int64(tree.links[node, q])
            if child >= 0:
                stack[size] = child
                size += 1
                continue
            f = ~child
            for i in range(first, end):
                found[i] = found[i] or _is_touched(tree, f, get(points, i), get(normals, i))


@inlined
def _is_touched(tree, f, p, n):
    """Return whether a point touches a face but not its plane, or that of another surface."""
    m, a = get(tree.normals, f), get(tree.corners, f)
    height = m[0] * (p[0] - a[0]) + m[1] * (p[1] - a[1]) + m[2] * (p[2] - a[2])
    if abs(height) > _NEAR:
        return False
    along = abs(dot(m, n))  # of n, whatever its length
    if abs(height) <= tree.normals[f, 3] and along > (1.0 - _PARALLEL) * math.sqrt(dot(n, n)):
        return False
    for k in range(3):
        j = 3 * k + 3 if k < 2 else 0
        x, y, z = tree.corners[f, 3 * k], tree.corners[f, 3 * k + 1], tree.corners[f, 3 * k + 2]
        e = (tree.corners[f, j] - x, tree.corners[f, j + 1] - y, tree.corners[f, j + 2] - z)
        inward = cross(m, e)
        if dot(inward, (p[0] - x, p[1] - y, p[2] - z)) < -_BESIDE * math.sqrt(dot(e, e)):
            return False
    return True


@kernel
def _mark(tree, edges, places, toward, reach, marks, taken):
    points = places[0]
    slope, near = reach
    wide = _WIDER * slope
    n, m = points.shape[0], edges.ends.shape[0]
    box = _bound_points(points)
    facing = np.zeros(tree.normals.shape[0], np.int8)
    rims = np.zeros((m, 6))
    bins = np.zeros(n, np.int32)
    entries = np.zeros((max(4 * m, 16), 2), np.int32)
    while True:
        k = take_next(taken)
        if k >= toward.shape[0]:
            return
        frame = make_frame(get(toward, k), slope)
        number = _list_rims(tree, edges, frame, facing, rims)
        corner, scale, shape = _lay_bins(n, box, frame, number)
        lowest = np.full(shape[0] * shape[1], np.inf)
        heads = np.full(shape[0] * shape[1], -1, np.int32)
        bottom = _fill_bins(points, frame, corner, scale, shape, bins, lowest)
        count = 0
        for e in range(number):
            while True:
                added = _enter(
                    rims, e, (wide, near, bottom), corner, scale, shape, lowest, heads, entries,
                    count,
                )  # fmt: skip
                if added >= 0:
                    break
                wider = np.zeros((2 * entries.shape[0], 2), np.int32)
                for q in range(count):
                    wider[q, 0], wider[q, 1] = entries[q, 0], entries[q, 1]
                entries = wider
            count = added
        _ask_bins(places, frame, (wide, near), bins, rims, heads, entries, marks[k])


@borrowing
def _list_rims(tree, edges, frame, facing, rims):
    """
    List edges that may bound what covers the disc, in its frame; return their number.

    All but those with a face on either side, as seen from wherever the disc meets them. The end
    that is farther toward the disc is the last.
    """
    d, u, v, slope = frame
    for f in range(facing.size):
        toward = dot(get(tree.normals, f), d)
        facing[f] = 0 if abs(toward) <= _GRAZING * slope else 1 if toward > 0.0 else -1
    number = 0
    ends = edges.ends
    for e in range(ends.shape[0]):
        left, right = False, False
        for q in range(edges.starts[e], edges.starts[e + 1]):
            code = edges.codes[q]
            side = facing[code >> 1] * (1 - 2 * (code & 1))
            left, right = left or side > 0, right or side < 0
        if left and right:
            continue
        a, b = get(ends, e), (ends[e, 3], ends[e, 4], ends[e, 5])
        if dot(a, d) > dot(b, d):
            a, b = b, a
        rims[number, 0], rims[number, 1], rims[number, 2] = dot(a, u), dot(a, v), dot(a, d)
        rims[number, 3], rims[number, 4], rims[number, 5] = dot(b, u), dot(b, v), dot(b, d)
        number += 1
    return number


@borrowing
def _bound_points(points):
    """Return the lowest and the highest coordinates."""
    low, high = (math.inf, math.inf, math.inf), (-math.inf, -math.inf, -math.inf)
    for i in range(points.shape[0]):
        p = get(points, i)
        low = (min(low[0], p[0]), min(low[1], p[1]), min(low[2], p[2]))
        high = (max(high[0], p[0]), max(high[1], p[1]), max(high[2], p[2]))
    return low, high


@borrowing
def _lay_bins(points, box, frame, rims):
    """Return the lowest corner of bins across the disc's way, bins a metre, and their numbers."""
    low, high = box
    (x0, x1), (y0, y1) = _bound(low, high, frame.u), _bound(low, high, frame.v)
    wide, high_ = max(x1 - x0, 1e-3), max(y1 - y0, 1e-3)
    wanted = min(max(0.5 * math.sqrt(points * (rims + 1.0)), _FEWEST), _MOST)
    side = max(math.sqrt(wide * high_ / wanted), max(wide, high_) / wanted)
    return (x0, y0), 1.0 / side, (np.int64(wide / side) + 1, np.int64(high_ / side) + 1)


@inlined
def _bound(low, high, u):
    """Return the least and the most coordinate of a box along a direction."""
    least, most = 0.0, 0.0
    for k in range(3):
        least += min(u[k] * low[k], u[k] * high[k])
        most += max(u[k] * low[k], u[k] * high[k])
    return least, most


@borrowing
def _fill_bins(points, frame, corner, scale, shape, bins, lowest):
    """Find each point's bin, and the lowest point of each; return the lowest of all."""
    d, u, v, _ = frame
    bottom = math.inf
    for i in range(points.shape[0]):
        p = get(points, i)
        z = dot(p, d)
        column = min(max(np.int64((dot(p, u) - corner[0]) * scale), 0), shape[0] - 1)
        row = min(max(np.int64((dot(p, v) - corner[1]) * scale), 0), shape[1] - 1)
        at = row * shape[0] + column
        bins[i] = at
        lowest[at] = min(lowest[at], z)
        bottom = min(bottom, z)
    return bottom


@borrowing
def _enter(rims, e, reach, corner, scale, shape, lowest, heads, entries, count):
    """Enter an edge in the bins that its penumbra meets; return the entries, -1: no room."""
    slope, near, bottom = reach
    (xa, ya), (xb, yb), top = (rims[e, 0], rims[e, 1]), (rims[e, 3], rims[e, 4]), rims[e, 5]
    if top < bottom - near:
        return count
    farthest = slope * (top - bottom + near) + near
    first = max(math.floor((min(ya, yb) - farthest - corner[1]) * scale), 0)
    end = min(math.floor((max(ya, yb) + farthest - corner[1]) * scale), shape[1] - 1) + 1
    if count + max(end - first, 0) * shape[0] > entries.shape[0]:
        left = math.floor((min(xa, xb) - farthest - corner[0]) * scale)
        right = math.floor((max(xa, xb) + farthest - corner[0]) * scale) + 1
        if count + max(end - first, 0) * (right - left) > entries.shape[0]:
            return -1
    dx, dy = xb - xa, yb - ya
    side = 1.0 / scale
    half = 0.7072 * side
    for row in range(first, end):
        # The part of the edge that may be near the row.
        low, high = corner[1] + row * side - farthest, corner[1] + (row + 1) * side + farthest
        s, t = 0.0, 1.0
        if abs(dy) > _LEVEL:
            one, two = (low - ya) / dy, (high - ya) / dy
            s, t = max(min(one, two), 0.0), min(max(one, two), 1.0)
            if s > t:
                continue
        left = min(xa + s * dx, xa + t * dx) - farthest - near
        right = max(xa + s * dx, xa + t * dx) + farthest + near
        begin = max(math.floor((left - corner[0]) * scale), 0)
        stop = min(math.floor((right - corner[0]) * scale), shape[0] - 1) + 1
        for column in range(begin, stop):
            at = row * shape[0] + column
            if lowest[at] > top + near:
                continue
            x, y = corner[0] + (column + 0.5) * side, corner[1] + (row + 0.5) * side
            if _reaches(rims, e, x, y, lowest[at], slope, near, half):
                entries[count, 0], entries[count, 1] = e, heads[at]
                heads[at] = count
                count += 1
    return count


@borrowing
def _ask_bins(places, frame, reach, bins, rims, heads, entries, marks):
    """Mark the points whose disc an edge in their bin may cut, or their own surface."""
    points, normals, touching = places
    d, u, v, radius = frame
    slope, near = reach
    grazing = (_GRAZING * radius) ** 2
    for i in range(points.shape[0]):
        n = get(normals, i)
        toward = dot(n, d)
        if toward * toward <= grazing * dot(n, n):
            marks[i] = True
            continue
        if toward < 0.0:
            continue  # behind its own surface
        if touching[i]:
            marks[i] = True
            continue
        entry = heads[bins[i]]
        if entry < 0:
            continue
        p = get(points, i)
        px, py, pz = dot(p, u), dot(p, v), dot(p, d)
        while entry >= 0:
            e, entry = entries[entry, 0], entries[entry, 1]
            if _reaches(rims, e, px, py, pz, slope, near, 0.0):
                marks[i] = True
                break


@inlined
def _reaches(rims, e, x, y, z, slope, near, around):
    """
    Return whether an edge's penumbra comes within a distance of a place.

    It is as wide as ``slope`` times the height above the place, and twice ``near`` at most wider.
    """
    rise, low = rims[e, 5] - rims[e, 2], rims[e, 2] - z + near
    if low + rise < 0.0:
        return False
    x, y = x - rims[e, 0], y - rims[e, 1]
    dx, dy = rims[e, 3] - rims[e, 0], rims[e, 4] - rims[e, 1]
    wide, wider = slope * low + near + around, slope * rise
    # Of the part that is not below the place: distance and width, squared, differ by a parabola.
    first = -low / rise if low < 0.0 else 0.0
    bend, t = dx * dx + dy * dy - wider * wider, 1.0
    if bend > 0.0:
        t = min(max((x * dx + y * dy + wide * wider) / bend, first), 1.0)
    ax, ay, width = x - t * dx, y - t * dy, wide + t * wider
    return ax * ax + ay * ay <= width * width
