"""One polygon at a time: ear clipping, then mending until its boundary is the rings."""

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

__all__ = ["clip_ears"]

# The two axes left when one is dropped, so that they keep the third's sense.
PLANES = ((1, 2), (2, 0), (0, 1))

TOO_FAR = 1e15  # [m]; squares beyond it overflow into infinities soon


def clip_ears(
    points: NDArray[np.float64], lengths: Sequence[int]
) -> tuple[NDArray[np.int64], bool]:
    """
    Cut one polygon with holes into triangles whose signed boundary is its rings.

    Ear clipping drops corners on straight edges, which would open a crack where a
    neighbour uses them. They are put back by splitting the triangle on that edge;
    what cannot be mended so (rings that cross themselves, polygons without area)
    is closed with slivers.

    Parameters
    ----------
    points : (n, 3) float64
        Corners of the outer ring, then of each hole [m].
    lengths : sequence of int
        Corners of each ring.

    Returns
    -------
    triangles : (m, 3) int64
        Indices into ``points``, wound as the outer ring; empty if the boundary
        cancels itself.
    crossed : bool
        Whether triangles overlap because the rings cross.
    """
    if not np.abs(points).max() < TOO_FAR:  # also true of NaN, which ear clipping cannot stand
        fan = [(0, i, i + 1) for i in range(1, lengths[0] - 1)]
        return np.array(fan, np.int64).reshape(-1, 3), False
    points = points - points[0]
    outer = points[: lengths[0]]
    normal = np.cross(outer, np.roll(outer, -1, axis=0)).sum(0)
    axis = int(np.abs(normal).argmax())
    # Dropping an axis keeps coordinates bit for bit; a rotation would not.
    flat = np.ascontiguousarray(points[:, PLANES[axis]])
    if normal[axis] < 0:
        flat = np.ascontiguousarray(flat[:, ::-1])

    ends = np.cumsum(lengths)
    ears = mapbox_earcut.triangulate_float64(flat, ends.astype(np.uint32)).astype(np.int64)
    ears = ears.reshape(-1, 3)
    areas = _signed_areas(flat, ears)
    if areas.sum() < 0:
        ears, areas = ears[:, ::-1], -areas

    # Corners in one place count as one: a hole may touch its outside there.
    places: dict[tuple[float, ...], int] = {}
    place = [places.setdefault(tuple(point), i) for i, point in enumerate(points.tolist())]
    rings = [np.array(place[end - n : end]) for n, end in zip(lengths, ends)]
    loops = [rings[0].tolist()]
    for ring in rings[1:]:
        # A hole wound like its outside is a hole all the same.
        same = _ring_area(flat[ring]) > 0
        loops.append(ring[::-1].tolist() if same else ring.tolist())

    triangles = [tuple(place[i] for i in ear) for ear in ears.tolist()]
    triangles = [t for t in triangles if len(set(t)) == 3]
    missing = _missing_edges(loops, triangles)
    if missing:
        triangles = _split_at_corners(triangles, missing, flat)
        triangles += _slivers(missing)
    result = np.array(triangles, np.int64).reshape(-1, 3)
    areas = _signed_areas(flat, result)
    crossed = bool(np.abs(areas).sum() > abs(areas.sum()) * (1 + 1e-6) + 1e-12)
    return result, crossed


def _signed_areas(flat: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    a, b, c = flat[triangles[:, 0]], flat[triangles[:, 1]], flat[triangles[:, 2]]
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def _ring_area(ring: NDArray[np.float64]) -> float:
    after = np.roll(ring, -1, axis=0)
    return float((ring[:, 0] * after[:, 1] - ring[:, 1] * after[:, 0]).sum() / 2)


def _missing_edges(
    loops: list[list[int]], triangles: list[tuple[int, ...]]
) -> dict[int, list[int]]:
    """
    Find the directed edges to add so that the triangles' boundary is the loops.

    Returns
    -------
    missing : dict of int to list of int
        Where each missing edge leads, by its start; an edge too many appears as
        the missing edge the other way. In and out are equal at every corner.
    """
    sums: dict[tuple[int, int], int] = defaultdict(int)
    for loop in loops:
        for a, b in pairwise([*loop, loop[0]]):
            sums[min(a, b), max(a, b)] += 1 if a < b else -1
    for triangle in triangles:
        for a, b in pairwise([*triangle, triangle[0]]):
            sums[min(a, b), max(a, b)] -= 1 if a < b else -1
    missing: dict[int, list[int]] = {}
    for (a, b), count in sums.items():
        start, end = (a, b) if count > 0 else (b, a)
        if count:
            missing.setdefault(start, []).extend([end] * abs(count))
    return missing


def _split_at_corners(
    triangles: list[tuple[int, ...]], missing: dict[int, list[int]], flat: NDArray[np.float64]
) -> list[tuple[int, ...]]:
    """Split each triangle that spans dropped corners; take what is mended from ``missing``."""
    mended: list[tuple[int, ...]] = []
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


def _walk(
    missing: dict[int, list[int]], a: int, c: int, flat: NDArray[np.float64]
) -> list[int] | None:
    """Follow missing edges from a to c, always onward along a straight line."""
    along = flat[c] - flat[a]
    chain, reached = [a], 0.0
    while chain[-1] != c:
        here = flat[chain[-1]]
        ahead = [
            (float((flat[b] - flat[a]) @ along), b)
            for b in missing.get(chain[-1], ())
            if _is_on_line(flat[b] - here, along) and b not in chain
        ]
        ahead = [(t, b) for t, b in ahead if reached < t and (b == c or t < along @ along)]
        if not ahead:
            return None
        reached, step = min(ahead)
        chain.append(step)
    return chain if len(chain) > 2 else None


def _is_on_line(step: NDArray[np.float64], along: NDArray[np.float64]) -> bool:
    cross = step[0] * along[1] - step[1] * along[0]
    return bool(abs(cross) <= 1e-9 * float(along @ along))


def _slivers(missing: dict[int, list[int]]) -> list[tuple[int, ...]]:
    """Close what is still missing, loop by loop, with fans that hardly have area."""
    slivers: list[tuple[int, ...]] = []
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
            path = path[: seen[step] + 1]
            if step not in missing:
                break
    return slivers
