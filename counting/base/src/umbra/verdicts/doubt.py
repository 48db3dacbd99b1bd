"""
What values of rules may be off by: of hours by steps, of shares by cells, of ratios to before.

**Hours.** A change between two steps in a row happened somewhere between their middles: half a
step for each.

**Shares of an area.** A cell whose hours may be on either side of the limit counts wholly or not at
all. A cell at the edge of those that meet it may be cut by that edge, which runs between two
middles: by half.

**Ratios to before.** Before and after are counted on the same cells at the same moments, so their
errors are not independent: where the proposal changes nothing they are one error. The ratio is
R = A / B = 1 - D / B with D = B - A, what was lost. D has only the errors of what the proposal
changes; so |dR| <= (dD + |D| / B dB) / (B - dB), which is 0 where nothing changed. This is the sum
of absolute terms for errors of full correlation [JCGM 100:2008, 5.2.2, note 1], of a quotient
written so that each quantity stands in it once [Moore, Interval Analysis, 1966: dependency].
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.verdicts.subjects import Subjects
from umbra.verdicts.sunlight import SunDay

__all__ = ["ShareDoubt", "bound_hours", "bound_lost_hours", "bound_ratio", "doubt_share"]


def bound_hours(lit: NDArray[np.bool_], day: SunDay) -> NDArray[np.float64]:
    """Return what hours (n,) of masks (s, n) may be off by [h]: half a step for each change."""
    if len(lit) < 2:
        return np.zeros(lit.shape[1:])
    in_a_row = day.starts[1:] == day.ends[:-1]
    half = np.where(in_a_row, np.maximum(day.hours[1:], day.hours[:-1]) / 2, 0.0)
    return np.asarray(half @ (lit[1:] != lit[:-1]))


def bound_lost_hours(
    lit: NDArray[np.bool_], before: NDArray[np.bool_], day: SunDay
) -> NDArray[np.float64]:
    """Return what hours (n,) lost between two masks (s, n) may be off by [h]."""
    return bound_hours(before & ~lit, day) + bound_hours(lit & ~before, day)


class ShareDoubt(NamedTuple):
    """Which cells (n,) meet a limit, and the share of each that may not do what it is counted."""

    meets: NDArray[np.bool_]
    doubt: NDArray[np.float64]

    def bound(self, subjects: Subjects) -> NDArray[np.float64]:
        """Return what the share of each area may be off by, (k,)."""
        return self._bound(subjects, self.doubt * self.meets, self.doubt * ~self.meets)

    def bound_lost(
        self, subjects: Subjects, before: "ShareDoubt", changed: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """
        Return what the share lost since before may be off by, (k,).

        Parameters
        ----------
        subjects : Subjects
        before : ShareDoubt
        changed : (n,) bool
            Cells whose sun the proposal changes at some moment.
        """
        # The edge within a cell moves, too, where the next cell's sun changes.
        moved = changed | changed[subjects.near].any(1)
        more = before.doubt * ~before.meets + self.doubt * self.meets
        less = before.doubt * before.meets + self.doubt * ~self.meets
        return self._bound(subjects, more * moved, less * moved)

    @staticmethod
    def _bound(
        subjects: Subjects, down: NDArray[np.float64], up: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        return np.maximum(subjects.average(down), subjects.average(up))


def doubt_share(
    subjects: Subjects, meets: NDArray[np.bool_], is_near: NDArray[np.bool_]
) -> ShareDoubt:
    """
    Return the doubt of each cell's share.

    Parameters
    ----------
    subjects : Subjects
    meets : (n,) bool
    is_near : (n,) bool
        Cells whose hours may be on the other side of the limit.
    """
    at_edge = (meets[subjects.near] != meets[:, None]).any(1)
    return ShareDoubt(meets, np.where(is_near, 1.0, np.where(at_edge, 0.5, 0.0)))


def bound_ratio(after: float, before: float, before_off: float, lost_off: float) -> float:
    """
    Return what the ratio of a value to that before may be off by.

    Parameters
    ----------
    after, before : float
    before_off, lost_off : float
        What ``before``, and ``before - after``, may be off by.
    """
    if before <= 0:
        return 0.0
    lost = abs(before - after)
    off = lost_off + lost / before * before_off
    # A ratio to nearly nothing may be any up to that of no loss.
    return off / (before - before_off) if before > before_off else float(off > 0)
