"""
What covers a disc in the sky, as directed sides of polygons on the plane that touches its middle.

There faces are polygons with straight sides, and the disc is the unit circle. Each polygon runs
counterclockwise. A side that two joined faces pass in opposite directions bounds nothing: both are
left out. What remains are silhouettes, and the ends of sheets.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, dot, inlined, inner
from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import get

__all__ = [
    "NO_LAND", "DiscFrame", "LandEdge", "Sides", "add_face", "add_land_edge", "add_plane",
    "clear_sides", "make_frame", "make_land_edge", "make_sides",
]  # fmt: skip

_MOST = 1800  # sides: of 512 faces, and of planes and land
_TABLE = 4096  # a power of 2, above twice that
_CORNERS = 6
_HEIGHTS = 8192  # most corners and crossings in a disc
_NEAR = 1e-13  # nearest depth of a corner [m]
_FAR = 4.0  # half side of the square that planes through the point are cut from [radii]
_COVERED = -1
_AROUND = 30.0  # overlap of the land's edge with itself [degrees]


class Sides(NamedTuple):
    """
    Sides of polygons before a disc, and scratch for their area.

    Parameters
    ----------
    lines : (n, 6) float64
        Of the end nearer the middle x and y, the way to the other dx and dy, the other's y, and how
        many polygons more there are to the right of a side than to its left; 0: the side is none.
    keys : (n,) int64
        Of sides between welded vertices: first and last, as seen; -1 of others.
    slots : (n,) int64
        Their places in the table.
    table : (m,) int64
        A side's number and 1; 0 of free slots.
    corners : (6, 2) float64
        Of one polygon.
    heights : (q,) float64
        Of corners and crossings.
    crossings : (n, 3) float64
        On one level line: x, area to the left, and the change of the count.
    """

    lines: NDArray[np.float64]
    keys: NDArray[np.int64]
    slots: NDArray[np.int64]
    table: NDArray[np.int64]
    corners: NDArray[np.float64]
    heights: NDArray[np.float64]
    crossings: NDArray[np.float64]


class LandEdge(NamedTuple):
    """
    The upper edge of the land far away, along great circles between its bends.

    Parameters
    ----------
    azimuths : (n,) float64
        Ascending, clockwise from the model's y axis, from below 0 to above 2 pi; none without land
        [radians].
    slopes : (n,) float64
        Tangents of the elevations.
    """

    azimuths: NDArray[np.float64]
    slopes: NDArray[np.float64]


def make_land_edge(
    azimuth: NDArray[np.float64], elevation: NDArray[np.float64], turn: float
) -> LandEdge:
    """Return the edge of bends (n,) from 0 to 360, all turned clockwise [degrees]."""
    bends = np.stack([(azimuth[:-1] + turn) % 360.0, elevation[:-1]])
    bends = bends[:, np.argsort(bends[0])]
    around = np.concatenate([bends - [[360.0], [0.0]], bends, bends + [[360.0], [0.0]]], axis=1)
    edge = around[:, (around[0] > -_AROUND) & (around[0] < 360.0 + _AROUND)]
    return LandEdge(np.radians(edge[0]), np.tan(np.radians(edge[1])))


NO_LAND = LandEdge(np.zeros(0), np.zeros(0))
"""Land that covers nothing."""


class DiscFrame(NamedTuple):
    """A disc's middle, two directions across it, and the tangent of its angular radius."""

    d: tuple[float, float, float]
    u: tuple[float, float, float]
    v: tuple[float, float, float]
    radius: float


def _make_sides():
    return Sides(
        np.zeros((_MOST, 6)), np.zeros(_MOST, np.int64), np.zeros(_MOST, np.int64),
        np.zeros(_TABLE, np.int64), np.zeros((_CORNERS, 2)), np.zeros(_HEIGHTS),
        np.zeros((_MOST, 3)),
    )  # fmt: skip


make_sides = inner(_make_sides)
"""Make scratch for the sides before one disc."""


@inlined
def make_frame(d, radius):
    """Return the frame of a disc in a direction."""
    e = (1.0, 0.0, 0.0) if abs(d[0]) < abs(d[1]) else (0.0, 1.0, 0.0)
    along = dot(e, d)
    x, y, z = e[0] - along * d[0], e[1] - along * d[1], e[2] - along * d[2]
    length = math.sqrt(x * x + y * y + z * z)
    u = (x / length, y / length, z / length)
    v = (d[1] * u[2] - d[2] * u[1], d[2] * u[0] - d[0] * u[2], d[0] * u[1] - d[1] * u[0])
    return DiscFrame(d, u, v, radius)


@borrowing
def clear_sides(sides, count):
    """Forget all sides."""
    for i in range(count):
        if sides.keys[i] >= 0:
            sides.table[sides.slots[i]] = 0


@borrowing
def add_plane(sides, count, frame, m):
    """
    Add what is behind a plane through the point, of normal m; return the number of sides.

    -1 where that is all of the disc. The part is a square cut by the line.
    """
    a, r = dot(m, frame.d), frame.radius
    b, c = r * dot(m, frame.u), r * dot(m, frame.v)
    length = math.sqrt(b * b + c * c)
    if a >= length:
        return count
    if a <= -length:
        return _COVERED
    n = 0
    x0, y0 = _FAR, _FAR
    for k in range(4):
        x1 = -_FAR if k in (0, 1) else _FAR
        y1 = -_FAR if k in (1, 2) else _FAR
        at_start, at_end = a + b * x0 + c * y0, a + b * x1 + c * y1
        if at_start < 0.0:
            sides.corners[n, 0], sides.corners[n, 1] = x0, y0
            n += 1
        if (at_start < 0.0) != (at_end < 0.0):
            share = at_start / (at_start - at_end)
            sides.corners[n, 0] = x0 + share * (x1 - x0)
            sides.corners[n, 1] = y0 + share * (y1 - y0)
            n += 1
        x0, y0 = x1, y1
    return _add_polygon(sides, count, n, 1.0, (np.int64(-1), np.int64(-1), np.int64(-1)))


@borrowing
def add_face(sides, count, frame, tree: FaceTree, f, p):
    """Add a face as it covers the disc; return the number of sides, -1 where it covers all."""
    m, c = get(tree.normals, f), get(tree.corners, f)
    height = m[0] * (p[0] - c[0]) + m[1] * (p[1] - c[1]) + m[2] * (p[2] - c[2])
    if abs(height) <= tree.normals[f, 3]:
        return count
    c = tree.corners
    first = (c[f, 0] - p[0], c[f, 1] - p[1], c[f, 2] - p[2])
    second = (c[f, 3] - p[0], c[f, 4] - p[1], c[f, 5] - p[2])
    third = (c[f, 6] - p[0], c[f, 7] - p[1], c[f, 8] - p[2])
    sign = -1.0 if height > 0.0 else 1.0  # wound as in the tree, or seen from behind
    return _add_corners(sides, count, frame, first, second, third, sign, get(tree.ids, f))


@borrowing
def add_land_edge(sides, count, frame, land):
    """
    Add the land as it covers the disc; return the number of sides, -1 where it covers all.

    It is a polygon along the bends, from meridians beside the disc straight down on its plane.
    """
    n = land.azimuths.size
    if n == 0:
        return count
    d, r = frame.d, frame.radius
    level = math.sqrt(d[0] * d[0] + d[1] * d[1])
    around = math.atan2(d[0], d[1])
    around += 2.0 * math.pi if around < 0.0 else 0.0
    away = 1.01 * r / max(level, r)
    first = max(np.searchsorted(land.azimuths, around - away) - 1, 0)
    end = min(np.searchsorted(land.azimuths, around + away, "right"), n - 1)
    middle = np.searchsorted(land.azimuths, around, "right") - 1
    share = (around - land.azimuths[middle]) / (land.azimuths[middle + 1] - land.azimuths[middle])
    edge = land.slopes[middle] + share * (land.slopes[middle + 1] - land.slopes[middle])
    top = max(edge, 0.0)
    for k in range(first, end + 1):
        top = max(top, land.slopes[k])
    below = (d[2] - 2.0 * r) / (level + 2.0 * r)  # slope below all of the disc
    if top <= below:
        return count
    if level < 4.0 * r:  # of the zenith: by the middle
        return count if edge * level <= d[2] else _COVERED
    before, meets = count, False
    x0, y0 = _project(frame, land.azimuths[first], land.slopes[first])
    left = _project(frame, land.azimuths[first], min(land.slopes[first], below))
    right = _project(frame, land.azimuths[end], min(land.slopes[end], below))
    down = (-_FAR * frame.u[2] / level, -_FAR * frame.v[2] / level)
    for k in range(first + 1, end + 5):
        if k <= end:
            x, y = _project(frame, land.azimuths[k], land.slopes[k])
        elif k == end + 1:
            x, y = right
        elif k == end + 2:
            x, y = right[0] + down[0], right[1] + down[1]
        elif k == end + 3:
            x, y = left[0] + down[0], left[1] + down[1]
        else:
            x, y = left
        _set_line(sides, count, x0, y0, x, y, 1.0)
        meets = meets or (k <= end and _meets(sides, count))
        count += 1
        x0, y0 = x, y
    x, y = _project(frame, land.azimuths[first], land.slopes[first])
    _set_line(sides, count, x0, y0, x, y, 1.0)
    if meets:
        return count + 1
    return before if edge * level <= d[2] else _COVERED


@inlined
def _project(frame, azimuth, slope):
    """Return where a direction meets the disc's plane."""
    w = (math.sin(azimuth), math.cos(azimuth), slope)
    depth = dot(w, frame.d) * frame.radius
    return dot(w, frame.u) / depth, dot(w, frame.v) / depth


@inlined
def _meets(sides, line):
    """Return whether a side meets the disc."""
    a = sides.lines
    x, y, dx, dy = a[line, 0], a[line, 1], a[line, 2], a[line, 3]
    length = dx * dx + dy * dy
    t = min(max(-(x * dx + y * dy) / length, 0.0), 1.0) if length > 0.0 else 0.0
    return (x + t * dx) ** 2 + (y + t * dy) ** 2 < 1.0


@inlined
def _add_corners(sides, count, frame, first, second, third, sign, ids):
    """Add a triangle by its corners from the point."""
    d, u, v, r = frame
    n = 0
    corners = sides.corners
    depths = (dot(first, d), dot(second, d), dot(third, d))
    if depths[0] > _NEAR and depths[1] > _NEAR and depths[2] > _NEAR:
        corners[0, 0], corners[0, 1] = (
            dot(first, u) / (depths[0] * r),
            dot(first, v) / (depths[0] * r),
        )
        corners[1, 0], corners[1, 1] = (
            dot(second, u) / (depths[1] * r),
            dot(second, v) / (depths[1] * r),
        )
        corners[2, 0], corners[2, 1] = (
            dot(third, u) / (depths[2] * r), dot(third, v) / (depths[2] * r),
        )  # fmt: skip
        return _add_polygon(sides, count, 3, sign, ids)
    n = _cut(corners, n, frame, first, second, depths[0], depths[1])
    n = _cut(corners, n, frame, second, third, depths[1], depths[2])
    n = _cut(corners, n, frame, third, first, depths[2], depths[0])
    if n < 3:
        return count
    return _add_polygon(sides, count, n, sign, (np.int64(-1), np.int64(-1), np.int64(-1)))


@borrowing
def _cut(corners, n, frame, a, b, depth_a, depth_b):
    """Add what a side leaves before the viewer's plane, but for its end; return the number."""
    _, u, v, r = frame
    if depth_a > _NEAR:
        corners[n, 0], corners[n, 1] = dot(a, u) / (depth_a * r), dot(a, v) / (depth_a * r)
        n += 1
    if (depth_a > _NEAR) != (depth_b > _NEAR):
        share = (_NEAR - depth_a) / (depth_b - depth_a)
        w = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]),
             a[2] + share * (b[2] - a[2]))  # fmt: skip
        corners[n, 0], corners[n, 1] = dot(w, u) / (_NEAR * r), dot(w, v) / (_NEAR * r)
        n += 1
    return n


@borrowing
def _add_polygon(sides, count, n, sign, ids):
    """
    Add the sides of a polygon whose corners are set; return the number, -1 if it covers the disc.

    One that is counterclockwise has the sign 1, else -1.
    """
    if count + n > sides.lines.shape[0]:
        return count  # never: its callers take no more faces
    corners, lines = sides.corners, sides.lines
    inside = True
    for k in range(n):
        j = k + 1 if k + 1 < n else 0
        line = count + k
        turn = _set_line(
            sides, line, corners[k, 0], corners[k, 1], corners[j, 0], corners[j, 1], sign
        )
        x, y, dx, dy = lines[line, 0], lines[line, 1], lines[line, 2], lines[line, 3]
        away, length = turn * (x * dy - y * dx), math.sqrt(dx * dx + dy * dy)
        if away <= -length:
            return count  # all of the disc is before this side
        inside = inside and away >= length
    if inside:
        return _COVERED
    if ids[0] < 0:
        return count + n
    for k in range(3):
        a, b = ids[k], ids[(k + 1) % 3]
        if sign < 0.0:
            a, b = b, a
        _weld(sides, count + k, np.int64(a) << 32 | np.int64(b), np.int64(b) << 32 | np.int64(a))
    return count + n


@inlined
def _set_line(sides, line, x, y, ex, ey, sign):
    """Set a side from its nearer end; return 1, or -1 if that is the end of a counterclockwise."""
    turn = sign
    if x * x + y * y > ex * ex + ey * ey:
        # The other may be so far that differences from it have no digit left.
        x, y, ex, ey = ex, ey, x, y
        turn = -sign
    lines = sides.lines
    lines[line, 0], lines[line, 1], lines[line, 2], lines[line, 3] = x, y, ex - x, ey - y
    lines[line, 4], lines[line, 5] = ey, -turn if ey > y else turn
    sides.keys[line] = -1
    return turn


@inlined
def _weld(sides, line, key, opposite):
    """Enter a side; where one runs the other way both bound nothing."""
    table, mask = sides.table, sides.table.size - 1
    at = _hash(opposite) & mask
    while table[at] != 0:
        other = table[at] - 1
        if sides.keys[other] == opposite and sides.lines[other, 5] != 0.0:
            sides.lines[other, 5] = 0.0
            sides.lines[line, 5] = 0.0
            return
        at = (at + 1) & mask
    at = _hash(key) & mask
    while table[at] != 0:
        at = (at + 1) & mask
    table[at] = line + 1
    sides.keys[line], sides.slots[line] = key, at


@inlined
def _hash(key):
    return (key * np.int64(0x9E3779B97F4A7C1)) >> np.int64(20)
