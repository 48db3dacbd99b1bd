"""What a proposal takes from its neighbours, date by date: a limit is one of a date's hours."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["LEAST", "Losses", "is_newly_under"]

GROUND = "ground"
"""The neighbour's name where no part but the ground lost sun."""
LEAST = 1e-4
"""Of an hour: less is rounding."""

Variables = dict[str, tuple[tuple[str, ...], NDArray]]


def is_newly_under(
    sun_hours: NDArray[np.float32], lost: NDArray[np.float32], under: float
) -> NDArray[np.bool_]:
    """
    Tell where a limit was reached before and no longer is, on one date.

    Parameters
    ----------
    sun_hours : (...) float32
        Of the date, after [h].
    lost : (...) float32
        Less than before [h].
    under : float
        [h]
    """
    return (sun_hours < under - LEAST) & (sun_hours + lost >= under - LEAST)


@dataclass(frozen=True, eq=False)
class Losses:
    """
    What a proposal takes from its neighbours.

    Parameters
    ----------
    lost : (...) float32
        Sun less than before, of all dates together [h].
    newly_days : (...) int16
        Number of dates on which a limit was reached before and no longer is.
    is_new : (...) bool
        Receivers that were not there before.
    owner : (...) int
        Whose each receiver is, in ``names``; negative for the ground.
    names : list of str
        Names may repeat: they are one neighbour.
    area : (...) float64 or float
        Of each receiver [m2].
    days : int
        Number of dates.
    lost_by_day : (n_days, ...) float32, optional
    newly_by_day : (n_days, ...) uint8, optional
        Of each date, where they are kept.
    """

    lost: NDArray[np.float32]
    newly_days: NDArray[np.int16]
    is_new: NDArray[np.bool_]
    owner: NDArray[np.signedinteger]
    names: list[str] = field(repr=False)
    area: NDArray[np.float64] | float
    days: int = 1
    lost_by_day: NDArray[np.float32] | None = None
    newly_by_day: NDArray[np.uint8] | None = None

    def variables(self, dims: tuple[str, ...]) -> Variables:
        """
        Give the arrays of ``study.nc``; only neighbours that are touched.

        Those who lose most hours over most of their area stand first.
        """
        nan, left = np.float32(np.nan), ~self.is_new
        newly = left & (self.newly_days > 0)
        labels, mine = self._gather()
        areas = np.broadcast_to(self.area, self.owner.shape)[left]
        whole = np.bincount(mine, areas, len(labels))
        sums = np.bincount(mine, areas * self.lost[left], len(labels))
        order = np.argsort(-sums, kind="stable")
        touched = np.bincount(mine, areas * (self.lost[left] > LEAST), len(labels))
        kept = order[touched[order] > 0]

        def sum_up(lost: NDArray[np.float32], is_newly: NDArray) -> dict[str, NDArray]:
            loss = lost[left]
            most = np.zeros(len(labels))
            np.maximum.at(most, mine, loss)
            figures = {
                "area_touched": np.bincount(mine, areas * (loss > LEAST), len(labels)),
                "area_newly_under": np.bincount(mine, areas * is_newly[left], len(labels)),
                "most_hours_lost": most,
                "mean_hours_lost": np.bincount(mine, areas * loss, len(labels))
                / np.maximum(whole, 1e-300),
            }
            return {f"neighbour_{name}": figure[kept] for name, figure in figures.items()}

        one = ("neighbour",)
        found: Variables = {
            "hours_lost": (dims, np.where(left, self.lost, nan)),
            "newly_under": (dims, newly.astype(np.uint8)),
            "neighbour": (one, labels[kept]),
            "neighbour_area": (one, whole[kept]),
        }
        found |= {name: (one, figure) for name, figure in sum_up(self.lost, newly).items()}
        if self.days > 1:
            found["newly_under_days"] = (dims, np.where(left, self.newly_days, np.int16(0)))
        if self.lost_by_day is not None and self.newly_by_day is not None:
            by_day = [sum_up(*both) for both in zip(self.lost_by_day, self.newly_by_day)]
            found["hours_lost_by_day"] = (("day", *dims), np.where(left, self.lost_by_day, nan))
            found["newly_under_by_day"] = (("day", *dims), left * self.newly_by_day)
            found |= {
                f"{name}_by_day": (("day", *one), np.array([day[name] for day in by_day]))
                for name in by_day[0]
            }
        return found

    def _gather(self) -> tuple[NDArray[np.str_], NDArray[np.intp]]:
        """Give the neighbours' names, and the neighbour of each receiver that is not new."""
        labels, place = np.unique(np.array([*self.names, GROUND]), return_inverse=True)
        owner = np.where(self.owner < 0, len(self.names), self.owner)
        return labels, place.ravel()[owner][~self.is_new]
