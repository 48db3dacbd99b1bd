"""
Kernel of penumbra wedges: what silhouette edges take from, or add to, a hard count.

Everything happens on the light's plane as a receiver P sees it, the light's middle o
being 0 and the light the unit disc or the square [-1, 1]². An edge projects to (a, b).
Q is the light's area within the angle a o b and beyond the line ab; s is +1 where the
edge runs counter-clockwise about o, seen from behind the light, else -1. Then

    coverage = hard count - sum of s Q multiplicity / area of the light.

An edge matters only to receivers in its penumbra wedge, which four planes bound.

Akenine-Möller and Assarsson 2002; Assarsson and Akenine-Möller 2003. The closed forms
are ours: they are exact, where the papers look them up in textures.
"""

import numpy as np
from numba import njit, prange

__all__ = ["TILE", "add_wedges", "find_disc_part", "find_square_part", "is_in", "make_planes"]


@njit(cache=True, nogil=True)
def make_planes(ends, light, radius, planes):
    """
    Bound the penumbra wedge of each edge by four planes.

    Two hold the edge, two an end of it, and all touch the sphere of the light. With y
    on the edge, x in the light and P behind y, all have n·(P - y) <= 0.

    Parameters
    ----------
    ends : (n, 6) float64
        Edges, in the light's frame [m].
    light : (4,) float64
        Middle of the light; for w = 0 of length 1.
    radius : float
        Of the sphere [m]; tangent of the angle of a disc in the sky.
    planes : (n, 4, 4) float64
        Written: unit normals, outward, and offsets; 0 where the edge's line meets the sphere.
    """
    e = np.empty(3)
    t = np.empty(3)
    a = np.empty(3)
    b = np.empty(3)
    is_point = light[3] > 0.0
    far_sine = radius / np.sqrt(1.0 + radius * radius)
    for i in range(ends.shape[0]):
        length = 0.0
        for k in range(3):
            t[k] = ends[i, k + 3] - ends[i, k]
            length += t[k] * t[k]
        length = np.sqrt(length)
        planes[i] = 0.0
        if length == 0.0:
            continue
        along = 0.0
        for k in range(3):
            t[k] /= length
            e[k] = light[k] - ends[i, k] if is_point else light[k]
            along += t[k] * e[k]
        apart = 0.0
        for k in range(3):
            e[k] -= along * t[k]
            apart += e[k] * e[k]
        apart = np.sqrt(apart)
        limit = radius if is_point else far_sine
        if apart <= limit * 1.0001:
            continue
        sine = limit / apart
        cosine = np.sqrt(1.0 - sine * sine)
        for k in range(3):
            e[k] /= apart
        b[0] = t[1] * e[2] - t[2] * e[1]
        b[1] = t[2] * e[0] - t[0] * e[2]
        b[2] = t[0] * e[1] - t[1] * e[0]
        for k in range(3):
            planes[i, 0, k] = cosine * b[k] + sine * e[k]
            planes[i, 1, k] = -cosine * b[k] + sine * e[k]
        for end in range(2):
            away = 0.0
            inward = 1.0 - 2.0 * end
            for k in range(3):
                a[k] = light[k] - ends[i, 3 * end + k] if is_point else light[k]
                away += a[k] * a[k]
            away = np.sqrt(away)
            along = 0.0
            for k in range(3):
                a[k] /= away
                along += a[k] * t[k] * inward
            sine = radius / away if is_point else far_sine
            cosine = np.sqrt(1.0 - sine * sine)
            across = np.sqrt(max(1.0 - along * along, 0.0))
            for k in range(3):
                # The part of the edge's way inward that is across the way to the light.
                planes[i, 2 + end, k] = (
                    sine * a[k] - cosine * (t[k] * inward - along * a[k]) / across
                )
        for p in range(4):
            first = 3 if p == 3 else 0
            for k in range(3):
                planes[i, p, 3] -= planes[i, p, k] * ends[i, first + k]


@njit(cache=True, nogil=True)
def is_in(planes, x, y, z, margin):
    """Whether a place is in a wedge of ``make_planes``, or within a margin of it."""
    for k in range(4):
        p = planes[k]
        if p[0] * x + p[1] * y + p[2] * z + p[3] > margin:
            return False
    return True


@njit(cache=True, nogil=True)
def find_disc_part(ax, ay, bx, by):
    """
    Find Q / area, 0 to 1/2, for a disc; the edge (a, b) in radii about its middle.

    Where the line ab runs inside the disc, between the angles t0 and t1 from its foot
    at the distance d: Q = (atan t1/d - atan t0/d) / 2 - d (t1 - t0) / 2.
    """
    wx, wy = bx - ax, by - ay
    length = np.sqrt(wx * wx + wy * wy)
    if length == 0.0:
        return 0.0
    wx /= length
    wy /= length
    d = abs(ax * wy - ay * wx)
    if d >= 1.0:
        return 0.0
    half = np.sqrt(1.0 - d * d)
    t0 = max(ax * wx + ay * wy, -half)
    t1 = min(bx * wx + by * wy, half)
    if t0 >= t1:
        return 0.0
    return 0.5 * (np.arctan2(t1, d) - np.arctan2(t0, d) - d * (t1 - t0)) / np.pi


@njit(cache=True, nogil=True)
def _clip(corners, n, fx, fy, f0, out):
    """Keep the part of a convex polygon where fx x + fy y + f0 >= 0; give its corners."""
    kept = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        here = fx * corners[i, 0] + fy * corners[i, 1] + f0
        there = fx * corners[j, 0] + fy * corners[j, 1] + f0
        if here >= 0.0:
            out[kept, 0] = corners[i, 0]
            out[kept, 1] = corners[i, 1]
            kept += 1
        if (here >= 0.0) != (there >= 0.0):
            t = here / (here - there)
            out[kept, 0] = corners[i, 0] + t * (corners[j, 0] - corners[i, 0])
            out[kept, 1] = corners[i, 1] + t * (corners[j, 1] - corners[i, 1])
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def find_square_part(ax, ay, bx, by, one, two):
    """Find Q / area for the square [-1, 1]²; ``one`` and ``two`` (8, 2) are room to work in."""
    cross = ax * by - ay * bx
    if cross == 0.0:
        return 0.0
    side = 1.0 if cross > 0.0 else -1.0
    # Beyond the line: side * ((b - a) x (p - a)) <= 0.
    fx, fy, f0 = side * (by - ay), side * (ax - bx), -side * cross
    if abs(fx) + abs(fy) + f0 <= 0.0:
        return 0.0
    one[0, 0], one[0, 1] = -1.0, -1.0
    one[1, 0], one[1, 1] = 1.0, -1.0
    one[2, 0], one[2, 1] = 1.0, 1.0
    one[3, 0], one[3, 1] = -1.0, 1.0
    n = _clip(one, 4, fx, fy, f0, two)
    n = _clip(two, n, -side * ay, side * ax, 0.0, one)
    n = _clip(one, n, side * by, -side * bx, 0.0, two)
    area = 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        area += two[i, 0] * two[j, 1] - two[i, 1] * two[j, 0]
    return 0.125 * abs(area)


TILE = 8
"""Pixels on a side of the squares for which a wedge is tried once."""
_NEAREST = 1e-9  # of the way to the light: nearer edges touch the receiver
_AT_MIDDLE = 1e-6  # of the light's radius: an edge so near its middle is on both sides


@njit(cache=True, nogil=True)
def _place_axes(x, y, z, light, radius, is_square, axes, out):
    """
    Write the axes of the light's plane for a receiver; False if it is in that plane or light.

    ``out`` becomes three rows: u and v, which map the plane to the unit light, and the way
    to the light over its square length, which gives the part of the way to it.
    """
    if light[3] == 0.0:
        out[:] = axes
        return True
    wx, wy, wz = light[0] - x, light[1] - y, light[2] - z
    if is_square:
        depth = axes[2, 0] * wx + axes[2, 1] * wy + axes[2, 2] * wz
        if abs(depth) <= 1e-9 * radius:
            return False
        out[:] = axes
        out[2] /= depth
        if depth < 0.0:
            out[1] *= -1.0  # seen from its other side, the light is mirrored
        return True
    depth = wx * wx + wy * wy + wz * wz
    if depth <= radius * radius * (1.0 + 1e-9):
        return False
    # What is seen of the ball is the disc where its tangents from P meet its plane.
    apparent = radius * np.sqrt(depth / (depth - radius * radius))
    away = np.sqrt(depth)
    nx, ny, nz = wx / away, wy / away, wz / away
    if abs(nz) < 0.9:
        length = apparent * np.sqrt(nx * nx + ny * ny)
        ux, uy, uz = -ny / length, nx / length, 0.0
    else:
        length = apparent * np.sqrt(ny * ny + nz * nz)
        ux, uy, uz = 0.0, -nz / length, ny / length
    out[0, 0], out[0, 1], out[0, 2] = ux, uy, uz
    out[1, 0], out[1, 1], out[1, 2] = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
    out[2, 0], out[2, 1], out[2, 2] = wx / depth, wy / depth, wz / depth
    return True


@njit(cache=True, nogil=True)
def _find_signed_part(v, x, y, z, light, is_square, axes, one, two):
    """Return s Q / area of one edge for one receiver, and whether it runs through the middle."""
    u0 = u1 = v0 = v1 = d0 = d1 = mx = my = 0.0
    is_point = light[3] > 0.0
    for k in range(3):
        p = x if k == 0 else (y if k == 1 else z)
        w0, w1 = v[k] - p, v[k + 3] - p
        u0 += axes[0, k] * w0
        u1 += axes[0, k] * w1
        v0 += axes[1, k] * w0
        v1 += axes[1, k] * w1
        d0 += axes[2, k] * w0
        d1 += axes[2, k] * w1
        way = light[k] - p if is_point else light[k]
        mx += axes[0, k] * way
        my += axes[1, k] * way
    # Clip strictly between the receiver and the light.
    limit = 1.0 if is_point else np.inf
    if max(d0, d1) <= _NEAREST or min(d0, d1) >= limit:
        return 0.0, False
    r0, r1 = 0.0, 1.0
    step = d1 - d0
    if d0 < _NEAREST:
        r0 = (_NEAREST - d0) / step
    if d1 < _NEAREST:
        r1 = (_NEAREST - d0) / step
    if d0 > limit:
        r0 = (limit - d0) / step
    if d1 > limit:
        r1 = (limit - d0) / step
    e0 = max(d0 + r0 * step, _NEAREST)
    e1 = max(d0 + r1 * step, _NEAREST)
    ax = (u0 + r0 * (u1 - u0)) / e0 - mx
    ay = (v0 + r0 * (v1 - v0)) / e0 - my
    bx = (u0 + r1 * (u1 - u0)) / e1 - mx
    by = (v0 + r1 * (v1 - v0)) / e1 - my
    cross = ax * by - ay * bx
    length = np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    is_unsure = False
    if abs(cross) <= _AT_MIDDLE * length:
        # Within rounding of the middle's line: unsure if the middle is between the ends.
        slack = _AT_MIDDLE * length
        is_unsure = (
            ax * (bx - ax) + ay * (by - ay) <= slack and bx * (bx - ax) + by * (by - ay) >= -slack
        )
    part = (
        find_square_part(ax, ay, bx, by, one, two) if is_square else find_disc_part(ax, ay, bx, by)
    )
    return (part if cross > 0.0 else -part), is_unsure


@njit(cache=True, nogil=True, parallel=True)
def add_wedges(
    position,
    origin,
    seen,
    ends,
    multiplicity,
    planes,
    light,
    radius,
    is_square,
    axes,
    cover,
    unsure,
):
    """
    Sum s Q multiplicity / area over the silhouette edges, for each visible point.

    Parameters
    ----------
    position : (rows, cols, 3) float64
        In the model's own coordinates [m].
    origin : (3,) float64
        Of the frame of edges and light, in those coordinates.
    seen : (rows, cols) bool
        Where to look.
    ends : (n, 6) float64
        Silhouette edges, wound as in the lit faces.
    multiplicity : (n,) int64
    planes : (n, 4, 4) float64
        Of ``make_planes``.
    light : (4,) float64
    radius : float
    is_square : bool
        Whether the light is a parallelogram.
    axes : (3, 3) float64
        Rows u, v and the normal of its plane, or of the plane of a disc in the sky: u
        and v map the plane to the unit light.
    cover : (rows, cols) float64
        Added to.
    unsure : (rows, cols) bool
        Set where an edge hides the light's middle within rounding, so that the hard
        count may stand on the other side.
    """
    rows, cols = seen.shape
    down = (rows + TILE - 1) // TILE
    across = (cols + TILE - 1) // TILE
    for tile in prange(down * across):
        top = (tile // across) * TILE
        left = (tile % across) * TILE
        bottom = min(top + TILE, rows)
        right = min(left + TILE, cols)
        low = np.full(3, np.inf)
        high = np.full(3, -np.inf)
        for r in range(top, bottom):
            for c in range(left, right):
                if seen[r, c]:
                    for k in range(3):
                        low[k] = min(low[k], position[r, c, k] - origin[k])
                        high[k] = max(high[k], position[r, c, k] - origin[k])
        if not low[0] <= high[0]:
            continue
        reach = 0.5 * np.sqrt(
            (high[0] - low[0]) ** 2 + (high[1] - low[1]) ** 2 + (high[2] - low[2]) ** 2
        )
        slack = 1e-9 * (1.0 + np.abs(low).max() + np.abs(high).max())
        middle = 0.5 * (low + high)
        found = np.empty(ends.shape[0], np.int64)
        n_found = 0
        for e in range(ends.shape[0]):
            if is_in(planes[e], middle[0], middle[1], middle[2], reach + slack):
                found[n_found] = e
                n_found += 1
        if n_found == 0:
            continue
        own = np.empty((3, 3))
        one = np.empty((8, 2))
        two = np.empty((8, 2))
        for r in range(top, bottom):
            for c in range(left, right):
                if not seen[r, c]:
                    continue
                x = position[r, c, 0] - origin[0]
                y = position[r, c, 1] - origin[1]
                z = position[r, c, 2] - origin[2]
                if not _place_axes(x, y, z, light, radius, is_square, axes, own):
                    continue
                total = 0.0
                for i in range(n_found):
                    e = found[i]
                    if not is_in(planes[e], x, y, z, slack):
                        continue
                    part, at_middle = _find_signed_part(
                        ends[e], x, y, z, light, is_square, own, one, two
                    )
                    total += multiplicity[e] * part
                    unsure[r, c] |= at_middle
                cover[r, c] += total
