"""
Visible parts of outlines and creases, exact, as segments of the picture.

A triangle hides a point where the point lies behind its plane and within the pyramid from the eye
through its edges: half spaces all. So along an edge each triangle hides one interval.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.drawing.covers import BLOCK, CORNERS, CoverTriangles, clip_polygon, misses
from umbra.drawing.planar_regions import PlanarRegions
from umbra.kernels import borrowing, copy_rows, inner, kernel
from umbra.volume.adjacency import weld_vertices

__all__ = ["ModelEdges", "VisibleLines", "find_edges", "find_lines"]

_BEND = np.cos(np.radians(22.0))  # of two faces, from which there is a crease; as in pictures
_SHORT = 2.0**-6  # of a line that is left out [pixels]
_HIDDEN = 256  # intervals for which there is room at first
_TOUCH = 1e-9  # share of a line within which intervals touch


@dataclass(frozen=True, eq=False)
class ModelEdges:
    """Edges that a view draws: ends, owner, whether they are outlines, and what they belong to."""

    ends: NDArray[np.float64]  # (n, 2, 3)
    region: NDArray[np.intp]  # the first region at each, visible if one is
    sheet: NDArray[np.intp]  # of all its regions if they have one, else -1
    is_outline: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class VisibleLines:
    """Visible segments (n, 2, 2) in pixels, the region of each, and whether it is an outline."""

    segments: NDArray[np.float64]
    region: NDArray[np.intp]
    is_outline: NDArray[np.bool_]


def find_edges(
    regions: PlanarRegions, apex: NDArray[np.float64], visible: NDArray[np.bool_]
) -> ModelEdges:
    """
    Find the outlines and creases at visible regions (n_regions,), seen from the apex (4,).

    An edge is an outline where all its faces appear on one side of it, a crease where two of them
    bend.
    """
    points = regions.corners.reshape(-1, 3)
    welded = weld_vertices(points).reshape(-1, 3)
    tail, head = welded.ravel(), welded[:, [1, 2, 0]].ravel()
    key = np.minimum(tail, head).astype(np.int64) << 32 | np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    key, owner = key[order], regions.owner[order // 3]
    firsts = np.flatnonzero(np.append(True, key[1:] != key[:-1])) if len(key) else np.zeros(0, int)
    low, high = points[key >> 32], points[key & 0xFFFFFFFF]
    third = points[welded[order // 3, (order % 3 + 2) % 3]]
    across = np.cross(high - low, apex[:3] - apex[3] * low)
    side = np.sign(np.einsum("ij,ij->i", across, third - low))
    normal = regions.planes[owner, :3]
    bend = np.ones(len(key))
    bend[1:] = np.abs(np.einsum("ij,ij->i", normal[1:], normal[:-1]))
    bend[firsts] = 1.0
    if not len(key):
        none = np.zeros(0, np.intp)
        return ModelEdges(np.zeros((0, 2, 3)), none, none, np.zeros(0, np.bool_))
    is_crease = np.minimum.reduceat(bend, firsts) < _BEND
    is_outline = np.minimum.reduceat(side, firsts) * np.maximum.reduceat(side, firsts) >= 0
    # Of an edge within a region, or between two of one plane, only a rim is drawn.
    count = np.diff(np.append(firsts, len(key)))
    sheet = regions.sheet[owner]
    is_flat = np.minimum.reduceat(sheet, firsts) == np.maximum.reduceat(sheet, firsts)
    is_seen = np.maximum.reduceat(visible[owner].astype(np.int8), firsts) > 0
    is_drawn = is_seen & (is_crease | is_outline) & ~(is_flat & (count > 1) & ~is_outline)
    chosen = firsts[is_drawn]
    mark = np.where(visible[owner], owner, len(regions))
    region = np.minimum.reduceat(mark, firsts)[is_drawn]
    return ModelEdges(
        np.stack([low[chosen], high[chosen]], 1), region,
        np.where(is_flat, sheet[firsts], -1)[is_drawn], is_outline[is_drawn],
    )  # fmt: skip


def find_lines(
    edges: ModelEdges,
    triangles: CoverTriangles,
    sheet: NDArray[np.intp],
    is_there: NDArray[np.bool_],
    matrix: NDArray[np.float64],
    apex: NDArray[np.float64],
    walls: NDArray[np.float64],
    frame: NDArray[np.float64],
    tolerance: float,
) -> VisibleLines:
    """
    Find the visible parts of edges.

    ``walls`` and ``frame`` are half spaces (n, 4) to which triangles and edges are cut, ``frame``
    those of the picture; the other parameters as in ``Covers``.
    """
    limits = np.concatenate([walls, frame])
    ends, is_left = _cut_edges(edges.ends, limits)
    count = np.zeros(len(ends), np.int64)
    room = max(4 * len(ends), 16)
    while True:
        shares = np.zeros((room, 2))
        total = _find_clear(
            ends, edges.region[is_left], edges.sheet[is_left],
            (triangles.corners, triangles.region, triangles.boxes), sheet, is_there, matrix, apex,
            walls, tolerance, shares, count,
        )  # fmt: skip
        if total <= room:
            break
        room = total
    owner = np.repeat(np.arange(len(ends)), count)
    share = shares[:total]
    a, b = ends[owner, 0], ends[owner, 1]
    spots = np.stack([a + share[:, :1] * (b - a), a + share[:, 1:] * (b - a)], 1)
    homogeneous = spots @ matrix[:, :3].T + matrix[:, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        segments = homogeneous[..., :2] / homogeneous[..., 2:3]
        length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    long = length > _SHORT
    chosen = np.flatnonzero(is_left)[owner[long]]
    return VisibleLines(segments[long], edges.region[chosen], edges.is_outline[chosen])


def _cut_edges(
    ends: NDArray[np.float64], limits: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Cut edges (n, 2, 3) to half spaces; return what is left, and of which edges."""
    heights = ends @ limits[:, :3].T + limits[:, 3]  # (n, 2, m)
    at_start, at_end = heights[:, 0], heights[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.where((at_start < 0) != (at_end < 0), at_start / (at_start - at_end), np.nan)
    low = np.nanmax(np.where(at_start < 0, np.where(at_end < 0, 2.0, at), 0.0), axis=1)
    high = np.nanmin(np.where(at_end < 0, np.where(at_start < 0, -1.0, at), 1.0), axis=1)
    is_left = low < high
    a, b = ends[is_left, 0], ends[is_left, 1]
    shares = low[is_left, None], high[is_left, None]
    return np.stack([a + share * (b - a) for share in shares], 1), is_left


@borrowing
def _narrow(a, b, limit, least, span):
    """Narrow an interval of the line from a to b to limit . p > least."""
    at_start, at_end = limit[3] - least, limit[3] - least
    for j in range(3):
        at_start += limit[j] * a[j]
        at_end += limit[j] * b[j]
    if at_start <= 0.0 and at_end <= 0.0:
        span[1] = span[0]
    elif at_start <= 0.0:
        span[0] = max(span[0], at_start / (at_start - at_end))
    elif at_end <= 0.0:
        span[1] = min(span[1], at_start / (at_start - at_end))


@borrowing
def _through(apex, p, q, third, limit):
    """Write the half space through the apex and two points that holds a third; return its size."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx = apex[0] - apex[3] * p[0]
    vy = apex[1] - apex[3] * p[1]
    vz = apex[2] - apex[3] * p[2]
    limit[0], limit[1], limit[2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    limit[3] = -(limit[0] * p[0] + limit[1] * p[1] + limit[2] * p[2])
    size = np.sqrt(limit[0] ** 2 + limit[1] ** 2 + limit[2] ** 2)
    if size == 0.0:
        return False
    side = limit[3]
    for j in range(3):
        side += limit[j] * third[j]
    for j in range(4):
        limit[j] /= size if side > 0.0 else -size
    return side != 0.0


@inner
def _write_plane(c, plane):
    """Write the plane of a triangle: unit normal and offset."""
    ux, uy, uz = c[1, 0] - c[0, 0], c[1, 1] - c[0, 1], c[1, 2] - c[0, 2]
    vx, vy, vz = c[2, 0] - c[0, 0], c[2, 1] - c[0, 1], c[2, 2] - c[0, 2]
    plane[0] = uy * vz - uz * vy
    plane[1] = uz * vx - ux * vz
    plane[2] = ux * vy - uy * vx
    plane[:3] /= np.sqrt(plane[0] ** 2 + plane[1] ** 2 + plane[2] ** 2)
    plane[3] = -(plane[0] * c[0, 0] + plane[1] * c[0, 1] + plane[2] * c[0, 2])


@inner
def _hide(a, b, p, n, apex, plane, least, span):
    """Find the interval of a line that a convex polygon of n corners hides."""
    limit = np.zeros(4)
    span[0], span[1] = 0.0, 1.0
    side = plane[0] * apex[0] + plane[1] * apex[1] + plane[2] * apex[2] + plane[3] * apex[3]
    if side == 0.0:
        return False
    for j in range(4):
        limit[j] = -plane[j] if side > 0.0 else plane[j]
    _narrow(a, b, limit, least, span)
    for k in range(n):
        if span[1] <= span[0]:
            return False
        if _through(apex, p[k], p[(k + 1) % n], p[(k + 2) % n], limit):
            _narrow(a, b, limit, 0.0, span)
    return span[1] > span[0]


@borrowing
def _bound_line(a, b, matrix, limits):
    """Write half spaces around a line of the picture: its box, its strip."""
    ax = ay = aw = bx = by = bw = 0.0
    for j in range(3):
        ax += matrix[0, j] * a[j]
        ay += matrix[1, j] * a[j]
        aw += matrix[2, j] * a[j]
        bx += matrix[0, j] * b[j]
        by += matrix[1, j] * b[j]
        bw += matrix[2, j] * b[j]
    x0, y0 = (ax + matrix[0, 3]) / (aw + matrix[2, 3]), (ay + matrix[1, 3]) / (aw + matrix[2, 3])
    x1, y1 = (bx + matrix[0, 3]) / (bw + matrix[2, 3]), (by + matrix[1, 3]) / (bw + matrix[2, 3])
    dx, dy = y0 - y1, x1 - x0
    size = max(np.hypot(dx, dy), 1e-12)
    dx, dy = dx / size, dy / size
    for k, (u, v) in enumerate(((1.0, 0.0), (0.0, 1.0), (dx, dy))):
        start, end = u * x0 + v * y0, u * x1 + v * y1
        low, high = min(start, end) - _SHORT, max(start, end) + _SHORT
        for j in range(4):
            value = u * matrix[0, j] + v * matrix[1, j]
            limits[2 * k, j] = value - low * matrix[2, j]
            limits[2 * k + 1, j] = high * matrix[2, j] - value


@borrowing
def _misses(points, n, limits):
    """Return whether all points lie outside one of some half spaces."""
    for i in range(limits.shape[0]):
        is_out = True
        for k in range(n):
            value = limits[i, 3]
            for j in range(3):
                value += limits[i, j] * points[k, j]
            if value > 0.0:
                is_out = False
                break
        if is_out:
            return True
    return False


@kernel
def _find_clear(
    ends,
    own,
    own_sheet,
    triangles,
    sheet,
    is_there,
    matrix,
    apex,
    walls,
    tolerance,
    intervals,
    count,
):
    """Write the intervals of edges that nothing hides; return their number, room or not."""
    corners, region, boxes = triangles
    p, q = np.zeros((CORNERS, 3)), np.zeros((CORNERS, 3))
    limits, span, plane = np.zeros((6, 4)), np.zeros(2), np.zeros(4)
    hidden = np.zeros((_HIDDEN, 2))
    total = 0
    for e in range(ends.shape[0]):
        a, b = ends[e, 0], ends[e, 1]
        _bound_line(a, b, matrix, limits)
        n_hidden = 0
        for box in range(boxes.shape[0]):
            if misses(boxes[box], limits, 0.0):
                continue
            for f in range(box * BLOCK, min((box + 1) * BLOCK, corners.shape[0])):
                other = region[f]
                if not is_there[other] or _misses(corners[f], 3, limits):
                    continue
                copy_rows(corners[f], p)
                n = 3
                for i in range(walls.shape[0]):
                    n = clip_polygon(p, n, walls[i], q)
                    p, q = q, p
                    if n < 3:
                        break
                if n < 3:
                    continue
                _write_plane(corners[f], plane)
                # In the plane of an earlier region an edge is hidden, too.
                is_under = sheet[other] == own_sheet[e] and other < own[e]
                least = -2.0 * tolerance if is_under else tolerance
                if _hide(a, b, p, n, apex, plane, least, span):
                    if n_hidden == hidden.shape[0]:
                        more = np.zeros((2 * n_hidden, 2))
                        copy_rows(hidden, more)
                        hidden = more
                    hidden[n_hidden, 0], hidden[n_hidden, 1] = span[0], span[1]
                    n_hidden += 1
        order = np.argsort(hidden[:n_hidden, 0])
        clear, n_clear = 0.0, 0
        for k in range(n_hidden + 1):
            end = hidden[order[k], 0] if k < n_hidden else 1.0
            if end - clear > _TOUCH:
                if total < intervals.shape[0]:
                    intervals[total, 0], intervals[total, 1] = clear, end
                total += 1
                n_clear += 1
            if k < n_hidden:
                clear = max(clear, hidden[order[k], 1])
        count[e] = n_clear
    return total
