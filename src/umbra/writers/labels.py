"""Labels on a plan that keep clear of marks, of one another and, where they can, of lines."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Labels", "list_around"]

_STEP = 0.04  # between the points of lines that labels avoid [inch]
_OFF = 1000.0  # that meeting a line costs more than being far away [inch]


class Labels:
    """
    Room for labels within a box.

    Parameters
    ----------
    box : (4,) tuple
        x, y, width, height [inch].
    """

    def __init__(self, box: tuple[float, float, float, float]) -> None:
        x, y, width, height = box
        self.low, self.high = np.array([x, y]), np.array([x + width, y + height])
        self._taken: list[tuple[NDArray, NDArray]] = []
        self._lines: list[NDArray] = []

    def take(self, low: ArrayLike, high: ArrayLike) -> None:
        """Keep labels out of a box."""
        self._taken.append((np.asarray(low, float), np.asarray(high, float)))

    def avoid(self, lines: Iterable[NDArray]) -> None:
        """Keep labels off lines, each (n, 2) [inch], where there is room."""
        for line in lines:
            steps = np.maximum(np.ceil(np.hypot(*np.diff(line, axis=0).T) / _STEP), 1).astype(int)
            for start, end, count in zip(line[:-1], line[1:], steps, strict=True):
                along = np.arange(count)[:, None] / count
                self._lines.append(start + along * (end - start))

    def find(
        self, middles: NDArray, width: float, height: float, *, may_cross: bool = True
    ) -> NDArray[np.float64] | None:
        """
        Take the first of several places for a label, one off all lines if there is any.

        Parameters
        ----------
        middles : (n, 2) float64
            Middles of the label, the best first [inch].
        width, height : float
        may_cross : bool
            Whether a place on a line will do.

        Returns
        -------
        middle : (2,) float64 or None
            None where none is free.
        """
        if not len(middles):
            return None
        half = np.array([width, height]) / 2
        lows, highs = np.asarray(middles, float) - half, np.asarray(middles, float) + half
        free = ((lows >= self.low) & (highs <= self.high)).all(1)
        for low, high in self._taken:
            free &= ~((lows < high) & (highs > low)).all(1)
        crossed = np.zeros(len(lows))
        if self._lines and free.any():
            points = np.concatenate(self._lines)
            reach = lows.min(0), highs.max(0)
            points = points[((points > reach[0]) & (points < reach[1])).all(1)]
            for k in np.flatnonzero(free):
                crossed[k] = ((points > lows[k]) & (points < highs[k])).all(1).any()
        if not may_cross:
            free &= crossed == 0
        if not free.any():
            return None
        cost = np.where(free, crossed * _OFF + np.arange(len(lows)) / len(lows), np.inf)
        best = int(cost.argmin())
        self.take(lows[best], highs[best])
        return np.asarray(middles, float)[best]


def list_around(
    low: NDArray, high: NDArray, width: float, height: float, away: Sequence[float]
) -> NDArray[np.float64]:
    """Return places (n, 2) of a label around a box: beside, above and below, at its corners."""
    middle, reach = (low + high) / 2, (high - low + (width, height)) / 2
    ways = np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1)], float)
    return np.concatenate([middle + ways * (reach + gap) for gap in away])
