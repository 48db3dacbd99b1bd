"""A proposal among the casters of a tile: what stood there before it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.kind import Tile

__all__ = ["FindParts", "Proposal"]

FindParts = Callable[[Tile | None], Sequence[int]]


@dataclass(frozen=True)
class Proposal:
    """
    Parts of a proposal in a tile's scene, what casts without it, and what it replaces.

    Parameters
    ----------
    find_new, find_before, find_replaced : callable
        Return indices, of the tile's ``scene.whole``, of the proposal's parts, of the casters
        before it, and of what it replaces, casting or not.
    """

    find_new: FindParts
    find_before: FindParts
    find_replaced: FindParts

    @classmethod
    def of(cls, new: Sequence[int], before: Sequence[int], replaced: Sequence[int]) -> "Proposal":
        """Make that of one scene, which all tiles share."""
        return cls(lambda _: new, lambda _: before, lambda _: replaced)

    def find_absent(self, tile: Tile) -> NDArray[np.bool_]:
        """Find the receivers that did not exist before: new ones, and where others stood."""
        absent = np.isin(tile.find_parts(), self.find_new(tile))
        replaced = self.find_replaced(tile)
        return absent | tile.find_below(replaced) if len(replaced) else absent
