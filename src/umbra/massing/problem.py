"""
The problem of a plot: asks in groups, what receivers have before, and the planes over the cells.

A group is what must be met: a receiver by itself, so much of a garden's area, one of several
windows of a flat, one of several alternatives. A group that is not met before anything is built is
asked to lose nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.errors import InputError
from umbra.machine import find_memory, name_memory
from umbra.massing.asks import Ask, measure_pieces
from umbra.massing.planes import SLACK, Needs, RayCrossings, cross_cells
from umbra.massing.plot import Plot

__all__ = ["Problem", "ReceiverGroup", "pose_problem"]

_BYTES = 50  # of a crossing, where few of those that are possible are [byte]


@dataclass(frozen=True, eq=False)
class ReceiverGroup:
    """
    Receivers of asks, of which enough must have what is asked.

    Parameters
    ----------
    name : str
        What is told of it: a receiver or an area, with its check.
    ask : (n,) int64
        Index of each member's ask.
    receiver : (n,) int64
        Its index among the receivers of that ask.
    weight : (n,) float64
        What it counts: an area [m2], or 1.
    wanted : float
        Weight of the members that must have enough.
    """

    name: str
    ask: NDArray[np.int64]
    receiver: NDArray[np.int64]
    weight: NDArray[np.float64]
    wanted: float

    @classmethod
    def one(cls, name: str, ask: int, receiver: int) -> "ReceiverGroup":
        """Return the group of a receiver that must be met by itself."""
        return cls(name, np.array([ask]), np.array([receiver]), np.ones(1), 1.0)


@dataclass(frozen=True, eq=False)
class Problem:
    """
    A problem, posed.

    Parameters
    ----------
    plot : Plot
    asks : tuple of Ask
    groups : tuple of Group
    before : tuple of (n,) float64
        Hours of each ask's receivers before anything is built [h].
    broken : (n_groups,) bool
        Whether a group is not met before.
    ask, receiver : (n_needs,) int64
        Of each need of ``needs``.
    needs : Needs
        Group by group.
    """

    plot: Plot
    asks: tuple[Ask, ...]
    groups: tuple[ReceiverGroup, ...]
    before: tuple[NDArray[np.float64], ...]
    broken: NDArray[np.bool_]
    ask: NDArray[np.int64]
    receiver: NDArray[np.int64]
    needs: Needs

    def pick(self, which: Sequence[int]) -> "Problem":
        """Return the problem of some of the groups, by ascending indices."""
        chosen, needs = np.array(which, np.int64), self.needs
        members, group = _gather(needs.group[chosen], needs.group[chosen + 1])
        pieces, start = _gather(needs.start[members], needs.start[members + 1])
        picked = Needs(
            _pick_crossings([needs.crossings], pieces), needs.hours[pieces],
            needs.goes_on[pieces], start, needs.measure[members], needs.least[members],
            needs.limit[members], needs.weight[members], group, needs.wanted[chosen],
        )  # fmt: skip
        return replace(
            self, groups=tuple(self.groups[k] for k in chosen.tolist()), needs=picked,
            broken=self.broken[chosen], ask=self.ask[members], receiver=self.receiver[members],
        )  # fmt: skip

    def find_unmet(self, hours: Sequence[NDArray[np.float64]]) -> NDArray[np.intp]:
        """Return the groups that are not met with these hours of each ask's receivers [h]."""
        values = np.array([hours[a][r] for a, r in zip(self.ask, self.receiver, strict=True)])
        return np.flatnonzero(~_meet(self.needs, values))


def _meet(needs: Needs, values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which groups are met by values of their needs [h]."""
    met = (values >= needs.limit - 1e-4) * needs.weight  # hours are kept as float32
    return np.add.reduceat(met, needs.group[:-1]) >= needs.wanted - SLACK


def pose_problem(
    plot: Plot, asks: Sequence[Ask], groups: Sequence[ReceiverGroup], around: Casting | None
) -> Problem:
    """
    Measure what receivers have before, and find the planes of the sun over the plot.

    Parameters
    ----------
    plot : Plot
    asks : sequence of Ask
    groups : sequence of Group
        Each with a member at least.
    around : Casting or None
        What stands around.

    Raises
    ------
    InputError
        If the planes do not fit in memory.
    """
    cuts = []
    for ask in asks:
        pieces = ask.cut(ask.find_masks(None if ask.is_alone else around))
        cuts.append((pieces, measure_pieces(ask, pieces)))
    _check_memory(plot, [len(pieces.hours) * (1 + int((pieces.last - pieces.first).max(initial=0)))
                         for pieces, _ in cuts])  # fmt: skip
    crossings = [
        cross_cells(plot, pieces, ask.places.points, ask.lights.directions)
        for ask, (pieces, _) in zip(asks, cuts, strict=True)
    ]
    cuts = [(ask.gather(pieces), had) for ask, (pieces, had) in zip(asks, cuts, strict=True)]
    which = np.concatenate([group.ask for group in groups]).astype(np.int64)
    receiver = np.concatenate([group.receiver for group in groups]).astype(np.int64)
    of_all = [pieces for pieces, _ in cuts]
    hours, goes_on = (
        np.concatenate([getattr(part, name) for part in of_all]) for name in ("hours", "goes_on")
    )
    first = np.cumsum([0, *(len(pieces.hours) for pieces, _ in cuts)])
    starts = [np.searchsorted(pieces.receiver, np.arange(len(ask.labels) + 1)) + at
              for ask, (pieces, _), at in zip(asks, cuts, first[:-1], strict=True)]  # fmt: skip
    begin = np.array([starts[a][r] for a, r in zip(which, receiver, strict=True)])
    end = np.array([starts[a][r + 1] for a, r in zip(which, receiver, strict=True)])
    order, start = _gather(begin, end)
    before = tuple(had for _, had in cuts)
    sizes = np.array([len(group.ask) for group in groups])
    needs = Needs(
        _pick_crossings(crossings, order), hours[order], goes_on[order], start,
        np.array([asks[a].measure for a in which]), np.array([asks[a].least for a in which]),
        np.array([asks[a].limit[r] for a, r in zip(which, receiver, strict=True)], np.float64),
        np.concatenate([group.weight for group in groups]).astype(np.float64),
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        np.array([group.wanted for group in groups], np.float64),
    )  # fmt: skip
    had = np.array([before[a][r] for a, r in zip(which, receiver, strict=True)])
    broken = ~_meet(needs, had)
    if broken.any():
        of_need = np.repeat(broken, sizes)
        whole = np.add.reduceat(needs.weight, needs.group[:-1])
        needs = needs._replace(
            limit=np.where(of_need, had, needs.limit), wanted=np.where(broken, whole, needs.wanted)
        )
    return Problem(plot, tuple(asks), tuple(groups), before, broken, which, receiver, needs)


def _check_memory(plot: Plot, rays: Sequence[int]) -> None:
    """Refuse rays over cells that do not fit in memory, by the most that they can cross."""
    rows, cols = plot.index.shape
    most = float(sum(rays)) * (rows + cols)
    if most * _BYTES > find_memory():
        least = plot.cell * most * _BYTES / find_memory()
        msg = (
            f"{sum(rays):,} rays to the sun over {rows:,} rows and {cols:,} columns of cells may "
            f"need {most * _BYTES / 1e9:,.0f} GB and {name_memory(find_memory())}; give cell= from "
            f"{least:.2g} m on, fewer receivers or longer steps"
        )
        raise InputError(msg, option="cell")


def _gather(
    begin: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the indices of ranges, one range after the other, and where each begins."""
    start = np.concatenate([[0], np.cumsum(end - begin)]).astype(np.int64)
    order = np.arange(start[-1]) - np.repeat(start[:-1] - begin, end - begin)
    return order, start


def _pick_crossings(
    all_crossings: Sequence[RayCrossings], order: NDArray[np.int64]
) -> RayCrossings:
    """Return the crossings of some pieces, numbered over all asks."""
    first = np.cumsum([0, *(len(crossings.cell) for crossings in all_crossings)])
    begin = np.concatenate(
        [crossings.start[:-1] + at for crossings, at in zip(all_crossings, first)]
    )
    end = np.concatenate([crossings.start[1:] + at for crossings, at in zip(all_crossings, first)])
    picked, start = _gather(begin[order], end[order])
    return RayCrossings(
        start, *(np.concatenate([getattr(crossings, name) for crossings in all_crossings])[picked]
                 for name in ("cell", "clear", "dark"))
    )  # fmt: skip
