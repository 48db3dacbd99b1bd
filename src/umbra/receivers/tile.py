"""The protocols of a tile of receivers, and of what counts shadows on it."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.cpu.shares import Membership
from umbra.rays.face_tree import FaceTree
from umbra.scene.grid import Places
from umbra.volume.adjacency import Caster

__all__ = ["Counter", "PieceShares", "Tile"]


class Counter(Protocol):
    """Counter of suns' shadows on receivers."""

    def add_weights(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = ...,
    ) -> None:
        """Add the weights (n, k) of the suns that leave each receiver in shadow to its sums."""

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each sun the receivers in shadow, cast or attached."""


class PieceShares(Protocol):
    """Counter of the shadows of pieces of the casters, each as if it stood alone."""

    def add_shares(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.float64],
        membership: Membership,
        cast: NDArray[np.float32],
        sole: NDArray[np.float32],
    ) -> None:
        """Add at most eight suns to groups' hours, as ``umbra.cpu.shares.add_group_shares``."""


class Tile(Protocol):
    """Some of a study's receivers, to be counted for any caster."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the receivers."""

    @property
    def casting(self) -> Casting:
        """The casters of its scene."""

    @property
    def places(self) -> Places:
        """The receivers as points."""

    @property
    def tree(self) -> FaceTree:
        """Bounding volume hierarchy over the casting faces."""

    def make_counter(self) -> Counter:
        """Return a counter of all casters and of attached shadow."""

    def count_many(self, lights: int) -> Counter | None:
        """Return a counter of all casters that is faster for n lights; None: the usual one."""

    def find_cast(self, caster: Caster, suns: NDArray[np.float64]) -> tuple[Any, NDArray[np.uint8]]:
        """Find the shadows of one caster alone: the receivers in reach, and their masks."""

    def count_pieces(self, pieces: Sequence[Sequence[int]]) -> PieceShares | None:
        """
        Return a counter of all pieces of the casters at once, given as indices of parts.

        None if it is as quick to find each by ``find_cast``.
        """

    def with_casters(self, parts: Sequence[int] | None = None) -> "Tile":
        """Return the same receivers with other parts casting; all but canopies by default."""

    def find_parts(self) -> NDArray[np.intp]:
        """Return each receiver's part; -1 where it has none."""

    def find_below(self, parts: Sequence[int]) -> NDArray[np.bool_]:
        """
        Find the receivers that are none where some parts of ``scene.whole`` stand over them.

        Samples, which are judged under a roof and in a wall, too, are never among them.
        """
