"""What rules ask of receivers: pieces of lit time, and how many of them must remain."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.massing.planes import Crossings

__all__ = ["LONGEST", "SPELLS", "SUM", "Needs", "measure_lit"]

SUM, LONGEST, SPELLS = range(3)
"""Measures: hours in all, the longest spell, hours in spells of a least length."""
SLACK = 1e-6
"""Rounding of hours [h]."""


class Needs(NamedTuple):
    """
    Needs of receivers, in groups of which a share must be met.

    A need is a receiver's on one date of a check. A receiver that must be met by itself is a group
    of one.

    Parameters
    ----------
    crossings : Crossings
        Of the pieces, which come need by need, in time order.
    hours : (n_pieces,) float64
        What each piece counts [h].
    goes_on : (n_pieces,) bool
        Whether a piece begins where the one before ends.
    start : (n_needs + 1,) int64
        Of each need's pieces.
    measure : (n_needs,) int64
        SUM, LONGEST or SPELLS.
    least : (n_needs,) float64
        Least length of a spell [h].
    limit : (n_needs,) float64
        Hours that must remain [h].
    weight : (n_needs,) float64
        Share of its group.
    group : (n_groups + 1,) int64
        Start of each group's needs.
    wanted : (n_groups,) float64
        Weight of the needs that must be met.
    """

    crossings: Crossings
    hours: NDArray[np.float64]
    goes_on: NDArray[np.bool_]
    start: NDArray[np.int64]
    measure: NDArray[np.int64]
    least: NDArray[np.float64]
    limit: NDArray[np.float64]
    weight: NDArray[np.float64]
    group: NDArray[np.int64]
    wanted: NDArray[np.float64]


@njit(cache=True, nogil=True)
def measure_lit(needs, need, is_lit):
    """Return what a need's measure is of the pieces that are lit [h]."""
    total, longest, counted, run = 0.0, 0.0, 0.0, 0.0
    for u in range(needs.start[need], needs.start[need + 1]):
        if run > 0.0 and not (needs.goes_on[u] and is_lit[u]):
            longest = max(longest, run)
            if run >= needs.least[need] - SLACK:
                counted += run
            run = 0.0
        if is_lit[u]:
            run += needs.hours[u]
            total += needs.hours[u]
    longest = max(longest, run)
    if run >= needs.least[need] - SLACK:
        counted += run
    if needs.measure[need] == SUM:
        return total
    return longest if needs.measure[need] == LONGEST else counted
