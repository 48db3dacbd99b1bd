"""Which instants of a long study a page shows: every date while it can, then every n-th."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from umbra.study.period import Period

__all__ = ["FEW_DATES", "thin"]

FEW_DATES = 24
"""So many are all shown, if need be at one instant an hour."""
_COARSE, _COARSEST = 0.25, 1.0  # between instants that are shown: of many dates, of few [h]


def thin(period: Period, most: int) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[int, int]]:
    """
    Choose steps until no more of those with the sun up are left than a page holds.

    Instants of a date are given up first, down to one in 15 minutes (of few dates one an
    hour); then whole dates, evenly; at last more instants.

    Parameters
    ----------
    period : Period
    most : int
        With the sun up; by night nothing is kept of a step but its time.

    Returns
    -------
    which : (n,) int64
        The steps that are shown.
    last : (n,) int64
        The last step that each one stands for.
    strides : (int, int)
        Of dates and of a date's steps.
    """
    firsts = np.cumsum([0, *(len(steps.hours) for steps in period.steps)])
    is_up = period.sun.is_up
    lit = [int(is_up[a:b].sum()) for a, b in pairwise(firsts)]

    def fits(days: int, steps: int) -> bool:
        return sum(-(-count // steps) for count in lit[::days]) <= most

    gap = _COARSEST if len(lit) <= FEW_DATES else _COARSE
    coarsest = max(1, int(gap / float(np.median(period.hours)) + 1e-9))
    every = range(1, len(lit) + 1)
    days = next((n for n in every if fits(n, coarsest)), len(lit))
    steps = next((n for n in range(1, coarsest) if fits(days, n)), coarsest)
    while not fits(days, steps) and steps < len(period.hours):
        steps += 1
    pairs = list(pairwise(firsts))[::days]
    which = [np.arange(first, end, steps) for first, end in pairs]
    last = [np.append(some[1:] - 1, end - 1) for (_, end), some in zip(pairs, which)]
    return np.concatenate(which), np.concatenate(last), (days, steps)
