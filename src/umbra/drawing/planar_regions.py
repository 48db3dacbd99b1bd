"""
Planar regions: the triangles of a part that join at edges and lie in one plane.

A region is drawn as one surface, and its shadows are cut out of its one plane.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.scene.scene import Triangles
from umbra.volume.adjacency import weld_vertices

__all__ = ["PlanarRegions", "find_regions", "pair_edges"]

_FLAT = 1e-12  # area of a triangle without a plane, relative to its longest edge squared
_EVEN = 1e-9  # distance from the plane of a region within which faces join it [model's size]
_SAME = 4e-8  # and within which regions share a plane: float32 keeps no more of a model's corners
_APART, _ALIKE = 1e4, 0.9999  # of planes that may be one: difference of offsets, and cosine


@dataclass(frozen=True, eq=False)
class PlanarRegions:
    """
    The planar regions of a triangle soup, the lowest face first.

    Parameters
    ----------
    corners : (n_faces, 3, 3) float64
        Of the faces that have an area, region by region.
    faces : (n_faces,) intp
        Indices of these faces in the soup.
    owner : (n_faces,) intp
        Index of each face's region, ascending.
    starts : (n_regions + 1,) intp
        First face of each region, and the end.
    planes : (n_regions, 4) float64
        Unit normal by the winding of the largest face, and offset.
    sheet : (n_regions,) intp
        Regions of one plane share a number, wherever they lie and whichever way they face.
    part : (n_regions,) intp
    tolerance : float
        Distance within which regions lie in one plane [m].
    """

    corners: NDArray[np.float64]
    faces: NDArray[np.intp]
    owner: NDArray[np.intp]
    starts: NDArray[np.intp]
    planes: NDArray[np.float64]
    sheet: NDArray[np.intp]
    part: NDArray[np.intp]
    tolerance: float

    def __len__(self) -> int:
        return len(self.part)


def find_regions(soup: Triangles) -> PlanarRegions:
    """Join the triangles of a soup to planar regions; those without an area are left out."""
    size = float(np.ptp(soup.find_corners(), axis=0).max()) if len(soup.faces) else 0.0
    corners = soup.vertices[soup.faces]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1)
    longest = np.max([((p - q) ** 2).sum(1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    faces = np.flatnonzero(area > _FLAT * longest)
    normals = normals[faces] / area[faces, None]
    planes = np.column_stack([normals, -np.einsum("ij,ij->i", normals, corners[faces].mean(1))])
    welded = weld_vertices(soup.vertices)[soup.faces[faces]]
    first, second, _ = pair_edges(welded, soup.part[faces])
    starts, others = _list_neighbours(first, second, len(faces))
    order = np.argsort(-area[faces], kind="stable")
    owner = np.full(len(faces), -1, np.intp)
    _grow(order, starts, others, corners[faces], planes, _EVEN * size, owner)
    # Regions in the order of their lowest face: of coplanar ones the lower is in front.
    seeds, lowest, owner = np.unique(owner, return_index=True, return_inverse=True)
    rank = np.empty_like(lowest)
    rank[np.argsort(lowest)] = np.arange(len(lowest))
    owner = rank[owner.ravel()]
    seeds = seeds[np.argsort(lowest)]
    sort = np.argsort(owner, kind="stable")
    starts = np.searchsorted(owner[sort], np.arange(len(seeds) + 1))
    corners, planes = corners[faces][sort], planes[seeds]
    sheet = _find_sheets(corners, starts, planes, np.argsort(-area[faces][seeds]), _SAME * size)
    return PlanarRegions(
        corners, faces[sort], owner[sort], starts, planes, sheet,
        soup.part[faces][seeds].astype(np.intp), _SAME * size,
    )  # fmt: skip


def _find_sheets(
    corners: NDArray[np.float64],
    starts: NDArray[np.intp],
    planes: NDArray[np.float64],
    order: NDArray[np.intp],
    tolerance: float,
) -> NDArray[np.intp]:
    """
    Give regions of one plane one number, also if they are so only by others between them.

    Else a third region between two such could hide the one and be hidden by the other, and where
    all three lie nothing would be seen.
    """
    away = np.abs(planes[:, 3])
    ascending = np.argsort(away, kind="stable")
    sheet = np.full(len(planes), -1, np.intp)
    _spread(corners, starts, planes, order, away[ascending], ascending, tolerance, sheet)
    return sheet


def pair_edges(
    welded: NDArray[np.integer], group: NDArray[np.integer]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """
    Pair the faces of a group that share an edge, each with the next one around it.

    Returns both faces, and the index of the edge in the first: 0 is from corner 0 to 1.
    """
    tail, head = welded.ravel(), welded[:, [1, 2, 0]].ravel()
    key = np.minimum(tail, head).astype(np.int64) << 32 | np.maximum(tail, head)
    owner = np.repeat(np.asarray(group, np.int64), 3)
    order = np.lexsort((owner, key))
    is_same = (key[order][1:] == key[order][:-1]) & (owner[order][1:] == owner[order][:-1])
    at = np.flatnonzero(is_same)
    return order[at] // 3, order[at + 1] // 3, order[at] % 3


def _list_neighbours(
    first: NDArray[np.intp], second: NDArray[np.intp], count: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """List each face's neighbours, one face after the other."""
    sources, targets = np.concatenate([first, second]), np.concatenate([second, first])
    order = np.argsort(sources, kind="stable")
    return np.searchsorted(sources[order], np.arange(count + 1)), targets[order]


@kernel
def _spread(corners, starts, planes, order, away, ascending, tolerance, sheet):
    """Walk from each region, the larger first, on to those in its plane; number the sheets."""
    n = order.size
    left = np.arange(n + 1)  # the next place whose region has no number, or one before it
    queue = np.zeros(n, np.int64)
    for seed in order:
        if sheet[seed] >= 0:
            continue
        sheet[seed] = seed
        queue[0] = seed
        done, known = 0, 1
        while done < known:
            region = queue[done]
            done += 1
            middle = abs(planes[region, 3])
            position = np.searchsorted(away, middle - _APART * tolerance)
            end = np.searchsorted(away, middle + _APART * tolerance)
            while True:
                position = _find_left(left, position)
                if position >= end:
                    break
                other = ascending[position]
                if sheet[other] >= 0:
                    left[position] = position + 1
                    continue
                turn = 0.0
                for j in range(3):
                    turn += planes[region, j] * planes[other, j]
                first, second = starts[region], starts[other]
                if abs(turn) > _ALIKE and (
                    _is_in_plane(corners, second, starts[other + 1], planes[region], tolerance)
                    or _is_in_plane(corners, first, starts[region + 1], planes[other], tolerance)
                ):
                    sheet[other] = seed
                    queue[known] = other
                    known += 1
                position += 1


@kernel
def _find_left(left, position):
    """Follow the places to one that is left, and shorten the way."""
    end = position
    while left[end] != end:
        end = left[end]
    while left[position] != end:
        left[position], position = end, left[position]
    return end


@kernel
def _is_in_plane(corners, first, end, plane, tolerance):
    """Return whether all corners of some faces are as near to a plane as ``tolerance``."""
    for face in range(first, end):
        for k in range(3):
            height = plane[3]
            for j in range(3):
                height += plane[j] * corners[face, k, j]
            if abs(height) > tolerance:
                return False
    return True


@kernel
def _grow(order, starts, others, corners, planes, tolerance, owner):
    """Join faces to the largest one around, as long as they lie in its plane."""
    queue = np.zeros(order.size, np.int64)
    for seed in order:
        if owner[seed] >= 0:
            continue
        owner[seed] = seed
        queue[0] = seed
        done, known = 0, 1
        while done < known:
            face = queue[done]
            done += 1
            for at in range(starts[face], starts[face + 1]):
                other = others[at]
                if owner[other] >= 0:
                    continue
                if _is_in_plane(corners, other, other + 1, planes[seed], tolerance):
                    owner[other] = seed
                    queue[known] = other
                    known += 1
