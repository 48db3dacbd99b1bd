"""Which receivers count in a report's figures, and what each stands for."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.study import PointStudy, Study

__all__ = ["Counted", "find_counted"]


@dataclass(frozen=True, eq=False)
class Counted:
    """
    Receivers that mean something, with their weights.

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
        """Give what those stand for that count and pass a test."""
        return float(self.weight[self.which & test].sum())

    def average(self, values: NDArray) -> float:
        """Give the mean over what they stand for."""
        return float(np.average(values[self.which], weights=self.weight[self.which]))


def find_counted(study: Study | PointStudy) -> Counted | None:
    """
    Choose the receivers whose hours mean something: not the ground under buildings.

    Parameters
    ----------
    study : Study or PointStudy

    Returns
    -------
    counted : Counted, optional
        None where no receiver counts, and of a camera's picture: its pixels have no area.
    """
    which = np.isfinite(study.shadow_hours)
    weight = np.ones(which.shape)
    if isinstance(study, PointStudy):
        if study.receivers == "points":
            return Counted(which, weight, "points", "points")
        return Counted(which, np.asarray(study.more["area"][1]), "m²", "sampled surfaces")
    if study.receivers == "camera":
        return None
    which &= study.is_of_model
    what = "all that is seen of the model, as it is seen"
    if study.receivers == "ground":
        which &= study.heights <= study.ground + 1e-6
        what = "open ground, not under buildings"
    elif study.receivers == "top":
        what = "all that is seen from above"
    weight *= study.grid.dx * study.grid.dy
    return Counted(which, weight, "m²", what) if which.any() else None
