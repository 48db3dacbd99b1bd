"""
Opacity of textured triangles, and the light that they transmit along rays.

Rows, materials, texels and the rule are those of `umbra.rays.transmission.Transmitters`.
"""

import numpy as np

from umbra.kernels import cross, dot, kernel, take_next
from umbra.scene.material import find_linear

__all__ = [
    "BLEND",
    "BLOCK",
    "HIGH",
    "LEVELS",
    "MASK",
    "find_cover",
    "find_opacities",
    "trace_light",
]

MASK, BLEND = 1.0, 2.0
HIGH = 4096  # splits a texel's index so that float32 holds both parts exactly
LEVELS = 256

_TINY = 1e-200
_ASIDE = (0.61, 0.57, 0.33)
BLOCK = 256  # points per block of a thread
_LINEAR = find_linear(np.arange(LEVELS) / (LEVELS - 1))


@kernel
def _find_texels(at, count, how):
    """Find the texels on both sides of a coordinate, and the weight of the second."""
    position = at * count - 0.5
    first = np.floor(position)
    share = position - first
    left, right = np.int64(first), np.int64(first) + 1
    if how == 2:  # clamp
        left = min(max(left, 0), count - 1)
        right = min(max(right, 0), count - 1)
    elif how == 0:  # repeat
        left = left % count
        right = right % count
    else:  # mirror
        left = left % (2 * count)
        right = right % (2 * count)
        left = min(left, 2 * count - 1 - left)
        right = min(right, 2 * count - 1 - right)
    return left, right, share


@kernel
def find_cover(f, w0, w1, w2, rows, materials, texels, color):
    """
    Find a triangle's opacity at barycentric weights, 0 in a hole; write its colour.

    The opacity is exactly 1 where no light passes.
    """
    row = rows[f]
    look = materials[np.int64(row[7])]
    for k in range(3):
        color[k] = look[k] * (w0 * row[20 + k] + w1 * row[24 + k] + w2 * row[28 + k])
    level = 255.0
    cols = np.int64(look[8])
    if cols > 0:
        u = w0 * row[12] + w1 * row[14] + w2 * row[16]
        v = w0 * row[13] + w1 * row[15] + w2 * row[17]
        left, right, along = _find_texels(u, cols, np.int64(look[10]))
        above, below, down = _find_texels(v, np.int64(look[9]), np.int64(look[11]))
        start = np.int64(look[6]) * HIGH + np.int64(look[7])
        a, b = texels[start + above * cols + left], texels[start + above * cols + right]
        c, d = texels[start + below * cols + left], texels[start + below * cols + right]
        # Between equal levels this returns the level itself, bit for bit.
        upper = np.float64(a[3]) + along * (np.float64(b[3]) - np.float64(a[3]))
        lower = np.float64(c[3]) + along * (np.float64(d[3]) - np.float64(c[3]))
        level = upper + down * (lower - upper)
        for k in range(3):
            high = _LINEAR[a[k]] + along * (_LINEAR[b[k]] - _LINEAR[a[k]])
            low = _LINEAR[c[k]] + along * (_LINEAR[d[k]] - _LINEAR[c[k]])
            color[k] *= high + down * (low - high)
    # Between equal opacities, too.
    level *= row[23] + w1 * (row[27] - row[23]) + w2 * (row[31] - row[23])
    if look[4] == MASK:
        return look[3] if level >= look[5] else 0.0
    if look[4] == BLEND:
        return 1.0 - (255.0 - look[3] * level) / 255.0
    return look[3]


@kernel
def _invert(x):
    """Return 1 / x, or a large finite number for 0, so that no box's corner makes NaN."""
    if abs(x) < _TINY:
        return 1.0 / _TINY if x >= 0.0 else -1.0 / _TINY
    return 1.0 / x


@kernel
def _cross(f, p, light, way, tolerance, rows, weights):
    """Return whether the ray from p along ``way`` to the light crosses a triangle; write where."""
    row = rows[f]
    ux, uy, uz = row[4] - row[0], row[5] - row[1], row[6] - row[2]
    vx, vy, vz = row[8] - row[0], row[9] - row[1], row[10] - row[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    at_p = nx * (p[0] - row[0]) + ny * (p[1] - row[1]) + nz * (p[2] - row[2])
    at_light = (
        nx * (light[0] - light[3] * row[0])
        + ny * (light[1] - light[3] * row[1])
        + nz * (light[2] - light[3] * row[2])
    )
    if abs(at_p) <= tolerance * length or abs(at_light) <= light[3] * tolerance * length:
        return False
    if (at_p > 0.0) == (at_light > 0.0):
        return False
    flags = np.int64(row[3])
    inside = 0
    total = 0.0
    for k in range(3):
        turned = flags >> k & 1
        i, j = 4 * k, 4 * ((k + 1) % 3)
        if turned:
            i, j = j, i
        ax, ay, az = row[i] - p[0], row[i + 1] - p[1], row[i + 2] - p[2]
        bx, by, bz = row[j] - p[0], row[j + 1] - p[1], row[j + 2] - p[2]
        side = (
            way[0] * (ay * bz - az * by)
            + way[1] * (az * bx - ax * bz)
            + way[2] * (ax * by - ay * bx)
        )
        if side == 0.0:  # through the edge: treat the ray as slightly offset
            side = _TINY * (
                _ASIDE[0] * (way[1] * (bz - az) - way[2] * (by - ay))
                + _ASIDE[1] * (way[2] * (bx - ax) - way[0] * (bz - az))
                + _ASIDE[2] * (way[0] * (by - ay) - way[1] * (bx - ax))
            )
        inside += (side >= 0.0) != (turned == 1)
        side = -side if turned else side
        weights[(k + 2) % 3] = side
        total += side
    if inside not in (0, 3) or total == 0.0:
        return False
    for k in range(3):
        weights[k] /= total
    return True


@kernel
def trace_light(points, light, tolerance, nodes, rows, materials, texels, left, hidden, taken):
    """Traverse the hierarchy for each point; multiply the transmittance of the triangles hit."""
    n = points.shape[0]
    while True:
        block = take_next(taken)
        if block >= (n + BLOCK - 1) // BLOCK:
            return
        way, inverse, color, weights = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
        for i in range(block * BLOCK, min(n, block * BLOCK + BLOCK)):
            p = points[i]
            for k in range(3):
                way[k] = light[k] - light[3] * p[k]
                inverse[k] = _invert(way[k])
            node = 0
            while node < nodes.shape[0]:
                near = 0.0
                far = 1.0 if light[3] > 0.0 else np.inf
                for k in range(3):
                    a = (nodes[node, k] - p[k]) * inverse[k]
                    b = (nodes[node, k + 4] - p[k]) * inverse[k]
                    near = max(near, min(a, b))
                    far = min(far, max(a, b))
                if near > far * (1.0 + 1e-12):
                    node = np.int64(nodes[node, 3])
                    continue
                f = np.int64(nodes[node, 7])
                node += 1
                if f < 0 or not _cross(f, p, light, way, tolerance, rows, weights):
                    continue
                cover = find_cover(
                    f, weights[0], weights[1], weights[2], rows, materials, texels, color
                )
                hidden[i] += cover >= 1.0
                for k in range(3):
                    left[i, k] *= (1.0 - cover) * (1.0 - cover * (1.0 - color[k]))


@kernel
def find_opacities(which, places, rows, materials, texels):
    """Find the opacity of triangles at points on them; masks as if without holes."""
    opacities = np.empty(which.size)
    color = np.empty(3)
    for i in range(which.size):
        row = rows[which[i]]
        look = materials[np.int64(row[7])]
        opacities[i] = look[3]
        if look[4] != BLEND:
            continue
        u = row[4] - row[0], row[5] - row[1], row[6] - row[2]
        v = row[8] - row[0], row[9] - row[1], row[10] - row[2]
        p = places[i, 0] - row[0], places[i, 1] - row[1], places[i, 2] - row[2]
        normal = cross(u, v)
        square = max(dot(normal, normal), _TINY)
        second = dot(cross(p, v), normal) / square
        third = dot(cross(u, p), normal) / square
        opacities[i] = find_cover(
            which[i], 1.0 - second - third, second, third, rows, materials, texels, color
        )
    return opacities
