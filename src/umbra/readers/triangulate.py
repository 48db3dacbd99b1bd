"""
Triangulation of polygons in space, with holes.

Every ring edge stays an edge of exactly the triangles it bounded as a polygon:
the signed sum of the triangles' edges is the ring, so a closed solid of polygons
gives a closed solid of triangles. Corners are neither moved nor dropped.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.readers.ear_clipping import clip_ears

if TYPE_CHECKING:
    from umbra.readers.budget import Budget

__all__ = ["Triangulation", "cut_faces", "triangulate"]

_REPEAT = 1000
"""What a corner is charged that its polygon names again [byte]: two bytes of a file do."""


@dataclass(frozen=True, eq=False)
class Triangulation:
    """Triangles in the order of their polygons."""

    faces: NDArray[np.int32]  # (n_faces, 3): vertex indices, wound as the polygon's outer ring
    polygon: NDArray[np.int64]  # (n_faces,): index of the polygon that each triangle came from
    degenerate: int  # polygons with fewer than three distinct corners: they gave no triangle
    crossed: int  # polygons whose rings cross themselves: their triangles overlap

    @property
    def losses(self) -> dict[str, int]:
        """Numbers of degenerate and crossed polygons, by their note."""
        return {
            "polygons with fewer than three distinct corners left out": self.degenerate,
            "polygons whose rings cross themselves, so that triangles overlap": self.crossed,
        }


def triangulate(
    vertices: NDArray[np.float64],
    corners: NDArray[np.int64],
    lengths: NDArray[np.int64],
    rings: NDArray[np.int64] | None = None,
    budget: "Budget | None" = None,
) -> Triangulation:
    """
    Cut polygons into triangles.

    Triangles, quads and polygons visible from their first corner are cut in batches; other
    concave polygons and those with holes are cut singly.

    Parameters
    ----------
    vertices : (n_vertices, 3) float64
        Positions [m].
    corners : (n_corners,) int64
        Vertex indices of all rings, in range; a polygon's first ring is its outside. A ring
        may repeat its first corner at its end.
    lengths : (n_rings,) int64
        Corners of each ring.
    rings : (n_polygons,) int64, optional
        Rings of each polygon; one by default.
    budget : Budget, optional
        Charged for corners that a polygon cut singly names again and again.

    Returns
    -------
    triangulation : Triangulation
    """
    corners, lengths = _drop_repeats(vertices, corners, lengths)
    rings = np.ones(len(lengths), np.int64) if rings is None else rings
    first_ring = np.cumsum(rings) - rings
    ring_start = np.cumsum(lengths) - lengths
    outside = np.zeros(len(rings), np.int64)
    start = np.zeros(len(rings), np.int64)
    has_ring = rings > 0
    outside[has_ring] = lengths[first_ring[has_ring]]
    start[has_ring] = ring_start[first_ring[has_ring]]
    usable = outside >= 3

    faces: list[NDArray[np.int64]] = []
    owners: list[NDArray[np.int64]] = []
    slow = np.flatnonzero(usable & (rings > 1))
    simple = np.flatnonzero(usable & (rings == 1))
    by_length = simple[np.argsort(outside[simple], kind="stable")]
    counts, firsts = np.unique(outside[by_length], return_index=True)
    for n, group in zip(counts.tolist(), np.split(by_length, firsts[1:]), strict=False):
        loops = corners[start[group][:, None] + np.arange(n)]
        if n == 3:
            cut, done = loops[:, None, :], np.ones(len(loops), bool)
        elif n == 4:
            cut, done = _cut_quads(vertices, loops)
            usable[group[~done]] = False
        else:
            cut, done = _cut_fans(vertices, loops)
            slow = np.concatenate([slow, group[~done]])
        faces.append(cut[done].reshape(-1, 3))
        owners.append(np.repeat(group[done], n - 2))

    if budget is not None and len(slow):
        is_slow = np.repeat(np.isin(np.arange(len(rings)), slow), rings)
        of_slow = np.repeat(is_slow, lengths)
        owner = np.repeat(np.repeat(np.arange(len(rings)), rings), lengths)[of_slow]
        named = len(np.unique(owner * len(vertices) + corners[of_slow]))
        budget.spend(_REPEAT * (len(owner) - named), "corners that polygons name again")
    crossed = 0
    for index in np.sort(slow).tolist():
        rows = slice(first_ring[index], first_ring[index] + rings[index])
        pieces = [
            corners[s : s + n]
            for s, n in zip(ring_start[rows].tolist(), lengths[rows].tolist())
            if n >= 3
        ]
        ring_corners = np.concatenate(pieces)
        local, crosses = clip_ears(vertices[ring_corners], [len(piece) for piece in pieces])
        crossed += crosses
        if not len(local):
            usable[index] = False
        faces.append(ring_corners[local])
        owners.append(np.full(len(local), index))

    if not faces:
        faces, owners = [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)]
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return Triangulation(
        np.concatenate(faces)[order].astype(np.int32),
        owner[order],
        int(len(usable) - usable.sum()),
        crossed,
    )


def cut_faces(
    vertices: NDArray[np.float64],
    corners: NDArray[np.int64],
    lengths: NDArray[np.int64],
    budget: "Budget | None" = None,
) -> Triangulation:
    """Cut faces of one ring; a triangle stays as the file has it, degenerate or not."""
    is_triangle = lengths == 3
    of_triangle = np.repeat(is_triangle, lengths)
    triangles = corners[of_triangle].reshape(-1, 3).astype(np.int32)
    if is_triangle.all():
        return Triangulation(triangles, np.arange(len(lengths)), 0, 0)
    cut = triangulate(vertices, corners[~of_triangle], lengths[~is_triangle], budget=budget)
    source = np.concatenate(
        [np.flatnonzero(is_triangle), np.flatnonzero(~is_triangle)[cut.polygon]]
    )
    order = np.argsort(source, kind="stable")
    faces = np.concatenate([triangles, cut.faces])
    return replace(cut, faces=faces[order], polygon=source[order])


def _drop_repeats(
    vertices: NDArray[np.float64], corners: NDArray[np.int64], lengths: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Drop corners that coincide with the next one of their ring."""
    if not len(corners):
        return corners, lengths
    filled = lengths > 0
    ends = np.cumsum(lengths)
    following = np.arange(1, len(corners) + 1)
    following[ends[filled] - 1] = (ends - lengths)[filled]
    after = corners[following]
    same = corners == after
    # Other indices, equal places: OBJ and STL exporters repeat vertices.
    other = np.flatnonzero(~same)
    same[other] = (vertices[corners[other]] == vertices[after[other]]).all(1)
    if not same.any():
        return corners, lengths
    ring = np.repeat(np.arange(len(lengths)), lengths)
    return corners[~same], np.bincount(ring[~same], minlength=len(lengths))


def _corner_turns(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Find how much each corner of polygons (m, n, 3) turns, (m, n), positive toward the inside."""
    # Relative to the first corner, to keep digits far from the origin.
    points = points - points[:, :1]
    after = np.roll(points, -1, axis=1)
    normals = np.cross(points, after).sum(1)
    edges = after - points
    crosses = np.cross(np.roll(edges, 1, axis=1), edges)
    return np.einsum("pni,pi->pn", crosses, normals)


def _cut_quads(
    vertices: NDArray[np.float64], rings: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """
    Cut quads along the diagonal from their most reflex corner.

    That is the only diagonal inside a concave quad, and the one that leaves no
    triangle without area where a corner is straight.
    """
    points = vertices[rings]
    even = _corner_turns(points).argmin(1) % 2 == 0
    cut = np.where(
        even[:, None, None], rings[:, [[0, 1, 2], [0, 2, 3]]], rings[:, [[1, 2, 3], [1, 3, 0]]]
    )
    # Opposite corners in one place: the edges cancel and nothing is left.
    folded = (points[:, 0] == points[:, 2]).all(1) | (points[:, 1] == points[:, 3]).all(1)
    return cut, ~folded


def _cut_fans(
    vertices: NDArray[np.float64], rings: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Cut polygons into fans; also return which are valid: the first corner sees all others."""
    points = vertices[rings]
    spokes = points[:, 1:] - points[:, :1]
    blades = np.cross(spokes[:, :-1], spokes[:, 1:])
    normals = blades.sum(1)
    along = np.einsum("pni,pi->pn", blades, normals)
    # Corners straight to within rounding take the slow path, which leaves no sliver.
    flat = 1e-9 * np.einsum("pi,pi->p", normals, normals)
    n = rings.shape[1]
    triangles = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    return rings[:, triangles], (along > flat[:, None]).all(1)
