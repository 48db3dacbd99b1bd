"""Which receivers count in a study's figures, and what each stands for."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Counted"]


@dataclass(frozen=True, eq=False)
class Counted:
    """
    Receivers whose hours mean something, with their weights.

    Parameters
    ----------
    which : (...) bool
        Of the study's receivers.
    weight : (...) float64
        What each stands for.
    unit : str
        Of the weights.
    what : str
        All of them, in words.
    """

    which: NDArray[np.bool_]
    weight: NDArray[np.float64]
    unit: str
    what: str

    @property
    def whole(self) -> float:
        """What all stand for."""
        return float(self.weight[self.which].sum())

    def add_up(self, test: NDArray[np.bool_]) -> float:
        """Return what those stand for that count and pass a test."""
        return float(self.weight[self.which & test].sum())

    def average(self, values: NDArray) -> float:
        """Return the mean over what they stand for."""
        return float(np.average(values[self.which], weights=self.weight[self.which]))
