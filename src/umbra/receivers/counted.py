"""Receivers that count in a study's figures, and their weights."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Counted"]


@dataclass(frozen=True, eq=False)
class Counted:
    """
    Receivers with meaningful hours, and their weights.

    Parameters
    ----------
    which : (...) bool
        Selection of the study's receivers.
    weight : (...) float64
        Area or number that each represents.
    unit : str
        Unit of the weights.
    what : str
        Description of them all.
    """

    which: NDArray[np.bool_]
    weight: NDArray[np.float64]
    unit: str
    what: str

    @property
    def whole(self) -> float:
        """Total weight."""
        return float(self.weight[self.which].sum())

    def add_up(self, test: NDArray[np.bool_]) -> float:
        """Return the weight of the receivers that pass a test."""
        return float(self.weight[self.which & test].sum())

    def average(self, values: NDArray) -> float:
        """Return the weighted mean."""
        return float(np.average(values[self.which], weights=self.weight[self.which]))
