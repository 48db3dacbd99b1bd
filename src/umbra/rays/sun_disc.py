"""
The share of a disc in the sky, such as the sun, that points see: exact against straight edges.

On the plane that touches the unit sphere in the disc's middle faces are polygons with straight
sides, and the disc is a circle. The plane is cut into slabs at all corners and crossings of sides:
in each the free part of every level line is bounded by the same sides and arcs, whose areas have
closed forms. Any faces will do, as in the sweep of the sky. Where a thicket of faces covers a disc,
it is judged by many rays.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.kernels import borrowing, dot, inlined, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.hidden import get, is_hidden
from umbra.rays.lanes import LANES

__all__ = ["find_free_disc"]

_CORNERS = 6
_FACES = 128  # most that cover one disc in part; of more it is judged by rays
_HEIGHTS = 8192
_RAYS = 4096
_TINY = 1e-30
_NEAR = 1e-13  # nearest depth of a corner [m]
_FAR = 4.0  # half side of the square that planes through the point are cut from [radii]


def find_free_disc(
    tree: FaceTree,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    toward: NDArray[np.float64],
    radius: float,
    threads: int = 1,
) -> NDArray[np.float64]:
    """
    Return the share of a disc that each point sees, 0 to 1.

    What lies behind the point's surface or below the horizon is not seen.

    Parameters
    ----------
    tree : FaceTree
    points : (n, 3) float64
        In the caster's frame [m]. A face whose plane holds a point covers nothing.
    normals : (n, 3) float64
        Normals of the points' surfaces; NaN for points that have none.
    toward : (m, n, 3) or (m, 1, 3) float64
        Unit directions toward the disc's middle: of each point, or of all alike.
    radius : float
        Of the disc [degrees].
    threads : int

    Returns
    -------
    shares : (m, n) float64
    """
    shares = np.zeros((len(toward), len(points)))
    use_threads(threads)
    given = tree, points, normals, toward, math.tan(math.radians(radius)), shares
    run_shared(-(-len(points) // 16), _find, *given)
    return shares


@njit(cache=True, nogil=True)
def _find(tree, points, normals, toward, radius, shares, taken):
    n = points.shape[0]
    while True:
        block = take_next(taken)
        if block >= (n + 15) // 16:
            return
        stack = np.zeros(DEEPEST, np.int32)
        sides = np.zeros((_FACES, _CORNERS, 2))
        sizes = np.zeros(_FACES, np.int32)
        heights = np.zeros(_HEIGHTS)
        spans = np.zeros((_FACES, 4))
        for i in range(block * 16, min(n, (block + 1) * 16)):
            for k in range(toward.shape[0]):
                d = get(toward[k], i if toward.shape[1] > 1 else 0)
                shares[k, i] = _find_one(
                    tree, get(points, i), get(normals, i), d, radius, stack, sides, sizes, heights,
                    spans,
                )  # fmt: skip


@borrowing
def _find_one(tree, p, n, d, radius, stack, sides, sizes, heights, spans):
    """Return the free share of one disc."""
    e = (1.0, 0.0, 0.0) if abs(d[0]) < abs(d[1]) else (0.0, 1.0, 0.0)
    along = dot(e, d)
    ux, uy, uz = e[0] - along * d[0], e[1] - along * d[1], e[2] - along * d[2]
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    u = (ux / length, uy / length, uz / length)
    v = (d[1] * u[2] - d[2] * u[1], d[2] * u[0] - d[0] * u[2], d[0] * u[1] - d[1] * u[0])
    count = 0
    for which in range(2):
        # The horizon's plane, and the surface's own: what is behind them is covered.
        m = (0.0, 0.0, 1.0) if which == 0 else n
        if m[0] != m[0]:
            continue
        got = _cover_behind(dot(m, d), radius * dot(m, u), radius * dot(m, v), sides, sizes, count)
        if got < 0:
            return 0.0
        count = got
    inverse = (_invert(d[0]), _invert(d[1]), _invert(d[2]))
    stack[0] = 0
    size = 1
    while size > 0:
        size -= 1
        node = np.int64(stack[size])
        for lane in range(LANES):
            if not _meets(tree.boxes, node, lane, p, d, inverse, radius):
                continue
            child = np.int64(tree.links[node, lane])
            if child >= 0:
                stack[size] = child
                size += 1
                continue
            if count == _FACES:
                return _sample(tree, p, n, d, u, v, radius, stack)
            got = _add_face(tree, ~child, p, d, u, v, radius, sides, sizes, count)
            if got < 0:
                return 0.0
            count = got
    if count == 0:
        return 1.0
    share = _integrate(sides, sizes, count, heights, spans)
    return share if share >= 0.0 else _sample(tree, p, n, d, u, v, radius, stack)


@borrowing
def _sample(tree, p, n, d, u, v, radius, stack):
    """Return the free share of one disc by rays."""
    free, last = 0, np.int64(-1)
    for k in range(_RAYS):
        away, turn = radius * math.sqrt((k + 0.5) / _RAYS), k * 2.399963229728653
        x, y = away * math.cos(turn), away * math.sin(turn)
        w = (d[0] + x * u[0] + y * v[0], d[1] + x * u[1] + y * v[1], d[2] + x * u[2] + y * v[2])
        length = math.sqrt(dot(w, w))
        w = (w[0] / length, w[1] / length, w[2] / length)
        if w[2] <= 0.0 or dot(n, w) <= 0.0:
            continue
        last = is_hidden(p, n, w, tree, stack, last)
        free += last < 0
    return free / _RAYS


@inlined
def _invert(x):
    return 1.0 / x if abs(x) > _TINY else 1.0 / _TINY


@inlined
def _meets(boxes, node, lane, p, d, inverse, radius):
    """Return whether a box may meet the cone of the disc: the ray does, as thick as at its end."""
    least_x, least_y = boxes[node, 0, lane] - p[0], boxes[node, 1, lane] - p[1]
    least_z = boxes[node, 2, lane] - p[2]
    most_x, most_y = boxes[node, 3, lane] - p[0], boxes[node, 4, lane] - p[1]
    most_z = boxes[node, 5, lane] - p[2]
    if not least_x <= most_x:  # an empty slot
        return False
    end = max(least_x * d[0], most_x * d[0]) + max(least_y * d[1], most_y * d[1])
    end += max(least_z * d[2], most_z * d[2])
    if not end > 0.0:
        return False
    thick = end * radius * 1.0001 + 1e-9
    near, far = 0.0, math.inf
    one, two = (least_x - thick) * inverse[0], (most_x + thick) * inverse[0]
    near, far = max(near, min(one, two)), min(far, max(one, two))
    one, two = (least_y - thick) * inverse[1], (most_y + thick) * inverse[1]
    near, far = max(near, min(one, two)), min(far, max(one, two))
    one, two = (least_z - thick) * inverse[2], (most_z + thick) * inverse[2]
    near, far = max(near, min(one, two)), min(far, max(one, two))
    return near <= far


@borrowing
def _cover_behind(a, b, c, sides, sizes, count):
    """
    Add the part of the disc where a + b x + c y < 0; return the number, -1 where that is all.

    The part is a square cut by the line.
    """
    length = math.sqrt(b * b + c * c)
    if a >= length:
        return count
    if a <= -length:
        return -1
    n = 0
    x0, y0 = _FAR, _FAR
    for k in range(4):
        x1 = -_FAR if k in (0, 1) else _FAR
        y1 = -_FAR if k in (1, 2) else _FAR
        one, two = a + b * x0 + c * y0, a + b * x1 + c * y1
        if one < 0.0:
            sides[count, n, 0], sides[count, n, 1] = x0, y0
            n += 1
        if (one < 0.0) != (two < 0.0):
            share = one / (one - two)
            sides[count, n, 0] = x0 + share * (x1 - x0)
            sides[count, n, 1] = y0 + share * (y1 - y0)
            n += 1
        x0, y0 = x1, y1
    sizes[count] = n
    return count + 1


@borrowing
def _add_face(tree, f, p, d, u, v, radius, sides, sizes, count):
    """Add a face as it covers the disc; return the number, -1 where it covers all of it."""
    m, c = get(tree.normals, f), get(tree.corners, f)
    height = m[0] * (p[0] - c[0]) + m[1] * (p[1] - c[1]) + m[2] * (p[2] - c[2])
    if abs(height) <= tree.normals[f, 3]:
        return count
    n = 0
    for k in range(3):
        j = 3 * k
        a = (
            tree.corners[f, j] - p[0],
            tree.corners[f, j + 1] - p[1],
            tree.corners[f, j + 2] - p[2],
        )
        j = 3 * ((k + 1) % 3)
        b = (
            tree.corners[f, j] - p[0],
            tree.corners[f, j + 1] - p[1],
            tree.corners[f, j + 2] - p[2],
        )
        one, two = dot(a, d), dot(b, d)
        if one > _NEAR:
            sides[count, n, 0] = dot(a, u) / (one * radius)
            sides[count, n, 1] = dot(a, v) / (one * radius)
            n += 1
        if (one > _NEAR) != (two > _NEAR):
            share = (_NEAR - one) / (two - one)
            w = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]),
                 a[2] + share * (b[2] - a[2]))  # fmt: skip
            sides[count, n, 0] = dot(w, u) / (_NEAR * radius)
            sides[count, n, 1] = dot(w, v) / (_NEAR * radius)
            n += 1
    if n < 3:
        return count
    # All of the disc before one side: outside. Behind all sides: it is covered whole.
    sign = -1.0 if height > 0.0 else 1.0  # wound as in the tree, or seen from behind
    inside = True
    for k in range(n):
        x, y, dx, dy, turn = _find_side(sides[count], k, n)
        away, length = sign * turn * (x * dy - y * dx), math.hypot(dx, dy)
        if away <= -length:
            return count
        inside = inside and away >= length
    if inside:
        return -1
    sizes[count] = n
    return count + 1


@borrowing
def _integrate(sides, sizes, count, heights, spans):
    """Return the share of the unit disc that no polygon covers; below 0 with too many crossings."""
    n = _list_heights(sides, sizes, count, heights)
    if n == heights.size:
        return -1.0
    free = 0.0
    for q in range(n - 1):
        low, high = heights[q], heights[q + 1]
        if not high > low:
            continue
        y = 0.5 * (low + high)
        round_ = _measure_arc(high) - _measure_arc(low)
        half = math.sqrt(max(1.0 - y * y, 0.0))
        m = 0
        for i in range(count):
            left, right = _cross(sides[i], sizes[i], y)
            left_round, right_round = left <= -half, right >= half
            if left >= right or right <= -half or left >= half:
                continue
            spans[m, 0] = -half if left_round else left
            spans[m, 1] = half if right_round else right
            spans[m, 2] = -round_ if left_round else left * (high - low)
            spans[m, 3] = round_ if right_round else right * (high - low)
            at = m
            while at > 0 and spans[at - 1, 0] > spans[at, 0]:
                for c in range(4):
                    spans[at - 1, c], spans[at, c] = spans[at, c], spans[at - 1, c]
                at -= 1
            m += 1
        reached, area = -half, -round_
        for i in range(m):
            if spans[i, 0] > reached:
                free += spans[i, 2] - area
            if spans[i, 1] > reached:
                reached, area = spans[i, 1], spans[i, 3]
        if reached < half:
            free += round_ - area
    return min(max(free / math.pi, 0.0), 1.0)


@inlined
def _find_side(corners, k, n):
    """
    Return a polygon's side from its nearer end: x, y, dx, dy, and -1 if that is its second end.

    The farther may be so far that differences from it have no digit left.
    """
    j = k + 1 if k + 1 < n else 0
    x0, y0, x1, y1 = corners[k, 0], corners[k, 1], corners[j, 0], corners[j, 1]
    if x0 * x0 + y0 * y0 <= x1 * x1 + y1 * y1:
        return x0, y0, x1 - x0, y1 - y0, 1.0
    return x1, y1, x0 - x1, y0 - y1, -1.0


@borrowing
def _measure_arc(y):
    """Return the integral of sqrt(1 - y^2) from 0 on."""
    y = min(max(y, -1.0), 1.0)
    return 0.5 * (y * math.sqrt(1.0 - y * y) + math.asin(y))


@borrowing
def _cross(corners, n, y):
    """Return from where to where a polygon covers the line at a height."""
    left, right = math.inf, -math.inf
    for k in range(n):
        j = k + 1 if k + 1 < n else 0
        y0, y1 = corners[k, 1], corners[j, 1]
        if (y0 > y) != (y1 > y):
            x0, y0, dx, dy, _ = _find_side(corners, k, n)
            x = x0 + (y - y0) / dy * dx
            left, right = min(left, x), max(right, x)
    return left, right


@borrowing
def _list_heights(sides, sizes, count, heights):
    """
    List the heights of all corners and crossings in the disc, rising; return their number.

    That of the array, if there is no room for more.
    """
    heights[0], heights[1] = -1.0, 1.0
    n = 2
    for i in range(count):
        for k in range(sizes[i]):
            n = _add_height(heights, n, sides[i, k, 1])
            x, y, dx, dy, _ = _find_side(sides[i], k, sizes[i])
            # Where the side passes the circle.
            a, b, c = dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - 1.0
            root = b * b - a * c
            if root <= 0.0 or a == 0.0:
                continue
            for sign in (-1.0, 1.0):
                t = (-b + sign * math.sqrt(root)) / a
                if 0.0 < t < 1.0:
                    n = _add_height(heights, n, y + t * dy)
            for other in range(i):
                for q in range(sizes[other]):
                    ox, oy, ex, ey, _ = _find_side(sides[other], q, sizes[other])
                    ox, oy = ox - x, oy - y
                    turn = dx * ey - dy * ex
                    if turn == 0.0:
                        continue
                    t, w = (ox * ey - oy * ex) / turn, (ox * dy - oy * dx) / turn
                    if 0.0 < t < 1.0 and 0.0 < w < 1.0:
                        n = _add_height(heights, n, y + t * dy)
    _sort(heights, n)
    return n


@borrowing
def _add_height(heights, n, y):
    """Add a height within the disc, if there is room; return the number."""
    if n < heights.size and abs(y) < 1.0:
        heights[n] = y
        n += 1
    return n


@borrowing
def _sort(values, n):
    """Sort the first n values (Shell 1959)."""
    gap = n // 2
    while gap > 0:
        for i in range(gap, n):
            value, at = values[i], i
            while at >= gap and values[at - gap] > value:
                values[at] = values[at - gap]
                at -= gap
            values[at] = value
        gap //= 2
