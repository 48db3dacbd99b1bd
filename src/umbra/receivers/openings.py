"""Openings in walls: what a pane behind one sees of the sky through the wall's outer face."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.scene.named_places import Window

__all__ = ["Openings"]


@dataclass(frozen=True, eq=False)
class Openings:
    """
    The opening before each of n points.

    Parameters
    ----------
    axes : (n, 3, 3) float64
        Right, up and outward.
    places : (n, 3) float64
        Each point's place in its opening: right and up of the middle, and its depth [m].
    halves : (n, 2) float64
        Half the width and the height [m].
    """

    axes: NDArray[np.float64]
    places: NDArray[np.float64]
    halves: NDArray[np.float64]

    @classmethod
    def of(
        cls, windows: Sequence[Window], owner: NDArray[np.integer], across: NDArray[np.float64]
    ) -> "Openings":
        """Return the openings of points on windows, given right and up of their middles (n, 2)."""
        axes = np.array([[*window.axes, window.normal] for window in windows])[owner]
        depth = np.array([window.reveal or 0.0 for window in windows])[owner]
        halves = np.array([[window.width / 2, window.height / 2] for window in windows])[owner]
        return cls(axes, np.column_stack([across, depth]), halves)

    @property
    def are_deep(self) -> bool:
        """Whether any pane lies behind its wall's face."""
        return bool((self.places[:, 2] > 0).any())

    @classmethod
    def join(cls, several: "Sequence[Openings]") -> "Openings":
        """Return the openings of the points of several, one after the other."""
        return cls(*(
            np.concatenate([getattr(one, name) for one in several])
            for name in ("axes", "places", "halves")
        ))  # fmt: skip

    def pick(self, which: slice | NDArray) -> "Openings":
        """Return the openings of some of the points."""
        return Openings(self.axes[which], self.places[which], self.halves[which])

    def find_framed(self, ways: NDArray[np.float64]) -> NDArray[np.bool_]:
        """
        Find which points see the frame of their opening on a way toward a light, (m, n).

        Parameters
        ----------
        ways : (m, n, 3) or (m, 1, 3) float64
        """
        shape = (len(ways), *self.places.shape)
        right, up, out = (
            np.einsum("mnk,nk->mn", np.broadcast_to(ways, shape), self.axes[:, k]) for k in range(3)
        )
        at_x, at_y, depth = self.places.T
        # The way meets the opening's plane at depth / out along it.
        scale = np.divide(depth, out, out=np.zeros_like(out), where=out > 0)
        half_x, half_y = self.halves.T
        is_out = (np.abs(at_x + scale * right) > half_x) | (np.abs(at_y + scale * up) > half_y)
        return np.asarray(is_out & (depth > 0))
