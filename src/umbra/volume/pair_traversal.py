"""
Whether casting triangles meet a region: what bounds cannot tell, triangle by triangle.

Source: the clipper is Sutherland and Hodgman's (1974), in distances from planes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.volume.adjacency import Caster
from umbra.volume.facing import find_sides

__all__ = ["CastingFaces", "any_meets"]

_AT_ONCE = 8192  # vertices or triangles looked at in one go


@dataclass(frozen=True, eq=False)
class CastingFaces:
    """Tells which faces cast: lit ones of closed components, all of open ones not edge-on."""

    caster: Caster | None
    light: NDArray[np.float64]

    def among(self, faces: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the faces among the given ones that cast."""
        if self.caster is None:
            return faces
        side = find_sides(self.caster.planes[:, faces], self.light)
        is_closed = self.caster.is_closed[self.caster.component[faces]]
        return faces[(side > 0) | ((side < 0) & ~is_closed)]


def any_meets(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    planes: NDArray[np.float64],
    casting: CastingFaces,
    away: NDArray[np.float64] | None = None,
) -> bool:
    """
    Tell whether any casting triangle, or its throw to infinity, meets a region.

    Outcodes of the vertices decide most; what is left is clipped, in terms of its
    corners' distances from the planes.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    planes : (k, 4) float64
        The region, inward, in the frame of the vertices.
    casting : CastingFaces
        Which faces are asked.
    away : (4,) float64, optional
        A homogeneous light: ask for what it throws to infinity instead.
    """
    values = np.zeros((len(planes), len(vertices)))
    codes = np.zeros(len(vertices), np.uint8)  # a bit for each plane that it is beyond
    for start in range(0, len(vertices), _AT_ONCE):  # so short that BLAS starts no threads
        some = slice(start, start + _AT_ONCE)
        if away is None:
            values[:, some] = planes[:, :3] @ vertices[some].T + planes[:, 3:]
        else:
            values[:, some] = planes[:, :3] @ (away[3] * vertices[some] - away[:3]).T
            # Directions have no size: widen by an angle instead.
            values[:, some] += 1e-9 * np.abs(values[:, some]).max()
        for plane, row in enumerate(values[:, some]):
            codes[some] |= (row < 0).view(np.uint8) << np.uint8(plane)
    a, b, c = np.ascontiguousarray(np.take(codes, faces).T)
    near = np.flatnonzero((a & b & c) == 0)
    for start in range(0, len(near), _AT_ONCE):  # often the first few have the answer
        asked = casting.among(near[start : start + _AT_ONCE])
        if not (a[asked].all() and b[asked].all() and c[asked].all()):
            return True
        if len(asked) and _any_survives(values.T[faces[asked]]):
            return True
    return False


def _any_survives(values: NDArray[np.float64]) -> bool:
    """
    Clip triangles, given as their corners' distances from planes (n, 3, k).

    Sutherland and Hodgman's clipper on all of them at once; distances are linear along
    an edge, so they are all it needs to know. True if anything is left of any.
    """
    n_corners = np.full(len(values), 3)
    for plane in range(values.shape[2]):
        here = np.arange(values.shape[1])
        after = np.where(here + 1 < n_corners[:, None], here + 1, 0)
        ahead = np.take_along_axis(values, after[..., None], 1)
        start, end = values[..., plane], ahead[..., plane]
        real = here < n_corners[:, None]
        kept = real & (start >= 0)
        cut = real & ((start >= 0) != (end >= 0))
        along = np.divide(start, start - end, out=np.zeros_like(start), where=cut)
        points = values + along[..., None] * (ahead - values)
        points[..., plane] = 0.0
        both = np.stack([values, points], 2).reshape(len(values), -1, values.shape[2])
        emit = np.stack([kept, cut], 2).reshape(len(values), -1)
        n_corners = emit.sum(1)
        alive = n_corners > 0
        if not alive.any():
            return False
        order = np.argsort(~emit[alive], 1, kind="stable")[:, : values.shape[1] + 1]
        values = np.take_along_axis(both[alive], order[..., None], 1)
        n_corners = n_corners[alive]
    return True
