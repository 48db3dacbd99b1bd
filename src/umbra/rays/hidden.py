"""
Occlusion between single points and the sun, for receivers without a raster.

Each ray is tested in float64 against faces, through a bounding volume hierarchy. A point is the
limit from the visible side of its surface: a face through it hides the sun only if the sun is on
the face's other side. Both faces of an edge evaluate it alike, so that they never both miss a ray.
Where rounding decides (the point on a fold or a plane, the ray through an edge or a corner), the
whole ray is repeated from slightly above and beside the point, to the east and north as for cells
of a plan, so that faces of touching parts agree. Any face between hides the sun, so the result is
whether the shadow count is not 0.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, dot, find_lowest, inlined, kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.lanes import meet_boxes

__all__ = ["find_hidden", "get", "is_hidden", "list_hiding"]

_ASIDE = 2.0**-24
"""Horizontal offset of a repeated ray's start, where rounding would decide [m], ..."""
_ABOVE = 2.0**-28
"""... and height above its surface: smaller, so that a ray along an edge passes beside it."""
_LIFT = 16.0 * _ASIDE
"""Larger height above a face on which its point lies: there the surface's side decides."""
_STEEP = 0.125  # cosine: a step above the surface does not clear steeper faces
_ROUNDING = 2.0**-48  # relative to a product of two lengths
_TINY = 1e-30  # least direction component: its inverse fits in float32
_COARSE = 2.0**-22  # relative to a coordinate: above float32's rounding
_NO, _YES, _UNSURE = 0, 1, 2
_BLOCK = 64  # points per block of a thread


def find_hidden(
    tree: FaceTree,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    lights: NDArray[np.float64],
    threads: int = 1,
    *,
    attached: bool = True,
) -> NDArray[np.uint8]:
    """
    Return the points in cast or attached shadow for each light, lamp or direction.

    Parameters
    ----------
    tree : FaceTree
    points : (n, 3) float64
        In the caster's frame [m].
    normals : (n, 3) float64
        Normals of the visible side of the surface. NaN for points that have none: faces through
        them do not hide the sun, so that such a point is lit if it is so from either side.
    lights : (m, 3) or (m, 4) float64
        Unit directions toward the light; or homogeneous, in the caster's frame: a unit direction
        with w = 0, a position with w = 1 [m].
    threads : int
    attached : bool
        Whether a point that faces away from the light is in shadow; if not, it is lit.

    Returns
    -------
    masks : (m, n) uint8
        0 or 1; a point at a lamp's position is lit.
    """
    masks = np.zeros((len(lights), len(points)), np.uint8)
    whole = np.zeros((len(lights), 4))
    whole[:, : lights.shape[1]] = lights
    use_threads(threads)
    blocks = -(-len(points) // _BLOCK)
    run_shared(blocks, _find, points, normals, whole, tree, attached, masks)
    return masks


@inlined
def get(rows, i):
    """Return three numbers of a row as a tuple, which costs less than a view."""
    return rows[i, 0], rows[i, 1], rows[i, 2]


@inlined
def is_hidden(p, n, d, tree, stack, last, light=None):
    """
    Find a face between a point and the light; -1 where there is none.

    ``p`` is the point, ``n`` its surface's normal toward the viewer, ``d`` the direction toward the
    light (tuples of three), ``tree`` a ``FaceTree``, ``stack`` scratch for DEEPEST int32, ``last``
    a face to try first (negative for none); ``light``, if not a direction, the homogeneous light,
    (4,): faces beyond a lamp are ignored.
    """
    if last >= 0 and _hides(last, p, n, d, tree, light) == _YES:
        return last
    face, is_sure = _search(p, n, d, tree, stack, light)
    if is_sure:
        return face
    return _search_beside(p, n, d, tree, stack, light)


@borrowing
def _search_beside(p, n, d, tree, stack, light):
    """Find a face between a place beside a point and the light, which is always certain."""
    scale = max(1.0, 2.0 * tree.tolerance / _ABOVE)
    face, _ = _search(_step_aside(p, n, scale), n, d, tree, stack, light, p, scale)
    return face


@borrowing
def list_hiding(p, n, d, tree, stack, hits):
    """
    List all faces between a point and the sun, and return their number.

    ``hits`` has room for every face of the tree; the others are as in ``is_hidden``.
    """
    count, is_sure = _search(p, n, d, tree, stack, None, None, 0.0, hits)
    if is_sure:
        return count
    scale = max(1.0, 2.0 * tree.tolerance / _ABOVE)
    count, _ = _search(_step_aside(p, n, scale), n, d, tree, stack, None, p, scale, hits)
    return count


@borrowing
def _step_aside(p, n, scale):
    """Find the position slightly above a surface and beside the point, to the east and north."""
    x, y, z = n
    if not x * x + y * y + z * z > 0.0:  # NaN: the point has no surface
        x, y, z = 0.0, 0.0, 0.0
    along = x + 0.618 * y + 0.382 * z
    return (
        p[0] + scale * (_ABOVE * x + _ASIDE * (1.0 - along * x)),
        p[1] + scale * (_ABOVE * y + _ASIDE * (0.618 - along * y)),
        p[2] + scale * (_ABOVE * z + _ASIDE * (0.382 - along * z)),
    )


@inlined
def _search(p, n, d, tree, stack, light, point=None, scale=0.0, hits=None):
    """
    Find a face that hides the sun; return whether the answer is certain.

    ``p`` is the start of the ray: the point, or a step of ``scale`` beside ``point``. With
    ``hits`` all such faces are listed there, and their number is returned.
    """
    inverse = (_invert(d[0]), _invert(d[1]), _invert(d[2]))
    sides = (
        0 if inverse[0] > 0.0 else 3,
        1 if inverse[1] > 0.0 else 4,
        2 if inverse[2] > 0.0 else 5,
    )
    # Boxes are tested in float32: the ray is slightly extended at both ends.
    x = np.copysign(_COARSE * p[0], d[0])
    y = np.copysign(_COARSE * p[1], d[1])
    z = np.copysign(_COARSE * p[2], d[2])
    start = (np.float32(p[0] + x), np.float32(p[1] + y), np.float32(p[2] + z))
    end = (np.float32(p[0] - x), np.float32(p[1] - y), np.float32(p[2] - z))
    stack[0] = 0
    size = 1
    count = 0
    is_sure = True
    while size > 0:
        size -= 1
        node = np.int64(stack[size])
        met = meet_boxes(tree.boxes, node, sides, start, end, inverse)
        while met != 0:
            child = np.int64(tree.links[node, find_lowest(met)])
            met &= met - 1
            if child >= 0:
                stack[size] = child
                size += 1
                continue
            if point is None:
                answer = _hides(~child, p, n, d, tree, light)
            else:
                answer = _hides_beside(~child, p, n, d, tree, light, point, scale)
            if answer == _YES:
                if hits is None:
                    return ~child, True
                hits[count] = ~child
                count += 1
            if answer == _UNSURE:
                is_sure = False
    return np.int64(-1 if hits is None else count), is_sure


@inlined
def _invert(x):
    """Return 1 / x in float32, or a large finite number for 0, so that no box makes NaN."""
    return np.float32(1.0 / x if abs(x) > _TINY else np.copysign(1.0 / _TINY, x))


@inlined
def _hides(f, p, n, d, tree, light):
    """Return whether a face lies between a point and the sun, or whether rounding decides."""
    m, tolerance, c = get(tree.normals, f), tree.normals[f, 3], get(tree.corners, f)
    at_light = _find_side(m, c, d, light)
    height = _height(p, c, m)
    is_on = abs(height) <= tolerance
    if is_on:
        above = dot(m, n)
        if np.isnan(above):
            return _NO  # NaN: of a surface with two sides one faces the sun
        if above * at_light > 0.0 and abs(above) > _STEEP:
            return _NO  # the surface itself, or a coplanar continuation
    elif not height * at_light < 0.0:
        return _NO
    a, b, e = _see(p, f, tree)
    # These are equal up to sign for both directions of an edge.
    ab, bc, ca = _side(a, b, d), _side(b, e, d), _side(e, a, d)
    least, most = min(ab, bc, ca), max(ab, bc, ca)
    a_size, b_size, e_size = _measure(a), _measure(b), _measure(e)
    length = a_size + b_size + e_size
    error = tolerance * length + _ROUNDING * length * length  # bound for any edge
    if least < -error and most > error:
        return _NO
    if not is_on and (least > error or most < -error):
        return _YES
    ab_error = tolerance * (a_size + b_size) + _ROUNDING * a_size * b_size
    bc_error = tolerance * (b_size + e_size) + _ROUNDING * b_size * e_size
    ca_error = tolerance * (e_size + a_size) + _ROUNDING * e_size * a_size
    if (
        min(ab + ab_error, bc + bc_error, ca + ca_error) < 0.0
        and max(ab - ab_error, bc - bc_error, ca - ca_error) > 0.0
    ):
        return _NO  # outside one edge: a miss
    if is_on or abs(ab) <= ab_error or abs(bc) <= bc_error or abs(ca) <= ca_error:
        return _UNSURE
    return _YES


@borrowing
def _hides_beside(f, q, n, d, tree, light, p, scale):
    """As ``_hides``, for a ray from ``q``, a step of ``scale`` beside its point ``p``."""
    m, tolerance, c = get(tree.normals, f), tree.normals[f, 3], get(tree.corners, f)
    at_light = _find_side(m, c, d, light)
    if abs(_height(p, c, m)) <= tolerance:
        if n[0] != n[0]:
            return _NO
        up = scale * _LIFT
        q = (q[0] + up * n[0], q[1] + up * n[1], q[2] + up * n[2])
    if not _height(q, c, m) * at_light < 0.0:
        return _NO
    a, b, e = _see(q, f, tree)
    i, j, k = get(tree.ids, f)
    # Every edge is tested from its lower vertex, so that 0 is on the same side for both faces.
    ab, bc, ca = _is_left(a, b, d, i < j), _is_left(b, e, d, j < k), _is_left(e, a, d, k < i)
    return _YES if ab == bc == ca else _NO


@inlined
def _is_left(u, v, d, forward):
    """Return the side of the edge u to v on which a ray passes, tested from v if not forward."""
    return ((_side(u, v, d) if forward else _side(v, u, d)) >= 0.0) == forward


@inlined
def _see(p, f, tree):
    """Return a face's corners relative to a point."""
    c = tree.corners
    return (
        (c[f, 0] - p[0], c[f, 1] - p[1], c[f, 2] - p[2]),
        (c[f, 3] - p[0], c[f, 4] - p[1], c[f, 5] - p[2]),
        (c[f, 6] - p[0], c[f, 7] - p[1], c[f, 8] - p[2]),
    )


@inlined
def _height(p, c, m):
    """Return the height of a point above a face's plane [m]."""
    return m[0] * (p[0] - c[0]) + m[1] * (p[1] - c[1]) + m[2] * (p[2] - c[2])


@inlined
def _find_side(m, c, d, light):
    """Return the side of a face on which a light is: 0 in its plane."""
    if light is None:
        return dot(m, d)
    x, y, z, w = light
    return m[0] * (x - w * c[0]) + m[1] * (y - w * c[1]) + m[2] * (z - w * c[2])


@inlined
def _side(u, v, d):
    """Return the side of the edge u to v on which a ray passes."""
    return (
        d[0] * (u[1] * v[2] - u[2] * v[1])
        + d[1] * (u[2] * v[0] - u[0] * v[2])
        + d[2] * (u[0] * v[1] - u[1] * v[0])
    )


@inlined
def _measure(u):
    return abs(u[0]) + abs(u[1]) + abs(u[2])


@kernel
def _find(points, normals, lights, tree, attached, masks, taken):
    n = points.shape[0]
    while True:
        block = take_next(taken)
        if block >= (n + _BLOCK - 1) // _BLOCK:
            return
        stack = np.zeros(DEEPEST, np.int32)
        end = min(n, (block + 1) * _BLOCK)
        _find_block(points, normals, lights, tree, attached, masks, stack, block * _BLOCK, end)


@borrowing
def _find_block(points, normals, lights, tree, attached, masks, stack, first, end):
    """Find which points from ``first`` to ``end`` are in shadow for each light."""
    for i in range(first, end):
        p, n = get(points, i), get(normals, i)
        last = -1  # the last face that hid the light usually still does
        for s in range(lights.shape[0]):
            x, y, z = get(lights, s)
            light = x, y, z, lights[s, 3]
            d = x, y, z
            if light[3] != 0.0:
                d = x - light[3] * p[0], y - light[3] * p[1], z - light[3] * p[2]
                length = np.sqrt(dot(d, d))
                if length == 0.0:
                    continue
                d = d[0] / length, d[1] / length, d[2] / length
            if dot(n, d) <= 0.0:
                masks[s, i] = attached
                continue
            face = is_hidden(p, n, d, tree, stack, last, light)
            if face >= 0:
                masks[s, i] = 1
                last = face
