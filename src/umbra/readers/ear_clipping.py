"""Triangulation of one polygon: ear clipping, then repair until its boundary is the rings."""

from collections import defaultdict
from collections.abc import Sequence
from itertools import accumulate, pairwise

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

__all__ = ["clip_ears"]

# The two axes left when one is dropped, in the order that keeps the orientation.
PLANES = ((1, 2), (2, 0), (0, 1))

Point = tuple[float, float]
Corners = tuple[int, int, int]

MOST = 1e8  # steps of ear clipping, half a second: corners times (corners + 10 holes)
TOO_FAR = 1e15  # [m]; products of larger coordinates overflow


def clip_ears(
    points: NDArray[np.float64], lengths: Sequence[int]
) -> tuple[NDArray[np.int64], bool]:
    """
    Cut one polygon with holes into triangles (m, 3) whose signed boundary is its rings.

    Ear clipping drops corners on straight edges, which would open a crack where a
    neighbour uses them. They are restored by splitting the triangle on that edge; other
    gaps (rings that cross themselves, polygons without area) are closed with slivers.
    Large polygons are swept; those that cross or touch themselves become a fan for each
    ring.

    The points (n, 3) [m] are the outer ring's, then each hole's. Triangles are wound as the
    outer ring; none are left if the boundary cancels itself. ``crossed`` says whether they
    overlap because the rings cross.
    """
    if not np.abs(points).max() < TOO_FAR:  # also true of NaN, which breaks ear clipping
        fan = [(0, i, i + 1) for i in range(1, lengths[0] - 1)]
        return np.array(fan, np.int64).reshape(-1, 3), False
    # Lists from here on: most polygons have about ten corners, where arrays are slow.
    near = (points - points[0]).tolist()
    normal = _find_normal(near[: lengths[0]])
    axis = max(range(3), key=lambda k: abs(normal[k]))
    # Dropping an axis keeps coordinates exact; a rotation would not.
    u, v = PLANES[axis] if normal[axis] >= 0 else PLANES[axis][::-1]
    flat = [(point[u], point[v]) for point in near]

    ends = list(accumulate(lengths))
    triangles = _cut(flat, lengths, ends)
    # Counter-clockwise as a rule, but earcut does not promise it.
    if sum(_find_area(flat, triangle) for triangle in triangles) < 0:
        triangles = [(c, b, a) for a, b, c in triangles]

    # Corners in one place count as one: a hole may touch its outside there.
    places: dict[tuple[float, ...], int] = {}
    index = [places.setdefault(tuple(point), i) for i, point in enumerate(near)]
    if len(places) < len(index):
        triangles = [(index[a], index[b], index[c]) for a, b, c in triangles]
        triangles = [t for t in triangles if len(set(t)) == 3]
    loops = [index[end - n : end] for n, end in zip(lengths, ends, strict=True)]
    # A hole may be wound like its outside.
    loops[1:] = [hole[::-1] if _find_area(flat, hole) > 0 else hole for hole in loops[1:]]

    missing = _missing_edges(loops, triangles)
    if missing:
        triangles = _split_at_corners(triangles, missing, flat)
        triangles += _slivers(missing)
    areas = [_find_area(flat, triangle) for triangle in triangles]
    crossed = sum(map(abs, areas)) > abs(sum(areas)) * (1 + 1e-6) + 1e-12
    return np.array(triangles, np.int64).reshape(-1, 3), crossed


def _cut(flat: list[Point], lengths: Sequence[int], ends: list[int]) -> list[Corners]:
    """Cut a polygon by ears or a sweep, by cost, else by a fan for each ring."""
    if ends[-1] * (ends[-1] + 10 * len(ends)) <= MOST:
        ears = mapbox_earcut.triangulate_float64(
            np.array(flat, np.float64), np.array(ends, np.uint32)
        ).tolist()
        return list(zip(ears[::3], ears[1::3], ears[2::3], strict=True))
    from umbra.readers.monotone import cut_by_sweep  # noqa: PLC0415 - it compiles kernels

    following = np.arange(1, ends[-1] + 1)
    fans: list[Corners] = []
    for index, (n, end) in enumerate(zip(lengths, ends, strict=True)):
        start = end - n
        ring = range(start, end)
        if index and _find_area(flat, ring) > 0:
            ring = ring[::-1]
        following[list(ring)] = [*ring[1:], ring[0]]
        fans += [(ring[0], a, b) for a, b in pairwise(ring[1:])]
    swept = cut_by_sweep(np.array(flat, np.float64), following)
    return fans if swept is None else [(a, b, c) for a, b, c in swept.tolist()]


def _find_normal(ring: list[list[float]]) -> tuple[float, float, float]:
    """Return Newell's normal, whose length is twice the ring's area."""
    x = y = z = 0.0
    x0, y0, z0 = ring[-1]
    for x1, y1, z1 in ring:
        x += y0 * z1 - z0 * y1
        y += z0 * x1 - x0 * z1
        z += x0 * y1 - y0 * x1
        x0, y0, z0 = x1, y1, z1
    return x, y, z


def _find_area(flat: list[Point], ring: Sequence[int]) -> float:
    """Return the signed area of a ring of corners [m²]."""
    x0, y0 = flat[ring[0]]
    area = 0.0
    xa, ya = 0.0, 0.0
    for corner in ring[1:]:
        xb, yb = flat[corner][0] - x0, flat[corner][1] - y0
        area += xa * yb - ya * xb
        xa, ya = xb, yb
    return area / 2


def _missing_edges(loops: list[list[int]], triangles: list[Corners]) -> dict[int, list[int]]:
    """
    Find the directed edges to add, by their start, so that the triangles' boundary is the loops.

    An edge too many is a missing one the other way. In and out are equal at every corner.
    """
    sums: dict[tuple[int, int], int] = defaultdict(int)
    for loop in loops:
        for a, b in pairwise([*loop, loop[0]]):
            if a < b:
                sums[a, b] += 1
            else:
                sums[b, a] -= 1
    for triangle in triangles:
        for a, b in pairwise((*triangle, triangle[0])):
            if a < b:
                sums[a, b] -= 1
            else:
                sums[b, a] += 1
    missing: dict[int, list[int]] = {}
    for (a, b), count in sums.items():
        start, end = (a, b) if count > 0 else (b, a)
        if count:
            missing.setdefault(start, []).extend([end] * abs(count))
    return missing


def _split_at_corners(
    triangles: list[Corners], missing: dict[int, list[int]], flat: list[Point]
) -> list[Corners]:
    """Split each triangle that spans dropped corners; take repaired edges from ``missing``."""
    mended: list[Corners] = []
    pending = list(triangles)
    while pending:
        triangle = pending.pop()
        for k in range(3):
            a, c, apex = triangle[k], triangle[k - 2], triangle[k - 1]
            # The edge a to c is too many when its reverse is missing.
            if a not in missing.get(c, ()):
                continue
            chain = _walk(missing, a, c, flat)
            if chain is None or apex in chain:
                continue
            for start, end in [*pairwise(chain), (c, a)]:
                missing[start].remove(end)
                if not missing[start]:
                    del missing[start]
            pending += [(start, end, apex) for start, end in pairwise(chain)]
            break
        else:
            mended.append(triangle)
    return mended


def _walk(missing: dict[int, list[int]], a: int, c: int, flat: list[Point]) -> list[int] | None:
    """Follow missing edges from a to c, always onward along a straight line."""
    (xa, ya), (xc, yc) = flat[a], flat[c]
    dx, dy = xc - xa, yc - ya
    length = dx * dx + dy * dy
    chain, reached = [a], 0.0
    while chain[-1] != c:
        ahead = []
        for b in missing.get(chain[-1], ()):
            x, y = flat[b][0] - xa, flat[b][1] - ya
            along = x * dx + y * dy
            straight = abs(x * dy - y * dx) <= 1e-9 * length
            if b == c or (straight and reached < along < length):
                ahead.append((along, b))
        if not ahead:
            return None
        reached, step = min(ahead)
        chain.append(step)
    return chain if len(chain) > 2 else None


def _slivers(missing: dict[int, list[int]]) -> list[Corners]:
    """Close the edges still missing, loop by loop, with fans that hardly have area."""
    slivers: list[Corners] = []
    while missing:
        path = [next(iter(missing))]
        seen = {path[0]: 0}
        while True:
            here = path[-1]
            step = missing[here].pop()
            if not missing[here]:
                del missing[here]
            if step not in seen:
                seen[step] = len(path)
                path.append(step)
                continue
            # A loop closed: fan it, and go on from where it began.
            loop = path[seen[step] :]
            slivers += [(loop[0], loop[i], loop[i + 1]) for i in range(1, len(loop) - 1)]
            for corner in loop[1:]:
                del seen[corner]
            del path[seen[step] + 1 :]
            if step not in missing:
                break
    return slivers
