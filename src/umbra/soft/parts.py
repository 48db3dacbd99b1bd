"""
The part of a light that an edge hides, as seen by a receiver.

Computed on the light's plane as seen by a receiver P, with the light's centre o at 0 and the light
as the unit disc or the square [-1, 1]². An edge projects to (a, b). Q is the light's area within
the angle a o b and beyond the line ab; s is +1 where the edge runs counter-clockwise about o, seen
from behind the light, else -1.

Akenine-Möller and Assarsson 2002; Assarsson and Akenine-Möller 2003. The closed forms
are ours: they are exact, where the papers look them up in textures.
"""

import numpy as np

from umbra.kernels import copy_rows, kernel

__all__ = ["find_disc_part", "find_signed_part", "find_square_part", "place_axes", "project_edge"]

_NEAREST = 1e-9  # of the distance to the light: nearer edges touch the receiver
_AT_MIDDLE = 1e-6  # of the light's radius: an edge this near the centre is on both sides


@kernel
def place_axes(x, y, z, light, radius, is_square, axes, out):
    """
    Write the axes of the light's plane for a receiver; False if it lies in the plane or light.

    ``out`` becomes three rows: u and v, which map the plane to the unit light, and the vector to
    the light over its squared length, which yields the fraction of the distance to it.
    """
    if light[3] == 0.0:
        copy_rows(axes, out)
        return True
    wx, wy, wz = light[0] - x, light[1] - y, light[2] - z
    if is_square:
        depth = axes[2, 0] * wx + axes[2, 1] * wy + axes[2, 2] * wz
        if abs(depth) <= 1e-9 * radius:
            return False
        copy_rows(axes, out)
        out[2] /= depth
        if depth < 0.0:
            out[1] *= -1.0  # from the back, the light is mirrored
        return True
    depth = wx * wx + wy * wy + wz * wz
    if depth <= radius * radius * (1.0 + 1e-9):
        return False
    # The ball appears as the disc in which its tangents from P meet its plane.
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


@kernel
def project_edge(v, x, y, z, light, axes):
    """
    Project the part of an edge (6,) between a receiver and the light to the light's plane.

    Returns whether there is such a part, and its projected ends: ax, ay, bx, by. ``axes`` come from
    ``place_axes`` for the receiver.
    """
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
        return False, 0.0, 0.0, 0.0, 0.0
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
    return True, ax, ay, bx, by


@kernel
def find_signed_part(ax, ay, bx, by, is_square, scratch_a, scratch_b):
    """Return s Q / area of a projected edge, and whether it passes the light's centre."""
    cross = ax * by - ay * bx
    length = np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    is_unsure = False
    if abs(cross) <= _AT_MIDDLE * length:
        # The line passes the centre within rounding: unsure if the centre is between the ends.
        slack = _AT_MIDDLE * length
        is_unsure = (
            ax * (bx - ax) + ay * (by - ay) <= slack and bx * (bx - ax) + by * (by - ay) >= -slack
        )
    part = (
        find_square_part(ax, ay, bx, by, scratch_a, scratch_b)
        if is_square
        else find_disc_part(ax, ay, bx, by)
    )
    return (part if cross > 0.0 else -part), is_unsure


@kernel
def find_disc_part(ax, ay, bx, by):
    """
    Find Q / area, 0 to 1/2, for a disc; the edge (a, b) in radii about its centre.

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


@kernel
def _clip(corners, n, fx, fy, f0, out):
    """Clip a convex polygon to fx x + fy y + f0 >= 0; return its number of corners."""
    n_out = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        here = fx * corners[i, 0] + fy * corners[i, 1] + f0
        there = fx * corners[j, 0] + fy * corners[j, 1] + f0
        if here >= 0.0:
            out[n_out, 0] = corners[i, 0]
            out[n_out, 1] = corners[i, 1]
            n_out += 1
        if (here >= 0.0) != (there >= 0.0):
            t = here / (here - there)
            out[n_out, 0] = corners[i, 0] + t * (corners[j, 0] - corners[i, 0])
            out[n_out, 1] = corners[i, 1] + t * (corners[j, 1] - corners[i, 1])
            n_out += 1
    return n_out


@kernel
def find_square_part(ax, ay, bx, by, scratch_a, scratch_b):
    """Find Q / area for the square [-1, 1]²; ``scratch_a`` and ``scratch_b`` (8, 2) are scratch."""
    cross = ax * by - ay * bx
    if cross == 0.0:
        return 0.0
    side = 1.0 if cross > 0.0 else -1.0
    # Beyond the line: side * ((b - a) x (p - a)) <= 0.
    fx, fy, f0 = side * (by - ay), side * (ax - bx), -side * cross
    if abs(fx) + abs(fy) + f0 <= 0.0:
        return 0.0
    scratch_a[0, 0], scratch_a[0, 1] = -1.0, -1.0
    scratch_a[1, 0], scratch_a[1, 1] = 1.0, -1.0
    scratch_a[2, 0], scratch_a[2, 1] = 1.0, 1.0
    scratch_a[3, 0], scratch_a[3, 1] = -1.0, 1.0
    n = _clip(scratch_a, 4, fx, fy, f0, scratch_b)
    n = _clip(scratch_b, n, -side * ay, side * ax, 0.0, scratch_a)
    n = _clip(scratch_a, n, side * by, -side * bx, 0.0, scratch_b)
    area = 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        area += scratch_b[i, 0] * scratch_b[j, 1] - scratch_b[i, 1] * scratch_b[j, 0]
    return 0.125 * abs(area)
