"""Counting any homogeneous polygons against a depth buffer: plain, for caps and for z-fail."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.rays.depth import bound
from umbra.volume.polygons import VolumePolygons

__all__ = ["count_polygons"]


def count_polygons(
    polygons: VolumePolygons,
    matrix: NDArray[np.float64],
    keys: NDArray[np.float64] | float,
    size: tuple[int, int],
    *,
    nearer: bool,
) -> NDArray[np.int32]:
    """
    Sum the multiplicities of polygons in front of a surface, or not in front of it.

    ``keys`` are the surface's depth keys, (rows, cols) or one for all; ``nearer`` counts where
    a polygon's key is greater, else where it is not (and the polygon is in front of the eye).
    Polygons that face the eye count + their multiplicity, others -.
    """
    cols, rows = size
    sums = np.zeros((rows, cols), np.int32)
    points = polygons.corners @ matrix.T
    surface = np.ascontiguousarray(np.broadcast_to(np.asarray(keys, np.float64), (rows, cols)))
    _count(points, polygons.multiplicity, surface, nearer, sums)
    return sums


@njit(cache=True, nogil=True)
def _cross(p, q, out):
    out[0] = p[1] * q[2] - p[2] * q[1]
    out[1] = p[2] * q[0] - p[0] * q[2]
    out[2] = p[0] * q[1] - p[1] * q[0]


@njit(cache=True, nogil=True)
def _plane_of(p, slope):
    """Find the key's functional on a polygon's plane; return the doubled signed area."""
    u = np.empty(4)
    v = np.empty(4)
    part = np.empty((3, 3))
    best = 0.0
    # Corners may coincide at infinity: take the corner whose triangle is largest.
    for k in range(2, p.shape[0]):
        for j in range(4):
            u[j] = p[1, j] - p[0, j]
            v[j] = p[k, j] - p[0, j]
        _cross(u, v, part[0])
        _cross(v, p[0], part[1])
        _cross(p[0], u, part[2])
        det = p[0, 0] * part[0, 0] + p[0, 1] * part[0, 1] + p[0, 2] * part[0, 2]
        if abs(det) > abs(best):
            best = det
            for j in range(3):
                slope[j] = (p[0, 3] * part[0, j] + u[3] * part[1, j] + v[3] * part[2, j]) / det
    return best


@njit(cache=True, nogil=True)
def _count(points, multiplicity, surface, nearer, sums):
    rows, cols = sums.shape
    n = points.shape[1]
    line = np.empty(3)
    left = np.empty((4, 2))
    right = np.empty((4, 2))
    slope = np.empty(3)
    span = np.empty(2)
    for q in range(points.shape[0]):
        p = points[q]
        det = _plane_of(p, slope)
        if det == 0.0:
            continue
        sign = 1.0 if det > 0.0 else -1.0
        span[0] = 0.0
        span[1] = np.float64(rows)
        left[:, 0] = -1e9
        right[:, 0] = 1e9
        left[:, 1] = right[:, 1] = 0.0
        for k in range(n):
            _cross(p[k], p[(k + 1) % n], line)
            bound(line[0], line[1], line[2], sign, left[k], right[k], span)
        m = multiplicity[q] if sign < 0.0 else -multiplicity[q]
        for r in range(np.int64(max(span[0], 0.0)), np.int64(min(span[1], np.float64(rows)))):
            y = np.float64(r)
            x0 = -1e9
            x1 = 1e9
            for k in range(n):
                x0 = max(x0, left[k, 0] + left[k, 1] * y)
                x1 = min(x1, right[k, 0] + right[k, 1] * y)
            for c in range(
                np.int64(np.ceil(min(max(x0, 0.0), np.float64(cols)))),
                np.int64(np.ceil(min(max(x1, 0.0), np.float64(cols)))),
            ):
                key = slope[0] * c + slope[1] * y + slope[2]
                if (key > surface[r, c]) == nearer:
                    sums[r, c] += m
