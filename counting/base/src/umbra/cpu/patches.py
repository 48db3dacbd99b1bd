"""
Planar patches: samples of one plane on a regular grid of squares.

Coordinates in a patch's frame are column, row and height above the plane. The samples are sorted
column by column, so that any run of a column is a range of samples.
"""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.patch_cuts import find_cuts
from umbra.kernels import kernel
from umbra.rays.face_tree import FaceTree

__all__ = ["PatchSource", "Patches", "make_patches"]

FEW = 8
"""Number of samples up to which a patch is counted faster by one ray per sample."""
_FLAT = 2.5e-7  # m: triangles within this distance of a plane lie in it
_NEAR = 1e-6  # m: heights above a plane that count as 0
_THICK = 5e-3  # m: a less flat surface is split into its planes,
_TILT = 5e-3  # also if its triangles are tilted by more [rad],
_MARKED = 0.05  # or a greater share of its samples needs rays
_GRAZE = 6.0  # rays are cast if the sine of the sun is below 6 times the thickness [m]
_LOW = 3e-4  # sine of the sun over a plane below which rays are cast
_SPARSE = 64  # squares per sample above which rays are cast
_MARK_WITHIN = 0.01  # m
_OFF = 1e-5  # largest offset of a sample from its square's centre [squares]


class PatchSource(Protocol):
    """Fields of ``umbra.receivers.surface_samples.Samples``; see there."""

    @property
    def points(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def triangle(self) -> NDArray[np.int64]: ...  # noqa: D102
    @property
    def corners(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def owner(self) -> NDArray[np.int64]: ...  # noqa: D102
    @property
    def axes(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def start(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def spacing(self) -> float: ...  # noqa: D102
    def pick_normals(  # noqa: D102
        self, which: NDArray[np.integer]
    ) -> NDArray[np.float64]: ...


class Patches(NamedTuple):
    """
    Patches and their samples, sorted by patch, column and row.

    Parameters
    ----------
    frame : (n, 12) float64
        Affine maps from a point to column, row [squares] and height [m], four numbers each.
    place : (n, 9) float64
        Centre of the first square, step to the next column, step to the next row [m].
    size : (n, 2) int64
        Columns and rows.
    first : (n + 1,) int64
        First sample of each patch.
    cell : (n + 1,) int64
        First entry of each patch in ``before``.
    before : (entries,) int32
        Number of the patch's samples before each square, column by column, then their total.
    tau : (n,) float64
        Heights up to this value count as 0 [m].
    graze : (n,) float64
        Sine of the sun's angle above the plane below which rays are cast.
    hull : (n, 21) float64
        Bounds of the samples along both diagonals, the corners of their octagon, and the rounding
        error of these.
    cut_start : (n + 1,) int64
    cuts : (n_cuts, 4) float64
        Where casting faces pass through the plane, from column, row to column, row.
    cut_face : (n_cuts,) int32
        These faces, by their index in the tree.
    mark_start : (n + 1,) int64
    marks : (n_marks,) int64
        Samples of the patch near another face that is close to the plane.
    mark_far : (n_marks,) float64
        Distance of that face from the sample [m], ascending within a patch.
    points, normals : (n_samples, 3) float64
    where : (n_samples,) int64
        Index of each sample in the input.
    """

    frame: NDArray[np.float64]
    place: NDArray[np.float64]
    size: NDArray[np.int64]
    first: NDArray[np.int64]
    cell: NDArray[np.int64]
    before: NDArray[np.int32]
    tau: NDArray[np.float64]
    graze: NDArray[np.float64]
    hull: NDArray[np.float64]
    cut_start: NDArray[np.int64]
    cuts: NDArray[np.float64]
    cut_face: NDArray[np.int32]
    mark_start: NDArray[np.int64]
    marks: NDArray[np.int64]
    mark_far: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    where: NDArray[np.int64]


def make_patches(surfaces: PatchSource, tree: FaceTree) -> Patches:
    """
    Arrange the samples of surfaces in patches.

    A surface that is not quite flat becomes one patch, as thick as it is uneven. If that exceeds 5
    mm, or too many of its samples lie near other faces, it is split into planes.

    Parameters
    ----------
    surfaces : PatchSource
    tree : FaceTree
        Hierarchy over the casting faces.
    """
    s = surfaces
    normals = np.cross(s.corners[:, 1] - s.corners[:, 0], s.corners[:, 2] - s.corners[:, 0])
    double = np.linalg.norm(normals, axis=1)
    normals /= np.maximum(double, 1e-300)[:, None]
    order = np.lexsort((-double, s.owner))
    first = np.searchsorted(s.owner, np.arange(len(s.axes)))
    lead = order[first][s.owner]  # the largest triangle of each sample's surface
    height = np.abs(np.einsum("fkj,fj->fk", s.corners - s.corners[lead, :1], normals[lead])).max(1)
    uneven = np.maximum.reduceat(height, first)
    tilt = np.maximum.reduceat(np.linalg.norm(normals - normals[lead], axis=1), first)
    is_thick = (uneven > _FLAT) & (uneven <= _THICK) & (tilt <= _TILT)
    some = np.flatnonzero(is_thick[s.owner[s.triangle]])
    if len(some):
        plane = _split(order, s.owner, s.corners, normals, is_thick)
        patches, surface = _lay_out(s, some, tree, normals, plane, order, uneven)
        near = np.append(0, np.cumsum(patches.mark_far <= _MARK_WITHIN))[patches.mark_start]
        is_bad = np.diff(near) > _MARKED * np.diff(patches.first)
        is_thick[surface[is_bad]] = False
    plane = _split(order, s.owner, s.corners, normals, is_thick)
    patches, _ = _lay_out(s, None, tree, normals, plane, order, uneven * is_thick)
    return patches


def _lay_out(
    s: PatchSource,
    some: NDArray[np.intp] | None,
    tree: FaceTree,
    normals: NDArray[np.float64],
    plane: NDArray[np.int64],
    order: NDArray[np.intp],
    uneven: NDArray[np.float64],
) -> tuple[Patches, NDArray[np.int64]]:
    """
    Make a patch of the samples in each plane; return the patches and their surfaces.

    With ``some``, only these samples are laid out, and their places are left out.
    """
    points, of_sample = (each if some is None else each[some] for each in (s.points, s.triangle))
    largest = np.full(plane.max() + 1, -1)
    largest[plane[order[::-1]]] = order[::-1]
    there = np.flatnonzero(np.bincount(of_sample, minlength=len(plane)))
    used, patch = np.unique(plane[there], return_inverse=True)
    of_triangle = np.zeros(len(plane), np.int64)
    of_triangle[there] = patch.ravel()
    own = of_triangle[of_sample]
    lead = largest[used]
    surface = s.owner[lead]
    n = len(used)
    along, up = s.axes[surface, 0] / s.spacing, s.axes[surface, 1] / s.spacing
    out = normals[lead]
    shift = s.start[surface] / s.spacing
    square = np.zeros((len(own), 2), np.int64)
    low, high = np.full((n, 2), 1 << 40), np.full((n, 2), -(1 << 40))
    is_ray = np.zeros(n, np.bool_)
    _find_squares(points, own, along, up, shift, square, low, high, is_ray)
    size = high - low + 1
    count = np.bincount(own, minlength=n)
    first = np.append(0, np.cumsum(count))
    frame = np.zeros((n, 12))
    frame[:, 0:3], frame[:, 3] = along, -shift[:, 0] - low[:, 0]
    frame[:, 4:7], frame[:, 7] = up, -shift[:, 1] - low[:, 1]
    frame[:, 8:11], frame[:, 11] = out, -np.einsum("ij,ij->i", out, s.corners[lead, 0])
    back = np.linalg.inv(np.stack([along, up, out], 1))
    origin = np.einsum("nij,nj->ni", back, -frame[:, [3, 7, 11]])
    place = np.concatenate([origin, back[:, :, 0], back[:, :, 1]], 1)
    # Patches that fit no grid are counted with rays.
    is_ray |= (count <= FEW) | (size.prod(1) > _SPARSE * count + 1024)
    cell = np.append(0, np.cumsum(np.where(is_ray, 1, size.prod(1) + 1)))
    before = np.zeros(cell[-1], np.int32)
    where = np.zeros(len(own), np.int64)
    _sort(own, square, low, size, cell, first, is_ray, before, where)
    thick = uneven[surface]
    tau = np.where(thick > 0, 1.01 * thick, 0.0) + _NEAR
    turned = np.zeros(n)
    patch = of_triangle[there]
    np.maximum.at(turned, patch, np.linalg.norm(normals[there] - out[patch], axis=1))
    graze = np.maximum(np.where(thick > 0, _GRAZE * tau, _LOW), 2 * turned)
    graze = np.where(is_ray, np.inf, graze)
    t0, t1 = np.searchsorted(s.owner, surface), np.searchsorted(s.owner, surface, "right")
    cut_start, cuts, cut_face, mark_start, marks, mark_far = find_cuts(
        frame, place, size, tau, graze, cell, before, np.stack([t0, t1], 1),
        s.corners.reshape(-1, 9), s.spacing, tree,
    )  # fmt: skip
    hull = _make_hulls(own, square, low, n)
    where = where if some is None else where[:0]
    return Patches(
        frame, place, size, first, cell, before, tau, graze, hull, cut_start, cuts, cut_face,
        mark_start, marks, mark_far, np.ascontiguousarray(points[where]),
        np.ascontiguousarray(s.pick_normals(where)), where,
    ), surface  # fmt: skip


@kernel
def _find_squares(points, own, along, up, shift, square, low, high, is_ray):
    """Find each sample's square and each patch's bounds; flag patches with off-centre samples."""
    for i in range(own.size):
        p, k = points[i], own[i]
        u, v = -shift[k, 0], -shift[k, 1]
        for q in range(3):
            u += p[q] * along[k, q]
            v += p[q] * up[k, q]
        square[i, 0], square[i, 1] = np.int64(np.rint(u)), np.int64(np.rint(v))
        if abs(u - square[i, 0]) > _OFF or abs(v - square[i, 1]) > _OFF:
            is_ray[k] = True
        for q in range(2):
            low[k, q] = min(low[k, q], square[i, q])
            high[k, q] = max(high[k, q], square[i, q])


@kernel
def _sort(own, square, low, size, cell, first, is_ray, before, where):
    """Sort the samples by column and row; flag patches with two samples in one square."""
    at = np.zeros(own.size, np.int64)
    for i in range(own.size):
        k = own[i]
        if is_ray[k]:
            continue
        at[i] = cell[k] + (square[i, 0] - low[k, 0]) * size[k, 1] + square[i, 1] - low[k, 1]
        if before[at[i] + 1] > 0:
            is_ray[k] = True
        before[at[i] + 1] = 1
    for k in range(is_ray.size):
        for q in range(cell[k] + 1, cell[k + 1]):
            before[q] += before[q - 1]
    filled = np.zeros(is_ray.size, np.int64)
    for i in range(own.size):
        k = own[i]
        where[first[k] + (filled[k] if is_ray[k] else before[at[i]])] = i
        filled[k] += 1


@kernel
def _split(order, owner, corners, normals, is_thick):
    """Assign a plane number to each triangle; only thick surfaces have several."""
    plane = np.full(order.size, -1, np.int64)
    n = 0
    i = 0
    while i < order.size:
        j = i
        while j < order.size and owner[order[j]] == owner[order[i]]:
            j += 1
        for k in range(i, j):
            f = order[k]
            if plane[f] >= 0:
                continue
            plane[f] = n
            for other in range(k + 1, j):
                g = order[other]
                if plane[g] >= 0:
                    continue
                far = 0.0
                for m in range(3):
                    height = 0.0
                    for q in range(3):
                        height += (corners[g, m, q] - corners[f, 0, q]) * normals[f, q]
                    far = max(far, abs(height))
                if far <= _FLAT or is_thick[owner[f]]:
                    plane[g] = n
            n += 1
        i = j
    return plane


@kernel
def _make_hulls(own, square, corner, n):
    """Find the bounding octagons of the patches' samples, with their corners."""
    low = np.full((n, 4), np.inf)
    high = np.full((n, 4), -np.inf)
    for i in range(own.size):
        u = np.float64(square[i, 0] - corner[own[i], 0])
        v = np.float64(square[i, 1] - corner[own[i], 1])
        ways = (u, v, u + v, u - v)
        for k in range(4):
            low[own[i], k] = min(low[own[i], k], ways[k])
            high[own[i], k] = max(high[own[i], k], ways[k])
    hull = np.zeros((n, 21))
    for i in range(n):
        u0, v0, a0, b0 = low[i]
        u1, v1, a1, b1 = high[i]
        hull[i, 0], hull[i, 1], hull[i, 2], hull[i, 3] = a0, a1, b0, b1
        hull[i, 4], hull[i, 5] = a0 - v0, v0
        hull[i, 6], hull[i, 7] = v0 + b1, v0
        hull[i, 8], hull[i, 9] = u1, u1 - b1
        hull[i, 10], hull[i, 11] = u1, a1 - u1
        hull[i, 12], hull[i, 13] = a1 - v1, v1
        hull[i, 14], hull[i, 15] = v1 + b0, v1
        hull[i, 16], hull[i, 17] = u0, u0 - b0
        hull[i, 18], hull[i, 19] = u0, a0 - u0
        hull[i, 20] = 1e-9 * (1.0 + u1 + v1)
    return hull
