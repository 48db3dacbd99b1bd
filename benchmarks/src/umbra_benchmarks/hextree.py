"""
Wallner's hextree: dual space cut into 16 equal cells, each into 16 again; and one of Hough space.

A segment belongs to the smallest cell that holds both its ends, so one that crosses a
wall near the middle of the cube stays near the root and is tested for every light:
with the paper's depth of 4, every sixth on a sphere, and two thirds in a town of
boxes. Only cells that hold something are kept. Kept for comparison; ``DualTree`` is faster.

In Hough space (Olson and Zhang 2006, which Wallner would have tried next) a plane is its point
nearest to the centre, h = -d n, in three dimensions. The planes through a light l are then the
sphere h.l = h.h l_w through the centre, and a pair of faces is in the silhouette if the sphere
parts their points: those of both planes must have the centre on the same side. The other pairs
are tested for every light.

Sources: Wallner 2008, section 3.1, with the signs corrected (docs/papers.md); Olson and Zhang 2006.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel, run_shared, take_next
from umbra.volume.adjacency import Caster
from umbra.volume.duals import (
    STRETCH,
    WIDTH,
    Plane,
    Segments,
    Tree,
    find_key,
    make_duals,
    make_segments,
    sift_block,
)

__all__ = ["Hextree", "HoughTree", "make_hextree", "make_hough_tree"]

DEEPEST = 15


@dataclass(frozen=True, eq=False)
class Hextree(Tree):
    """Cells in dual space, level by level; on each they are half as large as on the last."""

    segments: Segments  # of one cell side by side
    centres: NDArray[np.float32]  # (n_cells, 4)
    # (n_cells, 2) the first cell within each, and the one after the last
    children: NDArray[np.int32]
    # (n_cells, 2) the first place of its own segments, and the one after the last
    owned: NDArray[np.int32]

    def sift(
        self, plane: Plane, numbers: NDArray[np.int32] | None = None
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], int]:
        """Find the segments that a light's plane cuts; see ``Tree.sift``."""
        cut = _cut_cells(self.centres, self.children, plane.normal, plane.margin)
        return _sift(
            cut, self.owned, self.segments.blocks,
            self.segments.numbers if numbers is None else numbers, plane.normal, plane.margin,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class HoughTree(Hextree):
    """Cells in Hough space, eight in each, of which the fourth coordinate says nothing."""

    def sift(
        self, plane: Plane, numbers: NDArray[np.int32] | None = None
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], int]:
        """Find the segments that a light's plane cuts; see ``Tree.sift``."""
        cut = _part_cells(self.centres, self.children, plane.normal, plane.margin)
        return _sift(
            cut, self.owned, self.segments.blocks,
            self.segments.numbers if numbers is None else numbers, plane.normal, plane.margin,
        )  # fmt: skip


def make_hextree(caster: Caster, depth: int = 4) -> Hextree:
    """
    Sort the edges of a caster into cells of dual space.

    The cube is cut ``depth`` times at most, up to 15; 4 in the paper.
    """
    return Hextree(*_make_cells(caster, depth, _find_cells))


def make_hough_tree(caster: Caster, depth: int = 6) -> HoughTree:
    """Sort the edges of a caster into cells of Hough space, cut ``depth`` times at most."""
    return HoughTree(*_make_cells(caster, depth, _find_hough_cells))


def _make_cells(
    caster: Caster, depth: int, find: Callable[..., None]
) -> tuple[Segments, NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]:
    duals = make_duals(caster)
    n = len(duals.edges)
    keys, levels = np.zeros(n, np.uint64), np.zeros(n, np.int32)
    depth = min(max(depth, 0), DEEPEST)
    given = duals.points, duals.edges, caster.edge_faces, caster.turn, depth, keys, levels
    run_shared(-(-len(duals.edges) // STRETCH), find, *given)
    order = np.lexsort((keys, levels))
    keys, levels = keys[order], levels[order]
    numbers = np.full(((n + WIDTH - 1) // WIDTH, WIDTH), -1, np.int32)
    numbers.ravel()[:n] = duals.edges[order]

    # On each level are the cells that own segments there or on any deeper level.
    ends = np.searchsorted(levels, np.arange(depth + 2))
    cells = [np.unique(_cut_short(keys[ends[level] :], level)) for level in range(depth + 1)]
    starts = np.cumsum([0] + [len(some) for some in cells])
    owned, children = np.zeros((2, starts[-1], 2), np.int32)
    for level, some in enumerate(cells):
        mine = slice(starts[level], starts[level + 1])
        held = _cut_short(keys[ends[level] : ends[level + 1]], level)
        owned[mine] = ends[level] + _find_ranges(held, some)
        if level < depth:
            parents = cells[level + 1] >> np.uint64(4)
            children[mine] = starts[level + 1] + _find_ranges(parents, some)
    centres = np.concatenate([_find_centres(some, level) for level, some in enumerate(cells)])
    return make_segments(caster, duals, numbers), centres, children, owned


def _cut_short(keys: NDArray[np.uint64], level: int) -> NDArray[np.uint64]:
    """Return the first digits of keys: the cells that they lie in."""
    return keys >> np.uint64(64 - 4 * level) if level else np.zeros_like(keys)


def _find_ranges(held: NDArray[np.uint64], wanted: NDArray[np.uint64]) -> NDArray[np.intp]:
    """Find from where to where ascending numbers hold the wanted ones, (n, 2)."""
    return np.stack([np.searchsorted(held, wanted, side) for side in ("left", "right")], 1)


def _find_centres(cells: NDArray[np.uint64], level: int) -> NDArray[np.float32]:
    """Return the centres of cells from the digits of their keys, (n, 4) float32."""
    centres = np.zeros((len(cells), 4), np.float32)
    for cut in range(1, level + 1):
        digit = cells >> np.uint64(4 * (level - cut))
        for axis in range(4):
            upper = (digit >> np.uint64(axis)) & np.uint64(1)
            centres[:, axis] += np.where(upper, 0.5**cut, -(0.5**cut)).astype(np.float32)
    return centres


@partial(kernel, boundscheck=False)
def _find_cells(points, edges, edge_faces, turn, depth, keys, levels, taken):
    """Find the level of the smallest cell that holds a segment, and its first end's key."""
    stretch = take_next(taken)
    while stretch * STRETCH < edges.size:
        for i in range(stretch * STRETCH, min(edges.size, (stretch + 1) * STRETCH)):
            a = points[edge_faces[edges[i], 0]]
            b = points[edge_faces[edges[i], 1]]
            sign = -1.0 if turn[edges[i]] else 1.0
            one = find_key(a[0], a[1], a[2], a[3])
            two = find_key(sign * b[0], sign * b[1], sign * b[2], sign * b[3])
            level = 0
            while level < depth and (one ^ two) >> np.uint64(60 - 4 * level) == 0:
                level += 1
            keys[i] = one
            levels[i] = level
        stretch = take_next(taken)


@partial(kernel, boundscheck=False)
def _find_hough_cells(points, edges, edge_faces, turn, depth, keys, levels, taken):
    """As ``_find_cells``, in Hough space; pairs that no sphere parts stay at the root."""
    stretch = take_next(taken)
    while stretch * STRETCH < edges.size:
        for i in range(stretch * STRETCH, min(edges.size, (stretch + 1) * STRETCH)):
            a = points[edge_faces[edges[i], 0]]
            b = points[edge_faces[edges[i], 1]]
            one = find_key(-a[3] * a[0], -a[3] * a[1], -a[3] * a[2], -1.0)
            two = find_key(-b[3] * b[0], -b[3] * b[1], -b[3] * b[2], -1.0)
            level = 0
            if a[3] * b[3] * (-1.0 if turn[edges[i]] else 1.0) > 0.0:
                while level < depth and (one ^ two) >> np.uint64(60 - 4 * level) == 0:
                    level += 1
            keys[i] = one
            levels[i] = level
        stretch = take_next(taken)


@partial(kernel, boundscheck=False)
def _cut_cells(centres, children, normal, margin):
    """Follow the cells of dual space that the plane cuts from level to level."""
    x, y, z, w = normal[0], normal[1], normal[2], normal[3]
    half = abs(x) + abs(y) + abs(z) + abs(w)
    cut = np.empty(centres.shape[0] + 1, np.int32)
    cut[0] = 0
    first = 0
    n = min(1, centres.shape[0])
    while first < n:
        # cut[first:n] are cells of one level, cut[n:m] become those of the next.
        half *= 0.5
        m = n
        for q in range(first, n):
            for cell in range(children[cut[q], 0], children[cut[q], 1]):
                centre = centres[cell]
                middle = centre[0] * x + centre[1] * y + centre[2] * z + centre[3] * w
                cut[m] = cell
                m += abs(middle) <= half + margin
        first, n = n, m
    return cut[:n]


@partial(kernel, boundscheck=False)
def _part_cells(centres, children, normal, margin):
    """Follow the cells of Hough space that the light's sphere meets from level to level."""
    cut = np.empty(centres.shape[0] + 1, np.int32)
    cut[0] = 0
    first = 0
    n = min(1, centres.shape[0])
    half, w = np.float32(1.0), normal[3]
    while first < n:
        half *= np.float32(0.5)
        m = n
        for q in range(first, n):
            for cell in range(children[cut[q], 0], children[cut[q], 1]):
                # The range of h.l - h.h w over the cell is the sum of those along its axes.
                least = most = np.float32(0.0)
                for axis in range(3):
                    low, high = centres[cell, axis] - half, centres[cell, axis] + half
                    at_low = low * (normal[axis] - low * w)
                    at_high = high * (normal[axis] - high * w)
                    under, over = min(at_low, at_high), max(at_low, at_high)
                    if w != 0.0:
                        top = 0.5 * normal[axis] / w
                        if low < top < high:
                            under = min(under, top * (normal[axis] - top * w))
                            over = max(over, top * (normal[axis] - top * w))
                    least += under
                    most += over
                cut[m] = cell
                m += least <= margin and most >= -margin
        first, n = n, m
    return cut[:n]


@partial(kernel, boundscheck=False)
def _sift(cut, owned, segments, numbers, normal, margin):
    """Test the segments of cells."""
    places = 0
    for cell in cut:
        places += owned[cell, 1] - owned[cell, 0]
    inside, lit = np.empty(WIDTH, np.float32), np.empty(WIDTH, np.int32)
    codes = np.empty(places + 1, np.int32)
    unsure = np.empty(places + 1, np.int32)
    m, k = 0, 0
    for cell in cut:
        place, end = owned[cell, 0], owned[cell, 1]
        while place < end:
            block, low = place // WIDTH, place % WIDTH
            high = min(WIDTH, low + end - place)
            m, k = sift_block(
                segments[block], numbers[block], low, high,
                normal, margin, inside, lit, codes, m, unsure, k,
            )  # fmt: skip
            place += high - low
    return codes[:m], unsure[:k], places
