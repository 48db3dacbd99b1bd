"""
Which flats keep their sun, and by which window: for a share of flats with several windows or rooms.

A flat is met if each of its slots (its rooms, or each of its windows) is met, and a slot if one of
its options is. Flats are taken one after the other, each time the one that costs the least height
beside all that is kept already, each room by its cheapest window. What is taken is then asked for
by itself, so that any result keeps the rule; another choice may hold more.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.massing.picks import keep_enough
from umbra.massing.planes import Needs

__all__ = ["FlatChoice", "choose_flats"]


@dataclass(eq=False)
class FlatChoice:
    """
    So many of some flats, of which each needs a group of every slot.

    Parameters
    ----------
    name : str
    wanted : int
        Number of flats.
    flats : list of list of list of list of int
        Of each flat its slots, of each slot its options, of each option the candidates that it
        needs, all of them.
    """

    name: str
    wanted: int
    flats: list[list[list[list[int]]]] = field(default_factory=list)


def choose_flats(
    needs: Needs, fixed: int, broken: NDArray[np.bool_], choice: FlatChoice,
    heights: NDArray[np.float64],
) -> tuple[list[int], int]:  # fmt: skip
    """
    Choose flats and lower the heights by what they keep.

    Parameters
    ----------
    needs : Needs
        Of the groups that are fixed, and then of all candidates.
    fixed : int
        Number of the fixed groups.
    broken : (n_groups,) bool
        Groups that have too little before anything is built.
    choice : FlatChoice
    heights : (n_cells,) float64
        That all else leaves; lowered [m].

    Returns
    -------
    chosen : list of int
        Candidates that are kept.
    count : int
        Number of flats that are kept: fewer than wanted where fewer have enough before.
    """
    is_kept = np.zeros(len(needs.hours), np.bool_)
    left, chosen, count = list(choice.flats), list[int](), 0
    while left and count < choice.wanted:
        tried = [_keep(needs, fixed, broken, flat, heights, is_kept) for flat in left]
        whole = [own.sum() if own is not None else -np.inf for own, _ in tried]
        best = int(np.argmax(whole))
        own, groups = tried[best]
        if own is None:
            break
        heights[:] = own
        chosen += groups
        count += 1
        del left[best]
    return chosen, count


def _keep(
    needs: Needs, fixed: int, broken: NDArray[np.bool_], flat: list[list[list[int]]],
    heights: NDArray[np.float64], is_kept: NDArray[np.bool_],
) -> tuple[NDArray[np.float64] | None, list[int]]:  # fmt: skip
    """Return the heights that a flat leaves by its cheapest options, None if a slot has none."""
    left, groups = heights.copy(), list[int]()
    for slot in flat:
        best, taken = None, list[int]()
        for option in slot:
            if broken[[fixed + group for group in option]].any():
                continue
            own = left.copy()
            for group in option:
                keep_enough(needs, fixed + group, own, is_kept)
            if best is None or own.sum() > best.sum():
                best, taken = own, option
        if best is None:
            return None, []
        left, groups = best, [*groups, *taken]
    return left, groups
