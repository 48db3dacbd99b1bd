"""
Dual segments in blocks of 16, sifted in float32; and the exact question for the rest.

Ends are rounded to float32, and a margin says how much that and all other rounding
can matter. Segments that end farther than it from the light's plane are decided; the
few others, and edges that are no segments, are asked exactly what brute force asks
every edge. So answers are identical, to the last edge.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.volume.adjacency import Caster
from umbra.volume.duals import STRETCH, Duals, Fit, Plane

__all__ = ["WIDTH", "Segments", "Tree", "make_segments", "sift_block"]

WIDTH = 16
"""Segments in a block: one register or a few of them hold a row."""


@dataclass(frozen=True, eq=False)
class Segments:
    """
    A caster's edges in dual space.

    Parameters
    ----------
    fit : Fit
    always : (n_always,) int32
        Edges that are no segments.
    numbers : (n_blocks, 16) int32
        The edge at each place of a block, -1 for none.
    blocks : (n_blocks, 8, 16) float32
        Four rows of the segments' middles, then four of the way from the middle to
        the first end; NaN, which no test lets pass, where there is none.
    """

    fit: Fit
    always: NDArray[np.int32]
    numbers: NDArray[np.int32]
    blocks: NDArray[np.float32]

    def decide(
        self,
        caster: Caster,
        light: NDArray[np.float64],
        codes: NDArray[np.int32],
        unsure: NDArray[np.int32],
    ) -> NDArray[np.int32]:
        """Ask what is not yet sure and what is no segment; return all codes, ascending."""
        rest = np.concatenate([unsure, self.always])
        asked = np.zeros(len(rest) + 1, np.int32)
        n = _ask_edges(
            rest, light, caster.planes, caster.edge_faces, caster.turn,
            caster.component, caster.is_closed, asked,
        )  # fmt: skip
        return np.sort(np.concatenate([codes, asked[:n]]))


class Tree(ABC):
    """What finds the segments that a plane cuts."""

    segments: Segments

    @abstractmethod
    def sift(
        self, plane: Plane, numbers: NDArray[np.int32] | None = None
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], int]:
        """
        Find the segments that a light's plane cuts.

        Parameters
        ----------
        plane : Plane
        numbers : (n_blocks, 16) int32, optional
            What to call segments instead of by the numbers of their edges.

        Returns
        -------
        codes : (n,) int32
            As in ``Silhouettes``.
        unsure : (k,) int32
            Edges yet to be asked.
        tested : int
            Places of segments that were looked at.
        """

    def count_tested(self, light: NDArray[np.float64]) -> int | None:
        """Count the edges looked at for a light's silhouette; None if it is out of range."""
        plane = self.segments.fit.place(light)
        if plane is None:
            return None
        return self.sift(plane)[2] + len(self.segments.always)

    @property
    def n_bytes(self) -> int:
        """What the tree takes in memory [byte]."""
        held = [*vars(self).values(), *vars(self.segments).values()]
        return sum(array.nbytes for array in held if isinstance(array, np.ndarray))

    def find(self, caster: Caster, light: NDArray[np.float64]) -> NDArray[np.int32] | None:
        """
        Find the silhouette of one light (4,): codes as in ``Silhouettes``, ascending.

        What is near each other in space lies near in memory, too. None if the light is out of the
        tree's range. The caster is the one that the tree was made of, components opened or not.
        """
        plane = self.segments.fit.place(light)
        if plane is None:
            return None
        codes, unsure, _ = self.sift(plane)
        return self.segments.decide(caster, light, codes, unsure)


def make_segments(caster: Caster, duals: Duals, numbers: NDArray[np.int32]) -> Segments:
    """Lay segments out in blocks; ``numbers`` (n_blocks, 16) are edges, -1 for none."""
    blocks = np.full((len(numbers), 8, WIDTH), np.nan, np.float32)
    _lay_out(duals.points, numbers, caster.edge_faces, caster.turn, blocks)
    return Segments(duals.fit, duals.always, numbers, blocks)


@njit(cache=True, nogil=True, parallel=True, boundscheck=False)
def _lay_out(points, numbers, edge_faces, turn, blocks):
    at_once = STRETCH // WIDTH
    for stretch in prange((numbers.shape[0] + at_once - 1) // at_once):
        for block in range(stretch * at_once, min(numbers.shape[0], (stretch + 1) * at_once)):
            for i in range(WIDTH):
                edge = numbers[block, i]
                if edge < 0:
                    continue
                a, b = edge_faces[edge, 0], edge_faces[edge, 1]
                sign = -1.0 if turn[edge] else 1.0
                for axis in range(4):
                    one = points[a, axis]
                    two = sign * points[b, axis]
                    blocks[block, axis, i] = 0.5 * (one + two)
                    blocks[block, 4 + axis, i] = 0.5 * (one - two)


@njit(cache=True, nogil=True, boundscheck=False)
def sift_block(block, numbers, low, high, normal, margin, inside, lit, codes, n, unsure, k):
    """
    Find the segments of a block that a plane cuts, and those where it is not sure.

    With m and h the plane's distances of middle and half, the ends lie at m + h and
    m - h, on different sides if abs(h) > abs(m), and h tells on which the first one is.
    Only places from ``low`` up to ``high`` are asked; ``inside`` and ``lit`` (16,) are scratch.
    ``codes`` are written from n on, as in ``Silhouettes`` (one place more than is kept), edges
    that are ``unsure`` from k on; returns n and k moved on.
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


@njit(cache=True, nogil=True, boundscheck=False)
def _ask_edges(edges, light, planes, edge_faces, turn, component, is_closed, codes):
    """
    Ask edges one by one whether they are in the silhouette; return how many codes were written.

    The sums must be formed as in ``find_lit``, and edge-on faces of open components
    left out as in brute force, for answers to be the same to the last bit.
    """
    l0, l1, l2, l3 = light[0], light[1], light[2], light[3]
    m = 0
    for i in range(edges.size):
        edge = edges[i]
        a = edge_faces[edge, 0]
        b = edge_faces[edge, 1]
        one = planes[0, a] * l0 + planes[1, a] * l1 + planes[2, a] * l2 + planes[3, a] * l3
        two = planes[0, b] * l0 + planes[1, b] * l1 + planes[2, b] * l2 + planes[3, b] * l3
        lit = one > 0.0
        code = edge << 2 | np.int32(lit)
        found = lit ^ (two > 0.0) ^ turn[edge]
        if (one == 0.0 or two == 0.0) and not is_closed[component[min(a, b)]]:
            # Only the other face adds: a as it stands; b along the edge against a if the
            # pair is consistently wound, along it with a if not.
            found = (one == 0.0) ^ (two == 0.0)
            code |= 2
            if one == 0.0:
                code = edge << 2 | 2 | np.int32((two > 0.0) == turn[edge])
        codes[m] = code
        m += found
    return m
