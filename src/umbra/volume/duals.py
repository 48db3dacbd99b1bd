"""
Edges in dual space, where the silhouette is the set of segments that a plane cuts.

A face's plane, four numbers, is a point; a light is a plane through the origin; a face is lit if
its point lies on the light's positive side. A pair of faces is in the silhouette if the segment
between their points is cut, which a tree over the segments finds without testing all of them. Two
kinds of pairs differ:

- A turned pair is in the silhouette if its faces are *equally* lit. That is a
  segment, too: to the second point mirrored at the origin.
- Borders are always in the silhouette; faces whose plane is NaN or nearly 0 have
  no direction. Edges of both kinds are listed separately and always tested.

Segments are stored in blocks of 16 in float32 and tested there; a margin bounds the effect of all
rounding. Segments with ends farther than the margin from the light's plane are decided; the few
others, and edges that are no segments, get the exact test of brute force. So results are identical.

Sources: Hertzmann and Zorin 2000, section 4; Wallner 2008, section 3, with the corrections of
docs/papers.md: duals of faces, scaled about the centre.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import inlined, kernel, run_shared, take_next
from umbra.volume.adjacency import Caster

__all__ = [
    "STRETCH",
    "WIDTH",
    "Duals",
    "Fit",
    "Plane",
    "Segments",
    "Tree",
    "find_key",
    "make_duals",
    "make_segments",
    "sift_block",
]

STRETCH = 4096
"""Items per work item of a thread: scheduling single faces would cost more than the work."""

_LEAST, _MOST = 1e-100, 1e100  # lengths whose products neither underflow nor overflow


@dataclass(frozen=True, eq=False)
class Plane:
    """
    A light in dual space.

    The largest component of the normal (4,) float32 is 1; where ``abs(point @ normal)`` exceeds the
    margin, its sign is right in float32.
    """

    normal: NDArray[np.float32]
    margin: np.float32


@dataclass(frozen=True, eq=False)
class Fit:
    """
    Scaling of a caster into the cube from -1 to 1.

    ``centre`` is that of the used vertices' bounds; no vertex is farther from it than ``reach``
    [m].
    """

    centre: NDArray[np.float64]
    reach: float

    def place(self, light: NDArray[np.float64]) -> Plane | None:
        """
        Return a light (4,) as a plane; None if products with it might underflow or overflow.

        Its margin is twice a bound of rounding errors for points in the cube: some 16 float32
        roundings of numbers up to ``sum(abs(normal))``; and in float64 the roundings of the
        four-term sum that decides whether a face is lit, perhaps far from the origin.
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
    """Dual points of a caster's faces, and segments of its pairs."""

    fit: Fit
    # (n_faces + 1, 4) unit normal, and the plane's signed distance from the centre divided by the
    # reach; NaN for planes without direction
    points: NDArray[np.float64]
    edges: NDArray[np.int32]  # (n,) pairs that are segments
    always: NDArray[np.int32]  # (n_always,) the other pairs


def make_duals(caster: Caster) -> Duals:
    """Make the dual points and segments of a caster."""
    used = np.zeros(len(caster.vertices), np.bool_)
    used[caster.faces.ravel()] = True
    places = caster.vertices[used] if used.any() else np.zeros((1, 3))
    low, high = places.min(0), places.max(0)
    fit = Fit((low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, _LEAST))
    points = np.full((caster.planes.shape[1], 4), np.nan)
    stretches = -(-len(points) // STRETCH)
    run_shared(stretches, _place_points, caster.planes, fit.centre, fit.reach, points)
    loose = np.zeros(len(caster.edges), np.bool_)
    _find_loose(np.isnan(points[:, 0]), caster.edge_faces, loose)
    return Duals(
        fit,
        points,
        np.flatnonzero(~loose).astype(np.int32),
        np.flatnonzero(loose).astype(np.int32),
    )


@kernel
def _place_points(planes, centre, reach, points, taken):
    while True:
        stretch = take_next(taken)
        if stretch >= (points.shape[0] + STRETCH - 1) // STRETCH:
            return
        for face in range(stretch * STRETCH, min(points.shape[0], (stretch + 1) * STRETCH)):
            x, y, z = planes[0, face], planes[1, face], planes[2, face]
            length = np.sqrt(x * x + y * y + z * z)
            if _LEAST < length < _MOST:
                away = planes[3, face] + x * centre[0] + y * centre[1] + z * centre[2]
                points[face, 0] = x / length
                points[face, 1] = y / length
                points[face, 2] = z / length
                points[face, 3] = away / length / reach


@partial(kernel, boundscheck=False)
def _find_loose(has_no_point, edge_faces, loose):
    for edge in range(loose.size):
        a, b = edge_faces[edge, 0], edge_faces[edge, 1]
        loose[edge] = a == b or has_no_point[a] or has_no_point[b]


@kernel
def find_key(x, y, z, w):
    """
    Find a point's key on the Morton curve through the cube, uint64.

    It has 16 digits of four bits, highest first: bit i of a digit is the half, along axis i, of the
    cell that the previous digits select.
    """
    key = np.uint64(0)
    for axis, part in enumerate((x, y, z, w)):
        cell = np.uint64(min(max((part + 1.0) * 32768.0, 0.0), 65535.0))
        # Three zero bits between any two of the 16.
        cell = (cell | (cell << np.uint64(24))) & np.uint64(0x000000FF000000FF)
        cell = (cell | (cell << np.uint64(12))) & np.uint64(0x000F000F000F000F)
        cell = (cell | (cell << np.uint64(6))) & np.uint64(0x0303030303030303)
        cell = (cell | (cell << np.uint64(3))) & np.uint64(0x1111111111111111)
        key |= cell << np.uint64(axis)
    return key


WIDTH = 16
"""Segments per block: a row fits in one or a few registers."""


@dataclass(frozen=True, eq=False)
class Segments:
    """Edges of a caster in dual space."""

    fit: Fit
    always: NDArray[np.int32]  # (n_always,) edges that are no segments
    numbers: NDArray[np.int32]  # (n_blocks, 16) edge index at each slot of a block, -1 for none
    # (n_blocks, 8, 16) four rows of the segments' midpoints, then four of the vectors from there to
    # the first end; NaN, which fails every test, in empty slots
    blocks: NDArray[np.float32]

    def decide(
        self,
        caster: Caster,
        light: NDArray[np.float64],
        codes: NDArray[np.int32],
        unsure: NDArray[np.int32],
    ) -> NDArray[np.int32]:
        """Test the unsure edges and the edges that are no segments; return all codes, ascending."""
        rest = np.concatenate([unsure, self.always])
        tested = np.zeros(len(rest) + 1, np.int32)
        n = _ask_edges(
            rest, light, caster.planes, caster.edge_faces, caster.turn,
            caster.component, caster.is_closed, tested,
        )  # fmt: skip
        return np.sort(np.concatenate([codes, tested[:n]]))


class Tree(ABC):
    """Search structure for the segments that a plane cuts."""

    segments: Segments

    @abstractmethod
    def sift(
        self, plane: Plane, numbers: NDArray[np.int32] | None = None
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], int]:
        """
        Find the segments that a light's plane cuts.

        Returns codes as in ``Silhouettes``, unsure edges, and the number of segment slots tested.
        ``numbers`` (n_blocks, 16) replace the edge indices in the results.
        """

    def count_tested(self, light: NDArray[np.float64]) -> int | None:
        """Count the edges tested for a light's silhouette; None if the light is out of range."""
        plane = self.segments.fit.place(light)
        if plane is None:
            return None
        return self.sift(plane)[2] + len(self.segments.always)

    @property
    def n_bytes(self) -> int:
        """Memory of the tree [byte]."""
        held = [*vars(self).values(), *vars(self.segments).values()]
        return sum(array.nbytes for array in held if isinstance(array, np.ndarray))

    def find(self, caster: Caster, light: NDArray[np.float64]) -> NDArray[np.int32] | None:
        """
        Find the silhouette of one light (4,): codes as in ``Silhouettes``, ascending.

        Edges close in space are close in the list. None if the light is out of the tree's range.
        The caster is the tree's, components opened or not.
        """
        plane = self.segments.fit.place(light)
        if plane is None:
            return None
        codes, unsure, _ = self.sift(plane)
        return self.segments.decide(caster, light, codes, unsure)


def make_segments(caster: Caster, duals: Duals, numbers: NDArray[np.int32]) -> Segments:
    """Arrange segments in blocks; ``numbers`` (n_blocks, 16) are edges, -1 for none."""
    blocks = np.full((len(numbers), 8, WIDTH), np.nan, np.float32)
    given = duals.points, numbers, caster.edge_faces, caster.turn, blocks
    run_shared(-(-len(numbers) // (STRETCH // WIDTH)), _lay_out, *given)
    return Segments(duals.fit, duals.always, numbers, blocks)


@partial(kernel, boundscheck=False)
def _lay_out(points, numbers, edge_faces, turn, blocks, taken):
    at_once = STRETCH // WIDTH
    while True:
        stretch = take_next(taken)
        if stretch >= (numbers.shape[0] + at_once - 1) // at_once:
            return
        for block in range(stretch * at_once, min(numbers.shape[0], (stretch + 1) * at_once)):
            for i in range(WIDTH):
                edge = numbers[block, i]
                if edge < 0:
                    continue
                a, b = edge_faces[edge, 0], edge_faces[edge, 1]
                sign = -1.0 if turn[edge] else 1.0
                for axis in range(4):
                    start = points[a, axis]
                    end = sign * points[b, axis]
                    blocks[block, axis, i] = 0.5 * (start + end)
                    blocks[block, 4 + axis, i] = 0.5 * (start - end)


@partial(inlined, boundscheck=False)
def sift_block(block, numbers, low, high, normal, margin, inside, lit, codes, n, unsure, k):
    """
    Find the segments of a block that a plane cuts, and the unsure ones.

    With m the midpoint's distance from the plane and h the half vector's, the ends lie at m + h and
    m - h, on different sides if abs(h) > abs(m); the sign of h is the first end's side. Only slots
    from ``low`` to ``high`` are tested; ``inside`` and ``lit`` (16,) are scratch. ``codes`` are
    written from n on, as in ``Silhouettes`` (with one extra entry), ``unsure`` edges from k on;
    returns the new n and k.
    """
    x, y, z, w = normal[0], normal[1], normal[2], normal[3]
    close = 0
    for i in range(WIDTH):
        middle = block[0, i] * x + block[1, i] * y + block[2, i] * z + block[3, i] * w
        half = block[4, i] * x + block[5, i] * y + block[6, i] * z + block[7, i] * w
        inside[i] = abs(half) - abs(middle)
        lit[i] = half > 0
        close += abs(inside[i]) <= margin
    for i in range(low, high):
        codes[n] = numbers[i] << 2 | lit[i]
        n += inside[i] > margin
    if close:
        for i in range(low, high):
            unsure[k] = numbers[i]
            k += abs(inside[i]) <= margin
    return n, k


@partial(kernel, boundscheck=False)
def _ask_edges(edges, light, planes, edge_faces, turn, component, is_closed, codes):
    """
    Test whether edges are in the silhouette; return the number of codes written.

    Sums are formed as in ``find_lit``, and edge-on faces of open components are left out as in
    brute force, so that results are bit-identical.
    """
    l0, l1, l2, l3 = light[0], light[1], light[2], light[3]
    m = 0
    for i in range(edges.size):
        edge = edges[i]
        a = edge_faces[edge, 0]
        b = edge_faces[edge, 1]
        side_a = planes[0, a] * l0 + planes[1, a] * l1 + planes[2, a] * l2 + planes[3, a] * l3
        side_b = planes[0, b] * l0 + planes[1, b] * l1 + planes[2, b] * l2 + planes[3, b] * l3
        lit = side_a > 0.0
        code = edge << 2 | np.int32(lit)
        is_silhouette = lit ^ (side_b > 0.0) ^ turn[edge]
        if (side_a == 0.0 or side_b == 0.0) and not is_closed[component[min(a, b)]]:
            # Only the other face adds: a in its own direction; b opposite to a along the edge if
            # the pair is consistently wound, else the same.
            is_silhouette = (side_a == 0.0) ^ (side_b == 0.0)
            code |= 2
            if side_a == 0.0:
                code = edge << 2 | 2 | np.int32((side_b > 0.0) == turn[edge])
        codes[m] = code
        m += is_silhouette
    return m
