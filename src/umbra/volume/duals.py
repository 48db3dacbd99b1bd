"""
Edges in dual space: where a silhouette is what a plane through the origin cuts.

A face's plane, four numbers, is a point; a light is a plane through the origin; a
face is lit if its point lies on the light's positive side. A pair of faces is in
the silhouette if the segment between their points is cut, which a tree over the
segments finds without asking every one. Two kinds of pairs are not such segments:

- A turned pair is in the silhouette if its faces are *equally* lit. That is a
  segment, too: to the second point's opposite through the origin.
- Borders are always in the silhouette; faces whose plane is no number or nearly 0
  have no direction. Both are kept apart, and asked every time.

Sources: Hertzmann and Zorin 2000, section 4; Wallner 2008, section 3, with the
corrections of docs/papers.md: duals of faces, scaled about the middle.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.volume.adjacency import Caster

__all__ = ["STRETCH", "Duals", "Fit", "Plane", "find_key", "make_duals"]

STRETCH = 4096
"""What one thread takes at a time: handing out single faces would take longer than the work."""

_LEAST, _MOST = 1e-100, 1e100  # lengths whose products neither vanish nor overflow


@dataclass(frozen=True, eq=False)
class Plane:
    """
    A light in dual space.

    The normal (4,) float32 has 1 as its largest part; where ``point @ normal`` is larger in size
    than the margin, float32 has its sign right.
    """

    normal: NDArray[np.float32]
    margin: np.float32


@dataclass(frozen=True, eq=False)
class Fit:
    """
    How a caster was fitted into the cube from -1 to 1.

    ``centre`` is the middle of the vertices in use, none is farther from it than ``reach`` [m].
    """

    centre: NDArray[np.float64]
    reach: float

    def place(self, light: NDArray[np.float64]) -> Plane | None:
        """
        Return a light (4,) as a plane; None if products with it might vanish or overflow.

        Its margin bounds, for points in the cube, twice what rounding can do: some 16
        float32 roundings of numbers up to ``sum(abs(normal))``; and in float64 those of
        the sum of four products that decides whether a face is lit, perhaps far from
        the origin.
        """
        size = float(np.abs(light).max())
        if not _LEAST < size < _MOST:
            return None
        away = np.append(light[:3] - light[3] * self.centre, light[3] * self.reach)
        length = float(np.abs(away).max())
        if not _LEAST < length < _MOST:
            return None
        normal = (away / length).astype(np.float32)
        far = float(np.abs(self.centre).sum()) + self.reach
        single = 2.0**-19 * float(np.abs(normal).sum())
        double = 2.0**-46 * float(np.abs(light[:3]).sum() + abs(light[3]) * far) / length
        return Plane(normal, np.float32(min(single + double, 1e30)))


@dataclass(frozen=True, eq=False)
class Duals:
    """
    A caster's faces as points, and its pairs as segments between them.

    Parameters
    ----------
    fit : Fit
    points : (n_faces + 1, 4) float64
        Unit normal, and the plane's signed distance from the centre over the reach;
        NaN where a plane has no direction.
    edges : (n,) int32
        The pairs that are segments.
    always : (n_always,) int32
        The other pairs.
    """

    fit: Fit
    points: NDArray[np.float64]
    edges: NDArray[np.int32]
    always: NDArray[np.int32]


def make_duals(caster: Caster) -> Duals:
    """Return a caster's faces as points."""
    used = np.zeros(len(caster.vertices), np.bool_)
    used[caster.faces.ravel()] = True
    places = caster.vertices[used] if used.any() else np.zeros((1, 3))
    low, high = places.min(0), places.max(0)
    fit = Fit((low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, _LEAST))
    points = np.full((caster.planes.shape[1], 4), np.nan)
    _place_points(caster.planes, fit.centre, fit.reach, points)
    loose = np.zeros(len(caster.edges), np.bool_)
    _find_loose(np.isnan(points[:, 0]), caster.edge_faces, loose)
    return Duals(
        fit,
        points,
        np.flatnonzero(~loose).astype(np.int32),
        np.flatnonzero(loose).astype(np.int32),
    )


@njit(cache=True, nogil=True, parallel=True)
def _place_points(planes, centre, reach, points):
    for stretch in prange((points.shape[0] + STRETCH - 1) // STRETCH):
        for face in range(stretch * STRETCH, min(points.shape[0], (stretch + 1) * STRETCH)):
            x, y, z = planes[0, face], planes[1, face], planes[2, face]
            length = np.sqrt(x * x + y * y + z * z)
            if _LEAST < length < _MOST:
                away = planes[3, face] + x * centre[0] + y * centre[1] + z * centre[2]
                points[face, 0] = x / length
                points[face, 1] = y / length
                points[face, 2] = z / length
                points[face, 3] = away / length / reach


@njit(cache=True, nogil=True, boundscheck=False)
def _find_loose(has_no_point, edge_faces, loose):
    for edge in range(loose.size):
        a, b = edge_faces[edge, 0], edge_faces[edge, 1]
        loose[edge] = a == b or has_no_point[a] or has_no_point[b]


@njit(cache=True, nogil=True)
def find_key(x, y, z, w):
    """
    Find a point's place on the Morton curve through the cube, uint64.

    It has 16 digits of four bits, the highest first: bit i of a digit says in which half of
    the cell along axis i the point lies, that of which cell the digits before say.
    """
    key = np.uint64(0)
    for axis, part in enumerate((x, y, z, w)):
        cell = np.uint64(min(max((part + 1.0) * 32768.0, 0.0), 65535.0))
        # Three empty bits between any two of the 16.
        cell = (cell | (cell << np.uint64(24))) & np.uint64(0x000000FF000000FF)
        cell = (cell | (cell << np.uint64(12))) & np.uint64(0x000F000F000F000F)
        cell = (cell | (cell << np.uint64(6))) & np.uint64(0x0303030303030303)
        cell = (cell | (cell << np.uint64(3))) & np.uint64(0x1111111111111111)
        key |= cell << np.uint64(axis)
    return key
