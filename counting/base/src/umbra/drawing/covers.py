"""
What lies between a planar region and a source of rays, projected onto the region as seen.

The source is the eye or a light. A triangle between it and the region's plane covers a polygon of
that plane; here as a convex polygon of the picture, in pixels. Everything is linear in homogeneous
coordinates: a point v of a caster is projected from L onto the plane n at (n.L) v - (n.v) L (the
matrix of planar shadows), and from there to the picture by the camera's matrix. So each limit (the
plane, the picture's frame, a lamp's own height) is a half space of v, blocks of triangles outside
one are skipped, and triangles are cut at it before they are divided by w.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, copy_rows, inner, kernel
from umbra.volume.adjacency import sort_along_curve

__all__ = [
    "BLOCK", "CORNERS", "CoverTriangles", "Covers", "clip_polygon", "cut_triangles", "find_limits",
    "misses",
]  # fmt: skip

BLOCK = 32
"""Triangles in a block."""
CORNERS = 24
"""Most corners of a cut triangle."""
_ROOM = 64  # polygons for which there is room at first
_MARGIN = 0.5  # around a region, so that rounding at its frame does not matter [pixels]
_WHOLE = 1 - 1e-9  # share of a frame that is all of it


@dataclass(frozen=True, eq=False)
class CoverTriangles:
    """Triangles in blocks that are near one another: corners, regions, and boxes of the blocks."""

    corners: NDArray[np.float64]
    region: NDArray[np.intp]
    boxes: NDArray[np.float64]  # (n_blocks, 6): middle and half size

    @classmethod
    def of(cls, corners: NDArray[np.float64], region: NDArray[np.intp]) -> "CoverTriangles":
        """Sort (n, 3, 3) corners into blocks."""
        order = sort_along_curve(corners.mean(1)) if len(corners) else np.zeros(0, np.intp)
        corners = np.ascontiguousarray(corners[order])
        firsts = np.arange(0, len(corners), BLOCK)
        if not len(firsts):
            return cls(corners, region, np.zeros((0, 6)))
        low = np.minimum.reduceat(corners.min(1), firsts)
        high = np.maximum.reduceat(corners.max(1), firsts)
        boxes = np.column_stack([(low + high) / 2, (high - low) / 2])
        return cls(corners, np.ascontiguousarray(region[order]), boxes)


class Covers:
    """
    Finder of what covers regions, with room for its results.

    Parameters
    ----------
    triangles : CoverTriangles
    sheet : (n_regions,) intp
        Plane of each region, as in ``PlanarRegions``.

    Attributes
    ----------
    is_there : (n_regions,) bool
        Regions that may cover others.
    """

    def __init__(self, triangles: CoverTriangles, sheet: NDArray[np.intp]) -> None:
        self.triangles, self.sheet = triangles, sheet
        self.is_there = np.ones(len(sheet), np.bool_)
        self._points = np.zeros((_ROOM * 8, 2))
        self._ends, self._areas = np.zeros(_ROOM, np.int64), np.zeros(_ROOM)

    def find(
        self,
        subject: NDArray[np.float64],
        matrix: NDArray[np.float64],
        walls: NDArray[np.float64],
        own: int,
        tolerance: float,
        *,
        hides_below: bool,
    ) -> tuple[list[NDArray[np.float64]], NDArray[np.float64], bool]:
        """
        Find the polygons of the picture that may cover part of a region.

        Parameters
        ----------
        subject : (n, 2) float64
            Corners of the part [pixels].
        matrix : (3, 4) float64
            From the world to the picture, through the region's plane.
        walls : (m, 4) float64
            Half spaces to which triangles are cut; the first is the near side of the plane.
        own : int
            The region.
        tolerance : float
            Within which a point lies in the plane [m].
        hides_below : bool
            Whether triangles of earlier regions in the same plane cover the region.

        Returns
        -------
        polygons : list of (k, 2) float64
            Counter-clockwise.
        areas : (n_polygons,) float64
        is_whole : bool
            Whether one polygon covers all of the part; then no others are returned.
        """
        t = self.triangles
        while True:
            count, points, is_whole = _find_covers(
                (t.corners, t.region, t.boxes), self.sheet, self.is_there, matrix, walls, subject,
                own, tolerance, hides_below, (self._points, self._ends, self._areas),
            )  # fmt: skip
            if count <= len(self._ends) and points <= len(self._points):
                break
            self._ends = np.zeros(max(2 * count, len(self._ends)), np.int64)
            self._areas = np.zeros(len(self._ends))
            self._points = np.zeros((max(2 * points, len(self._points)), 2))
        polygons = _split(self._points[:points].copy(), self._ends[:count])
        return polygons, self._areas[:count].copy(), bool(is_whole)


def cut_triangles(
    corners: NDArray[np.float64], matrix: NDArray[np.float64], limits: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Cut triangles (n, 3, 3) to half spaces and project them, each to a polygon (k, 2)."""
    points = np.zeros((len(corners) * CORNERS, 2))
    ends = np.zeros(len(corners), np.int64)
    count, used = _cut_all(corners, matrix, limits, points, ends)
    return _split(points[:used], ends[:count])


def _split(points: NDArray[np.float64], ends: NDArray[np.int64]) -> list[NDArray[np.float64]]:
    """Split rows at some ends; several times as fast as ``np.split``."""
    last = ends.tolist()
    return [points[first:end] for first, end in zip([0, *last], last, strict=False)]


def find_limits(
    matrix: NDArray[np.float64], frame: tuple[float, float, float, float]
) -> NDArray[np.float64]:
    """Return the half spaces (4, 4) of a frame (left, top, right, bottom) of the picture."""
    x, y, w = matrix
    left, top, right, bottom = frame
    return np.stack([x - left * w, right * w - x, y - top * w, bottom * w - y])


@borrowing
def clip_polygon(p, n, limit, q):
    """
    Cut a polygon ``p`` of n corners to a half space, into ``q``; return the number of corners.

    An edge is cut from its inner to its outer end, so that both faces of an edge are cut in the
    same place.
    """
    m = 0
    before = n - 1
    last = limit[0] * p[before, 0] + limit[1] * p[before, 1] + limit[2] * p[before, 2] + limit[3]
    for k in range(n):
        here = limit[0] * p[k, 0] + limit[1] * p[k, 1] + limit[2] * p[k, 2] + limit[3]
        if (here > 0.0 and last < 0.0) or (here < 0.0 and last > 0.0):
            i, j, a, b = (k, before, here, last) if here > 0.0 else (before, k, last, here)
            share = a / (a - b)
            for c in range(3):
                q[m, c] = p[i, c] + share * (p[j, c] - p[i, c])
            m += 1
        if here >= 0.0:
            for c in range(3):
                q[m, c] = p[k, c]
            m += 1
        before, last = k, here
    return m


@borrowing
def _project(p, n, matrix, points, at):
    """Project a polygon from row ``at`` of ``points`` on, counter-clockwise; return its area."""
    for k in range(n):
        w = matrix[2, 0] * p[k, 0] + matrix[2, 1] * p[k, 1] + matrix[2, 2] * p[k, 2] + matrix[2, 3]
        if w <= 0.0:
            return 0.0
        for c in range(2):
            value = matrix[c, 3]
            for j in range(3):
                value += matrix[c, j] * p[k, j]
            points[at + k, c] = value / w
    area = 0.0
    x0, y0 = points[at, 0], points[at, 1]
    for k in range(1, n - 1):
        area += (points[at + k, 0] - x0) * (points[at + k + 1, 1] - y0)
        area -= (points[at + k, 1] - y0) * (points[at + k + 1, 0] - x0)
    if area < 0.0:
        for k in range(n // 2):
            for c in range(2):
                a, b = points[at + k, c], points[at + n - 1 - k, c]
                points[at + k, c], points[at + n - 1 - k, c] = b, a
    return abs(area) / 2


@inner
def _cut(corners, f, limits, first, end, p, q):
    """Cut a triangle to some half spaces; return the number of corners left, they and scratch."""
    copy_rows(corners[f], p)
    n = 3
    for i in range(first, end):
        n = clip_polygon(p, n, limits[i], q)
        p, q = q, p
        if n < 3:
            break
    return n, p, q


@kernel
def _cut_all(corners, matrix, limits, points, ends):
    p, q = np.zeros((CORNERS, 3)), np.zeros((CORNERS, 3))
    count = used = 0
    for f in range(corners.shape[0]):
        n, p, q = _cut(corners, f, limits, 0, limits.shape[0], p, q)
        if n < 3:
            continue
        if _project(p, n, matrix, points, used) > 0.0:
            used += n
            ends[count] = used
            count += 1
    return count, used


@borrowing
def _is_outside(corners, f, limit, least):
    """Return whether all corners of a triangle are at most ``least`` inside a half space."""
    for k in range(3):
        value = limit[3]
        for j in range(3):
            value += limit[j] * corners[f, k, j]
        if value > least:
            return False
    return True


@inner
def _enclose(subject, matrix, walls, limits):
    """
    Write the half spaces around a subject; return the area of its frame.

    After the walls come the four sides of its frame, then four diagonal ones, which only tell what
    to skip.
    """
    n = walls.shape[0]
    copy_rows(walls, limits)
    area = 1.0
    for k, (a, b) in enumerate(((1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, -1.0))):
        low, high = np.inf, -np.inf
        for i in range(subject.shape[0]):
            value = a * subject[i, 0] + b * subject[i, 1]
            low, high = min(low, value), max(high, value)
        if k < 2:
            low, high = low - _MARGIN, high + _MARGIN
            area *= high - low
        for j in range(4):
            value = a * matrix[0, j] + b * matrix[1, j]
            limits[n + 2 * k, j] = value - low * matrix[2, j]
            limits[n + 2 * k + 1, j] = high * matrix[2, j] - value
    return area


@borrowing
def misses(box, limits, least):
    """Return whether a box lies outside one of some half spaces, ``least`` inside the first."""
    for i in range(limits.shape[0]):
        most = limits[i, 3]
        for j in range(3):
            most += limits[i, j] * box[j] + abs(limits[i, j]) * box[3 + j]
        if most < (least if i == 0 else 0.0):
            return True
    return False


@kernel
def _find_covers(
    triangles, sheet, is_there, matrix, walls, subject, own, tolerance, hides_below, room
):
    """
    Write polygons while there is room.

    Returns how many there are, how many corners they have, and whether one is all.
    """
    corners, region, boxes = triangles
    points, ends, areas = room
    p, q = np.zeros((CORNERS, 3)), np.zeros((CORNERS, 3))
    spare = np.zeros((CORNERS, 2))
    limits = np.zeros((walls.shape[0] + 8, 4))
    whole = _WHOLE * _enclose(subject, matrix, walls, limits)
    cuts = walls.shape[0] + 4
    count = used = 0
    least = -tolerance if hides_below else tolerance
    for block in range(boxes.shape[0]):
        if misses(boxes[block], limits, least):
            continue
        for f in range(block * BLOCK, min((block + 1) * BLOCK, corners.shape[0])):
            other = region[f]
            if not is_there[other]:
                continue
            first = 0
            if sheet[other] == sheet[own]:
                # In the same plane: an earlier region is in front.
                if not hides_below or other >= own:
                    continue
                first = 1
            elif _is_outside(corners, f, limits[0], 0.0):
                continue
            is_out = False
            for i in range(1, limits.shape[0]):
                if _is_outside(corners, f, limits[i], 0.0):
                    is_out = True
                    break
            if is_out:
                continue
            n, p, q = _cut(corners, f, limits, first, cuts, p, q)
            if n < 3:
                continue
            has_room = count < ends.size and used + n <= points.shape[0]
            area = _project(p, n, matrix, points if has_room else spare, used if has_room else 0)
            if area >= whole:
                return 0, 0, True
            if area > 0.0:
                used += n
                if count < ends.size:
                    ends[count] = used
                    areas[count] = area
                count += 1
    return count, used, False
