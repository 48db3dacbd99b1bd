"""
Following the silhouette of a light, or a caster, that moves in small steps.

Ends of dual segments lie within sqrt(2) of the origin, so when a light's plane turns by
some distance, no end comes nearer to it than by 1.5 times that. The segments within
a reach of the plane are kept, and only they are tested until the light has moved
farther than the reach allows; then the segments near its new place are kept. The reach is
chosen for a few steps as long as the last. A caster that moves sees its light move.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.volume.adjacency import Caster
from umbra.volume.duals import WIDTH, Plane, Segments, Tree, sift_block

__all__ = ["Follower"]

_STEPS = 8  # that segments are held for
_FARTHEST = 0.01  # beyond, so much would be held that the tree is as fast


class Follower:
    """
    Find the silhouettes of lights that are near each other, one after another.

    Answers are those of brute force, whatever the steps. With 1.3M triangles it is twice
    as fast as the tree for steps up to 0.0003 (in radians, for the sun), and as fast as
    the tree from 0.001 on.

    Parameters
    ----------
    tree : Tree
        Of the caster.
    """

    def __init__(self, tree: Tree) -> None:
        self.tree = tree
        self._last: Plane | None = None
        self._at: Plane | None = None
        self._reach = 0.0  # how far the light may go with what is held
        self._held = tree.segments
        numbers = tree.segments.numbers
        self._places = np.arange(numbers.size, dtype=np.int32).reshape(numbers.shape)

    def find(self, caster: Caster, light: NDArray[np.float64]) -> NDArray[np.int32] | None:
        """
        Find the silhouette of the next light (4,); codes as from ``Tree.find``.

        The caster is the one that the tree was made of, components opened or not.
        """
        plane = self.tree.segments.fit.place(light)
        if plane is None:
            return None
        last, self._last = self._last, plane
        if 1.5 * _measure(plane, self._at) + plane.margin > self._reach:
            reach = 1.5 * _STEPS * _measure(plane, last) + 2 * float(plane.margin)
            if reach > _FARTHEST:
                return self.tree.find(caster, light)
            self._hold(plane, reach)
        held = self._held
        sifted = _sift(held.blocks, held.numbers, plane.normal, plane.margin)
        return held.decide(caster, light, *sifted)

    def _hold(self, plane: Plane, reach: float) -> None:
        """Hold the segments within reach of a plane, and those that it cuts."""
        wide = Plane(plane.normal, np.float32(plane.margin + reach))
        codes, unsure, _ = self.tree.sift(wide, self._places)
        places = np.sort(np.concatenate([codes >> 2, unsure]))
        numbers = np.full(((len(places) + WIDTH - 1) // WIDTH, WIDTH), -1, np.int32)
        blocks = np.full((len(numbers), 8, WIDTH), np.nan, np.float32)
        segments = self.tree.segments
        _pack(segments.blocks, segments.numbers, places, blocks, numbers)
        self._held = Segments(segments.fit, segments.always, numbers, blocks)
        self._at, self._reach = plane, reach


def _measure(one: Plane, two: Plane | None) -> float:
    """Return how far apart planes are; infinite if there is only one."""
    if two is None:
        return np.inf
    return float(np.linalg.norm(one.normal.astype(np.float64) - two.normal))


@njit(cache=True, nogil=True, boundscheck=False)
def _pack(blocks, numbers, places, packed, names):
    """Bring the segments of some places together."""
    for i in range(places.size):
        block, lane = places[i] // WIDTH, places[i] % WIDTH
        names[i // WIDTH, i % WIDTH] = numbers[block, lane]
        for row in range(8):
            packed[i // WIDTH, row, i % WIDTH] = blocks[block, row, lane]


@njit(cache=True, nogil=True, boundscheck=False)
def _sift(blocks, numbers, normal, margin):
    """Sift all blocks."""
    inside, lit = np.empty(WIDTH, np.float32), np.empty(WIDTH, np.int32)
    codes = np.empty(numbers.size + 1, np.int32)
    unsure = np.empty(numbers.size + 1, np.int32)
    m, k = 0, 0
    for block in range(blocks.shape[0]):
        m, k = sift_block(
            blocks[block], numbers[block], 0, WIDTH,
            normal, margin, inside, lit, codes, m, unsure, k,
        )  # fmt: skip
    return codes[:m], unsure[:k]
