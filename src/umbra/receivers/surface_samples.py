"""
Samples of surfaces, each at the centre of a square of its surface's lattice.

Which triangle holds how many is kept; positions are computed when they are asked for.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import inlined, kernel
from umbra.scene.grid import Places

__all__ = ["SampledPlaces", "Samples", "place_samples"]

_RIM = 1e-9  # distance from an edge, relative to the triangle's height, that counts as on it


@dataclass(frozen=True, eq=False)
class Samples:
    """
    Samples of surfaces, each found from the triangle that holds it when it is asked for.

    Parameters
    ----------
    part : (n_surfaces,) int32
        Part of each surface, in ``Scene.parts``.
    surface_area : (n_surfaces,) float64
        [m2]
    surface_normal : (n_surfaces, 3) float64
    share : (n_surfaces,) float64
        Area of each sample of a surface [m2].
    corners : (n_triangles, 3, 3) float64
        Sampled triangles, in order of surfaces; local frame [m].
    flat : (n_triangles, 3, 2) float64
        The same along the axes of their surfaces [m].
    is_border : (n_triangles, 3) bool
        Whether the edge from each corner to the next bounds its surface.
    face_normals : (n_triangles, 3) float64
        Outward unit normals.
    owner : (n_triangles,) int64
        Surface of each triangle.
    source : (n_triangles,) int64
        Its face in ``Scene.triangles()``.
    first : (n_triangles + 1,) int64
        First sample of each triangle; below 0 where samples before the first are left out.
    is_lone : (n_surfaces,) bool
        Surfaces whose only sample is at the centroid of their largest triangle.
    axes : (n_surfaces, 2, 3) float64
        Horizontal and upward axis of each surface's squares.
    start : (n_surfaces, 2) float64
        The first square's centre along these axes [m].
    cells : (n_surfaces, 2) int64
        Number of squares along the axes.
    spacing : float
        Side of the squares [m].
    count : int
        Number of samples.
    """

    part: NDArray[np.int32]
    surface_area: NDArray[np.float64]
    surface_normal: NDArray[np.float64]
    share: NDArray[np.float64]
    corners: NDArray[np.float64]
    flat: NDArray[np.float64]
    is_border: NDArray[np.bool_]
    face_normals: NDArray[np.float64]
    owner: NDArray[np.int64]
    source: NDArray[np.int64]
    first: NDArray[np.int64]
    is_lone: NDArray[np.bool_]
    axes: NDArray[np.float64]
    start: NDArray[np.float64]
    cells: NDArray[np.int64]
    spacing: float
    count: int

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """Positions in the scene's local frame, (n, 3) [m]."""
        points = np.zeros((self.count, 3))
        begin = int(np.searchsorted(self.first, 0, "right")) - 1
        span = slice(begin, int(np.searchsorted(self.first, self.count)))
        place_samples(
            self.flat[span], self.owner[span], self.is_border[span], self.start, self.spacing,
            self.corners[span], np.diff(self.first[begin : span.stop + 1]), self.is_lone,
            self.first[begin], points,
        )  # fmt: skip
        return points

    @cached_property
    def triangle(self) -> NDArray[np.int64]:
        """Triangle that holds each sample, (n,)."""
        return np.repeat(np.arange(len(self.owner)), np.diff(self.first.clip(0, self.count)))

    @property
    def normals(self) -> NDArray[np.float64]:
        """Outward unit normals, (n, 3)."""
        return self.face_normals[self.triangle]

    def pick_normals(self, which: NDArray[np.integer]) -> NDArray[np.float64]:
        """Return the normals of some samples."""
        return self.face_normals[self.triangle[which]]

    @cached_property
    def surface(self) -> NDArray[np.int32]:
        """Surface of each sample, (n,); ascending."""
        return np.repeat(np.arange(len(self.part), dtype=np.int32), self._count_each())

    @property
    def area(self) -> NDArray[np.float64]:
        """Area of each sample, (n,) [m2]."""
        return np.repeat(self.share, self._count_each())

    @property
    def surface_first(self) -> NDArray[np.int64]:
        """First sample of each surface, and their number, (n_surfaces + 1,)."""
        begins = np.searchsorted(self.owner, np.arange(len(self.part) + 1))
        first: NDArray[np.int64] = self.first[begins].clip(0, self.count)
        return first

    def _count_each(self) -> NDArray[np.int64]:
        return np.diff(self.surface_first)

    def piece(self, span: slice) -> "Samples":
        """
        Return some of the samples, with the surfaces and triangles on which they lie.

        Parameters
        ----------
        span : slice
            Of at least one sample.
        """
        begin, end, _ = span.indices(self.count)
        if (begin, end) == (0, self.count):
            return self
        held = np.searchsorted(self.first, begin, "right") - 1, np.searchsorted(self.first, end) - 1
        which = slice(int(self.owner[held[0]]), int(self.owner[held[1]]) + 1)
        first, last = np.searchsorted(self.owner, [which.start, which.stop])
        return Samples(
            part=self.part[which],
            surface_area=self.surface_area[which],
            surface_normal=self.surface_normal[which],
            share=self.share[which],
            corners=self.corners[first:last],
            flat=self.flat[first:last],
            is_border=self.is_border[first:last],
            face_normals=self.face_normals[first:last],
            owner=self.owner[first:last] - which.start,
            source=self.source[first:last],
            first=self.first[first : last + 1] - begin,
            is_lone=self.is_lone[which],
            axes=self.axes[which],
            start=self.start[which],
            cells=self.cells[which],
            spacing=self.spacing,
            count=end - begin,
        )


class SampledPlaces(Places):
    """Positions and normals of samples, found when they are asked for."""

    samples: Samples

    def __init__(self, samples: Samples) -> None:
        self.__dict__["samples"] = samples  # as it is frozen

    def __len__(self) -> int:
        return self.samples.count

    @property
    def points(self) -> NDArray[np.float64]:  # noqa: D102
        return self.samples.points

    @property
    def normals(self) -> NDArray[np.float64]:  # noqa: D102
        return self.samples.normals


@kernel
def place_samples(flat, owner, is_border, start, spacing, corners, counts, is_lone, first, points):
    """
    Place the samples of triangles at the centres of squares that they hold.

    Centres exactly on a surface's border are left out: they belong to two sides. ``first`` is the
    number of the first triangle's first sample, and ``points`` those from 0 on; without any, each
    triangle's samples are counted into ``counts``. A triangle of a lone surface has one, if any, at
    its centroid.
    """
    at = first
    at_left, at_right, weight = np.zeros((3, 3))
    for f in range(flat.shape[0]):
        p = flat[f]
        s = start[owner[f]]
        low = min(p[0, 1], p[1, 1], p[2, 1])
        high = max(p[0, 1], p[1, 1], p[2, 1])
        lowest = np.int64(np.ceil((low - s[1]) / spacing)) - 1
        end = np.int64(np.floor((high - s[1]) / spacing)) + 2
        begun = at
        if is_lone[owner[f]] or (len(points) > 0 and counts[f] == 0):
            end = lowest
        for r in range(lowest, end):
            y = s[1] + r * spacing
            # The row's half-open span in the triangle, from edges that neighbours share.
            left = np.inf
            right = -np.inf
            for k in range(3):
                i, j = k, (k + 1) % 3
                if (p[i, 1] > y) == (p[j, 1] > y):
                    continue
                if p[i, 1] > p[j, 1]:
                    i, j = j, i
                t = (y - p[i, 1]) / (p[j, 1] - p[i, 1])
                x = p[i, 0] + t * (p[j, 0] - p[i, 0])
                if x < left:
                    left = x
                    at_left[:] = 0.0
                    at_left[i], at_left[j] = 1.0 - t, t
                if x > right:
                    right = x
                    at_right[:] = 0.0
                    at_right[i], at_right[j] = 1.0 - t, t
            # Same comparison as in neighbours: a quotient may round to either side.
            c = np.int64(np.ceil((left - s[0]) / spacing)) - 1 if left < right else 0
            while left < right and s[0] + c * spacing < right:
                x = s[0] + c * spacing
                c += 1
                if x < left:
                    continue
                # Clamped between two edges: rounding must not leave a needle.
                t = (x - left) / (right - left)
                for k in range(3):
                    weight[k] = (1.0 - t) * at_left[k] + t * at_right[k]
                if (
                    (is_border[f, 0] and weight[2] < _RIM)
                    or (is_border[f, 1] and weight[0] < _RIM)
                    or (is_border[f, 2] and weight[1] < _RIM)
                ):
                    continue
                if 0 <= at < len(points):
                    _place(corners[f], weight, points[at])
                at += 1
        if len(points) == 0:
            counts[f] = at - begun
        elif is_lone[owner[f]] and counts[f] > 0:
            weight[:] = 1 / 3
            if 0 <= at < len(points):
                _place(corners[f], weight, points[at])
            at += 1


@inlined
def _place(corners, weight, point):
    for k in range(3):
        point[k] = weight[0] * corners[0, k] + weight[1] * corners[1, k] + weight[2] * corners[2, k]
