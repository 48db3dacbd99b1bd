"""
Upper bounds of the heights and of the volume.

A cell alone: what a receiver may give up limits how many of its pieces a box in the cell may hide,
whatever stands elsewhere. All cells together: with the excess of each cell's bound over a piece's
clear height as the piece's price, shared among the pieces of all receivers so that the shares of a
cell add up to 1, whatever pieces are kept lower the volume by at least their prices: a maximum is
at least any weighted mean. Each receiver must keep its cheapest pieces at least; shares are found
by exponentiated subgradients, and every one of their steps gives a valid bound.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.massing.planes import SLACK, Needs

__all__ = ["bound_cells", "bound_sum", "take_cheapest"]


def bound_cells(needs: Needs, top: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Bound each cell's height by what each group may give up, (n_cells,) float64.

    Parameters
    ----------
    needs : Needs
    top : (n_cells,) float64
        Height that no cell may exceed [m].
    """
    crossings = needs.crossings
    piece = np.repeat(np.arange(len(needs.hours)), np.diff(crossings.start))
    need = np.repeat(np.arange(len(needs.limit)), np.diff(needs.start))[piece]
    total = np.add.reduceat(np.append(needs.hours, 0.0), needs.start[:-1])
    total[np.diff(needs.start) == 0] = 0.0
    spare = total - needs.limit
    # Of each need and cell: the lowest height at which the pieces below are more than it can spare.
    which, height = _find_first(need, crossings, needs.hours[piece], spare, SLACK)
    if not len(which[0]):
        return top.copy()
    group = np.repeat(np.arange(len(needs.wanted)), np.diff(needs.group))
    weight = np.add.reduceat(needs.weight, needs.group[:-1])
    left = weight - needs.wanted
    owner, cell = which
    order = np.lexsort((height, cell, group[owner]))
    which, height = _pass_over(
        group[owner][order], cell[order], height[order], needs.weight[owner][order], left, SLACK
    )
    bounds = top.copy()
    np.minimum.at(bounds, which[1], height)
    return bounds


def _find_first(need, crossings, hours, spare, slack):
    order = np.lexsort((crossings.dark, crossings.cell, need))
    return _pass_over(
        need[order], crossings.cell[order], crossings.dark[order], hours[order], spare, slack
    )


def _pass_over(owner, cell, height, weight, spare, slack):
    """
    Find for each owner and cell the first height up to which more weight lies than can be spared.

    All are sorted by owner, cell and height. Returns owners and cells, and the heights.
    """
    if not len(owner):
        return (owner, cell), height
    is_new = np.ones(len(owner), np.bool_)
    is_new[1:] = (owner[1:] != owner[:-1]) | (cell[1:] != cell[:-1])
    run = np.cumsum(is_new) - 1
    before = np.concatenate([[0.0], np.cumsum(weight)])
    total = before[1:] - before[np.flatnonzero(is_new)][run]
    over = (total > spare[owner] + slack) & np.isfinite(height)
    first = np.flatnonzero(over)
    first = first[np.unique(run[first], return_index=True)[1]]
    return (owner[first], cell[first]), height[first]


def bound_sum(
    needs: Needs, ceiling: NDArray[np.float64], floor: NDArray[np.float64], steps: int
) -> tuple[float, NDArray[np.float64]]:
    """
    Bound the sum of all heights over a floor [m], and price the pieces by it.

    Parameters
    ----------
    needs : Needs
    ceiling : (n_cells,) float64
        Bound of each cell [m].
    floor : (n_cells,) float64
        Height below which no cell is counted: the ground [m].
    steps : int

    Returns
    -------
    bound : float
        [m].
    prices : (n_pieces,) float64
        Mean of the later half of the steps [m].
    """
    prices = np.zeros(len(needs.hours))
    whole = float((ceiling - floor).sum())
    crossings = needs.crossings
    excess = ceiling[crossings.cell] - np.maximum(crossings.dark, floor[crossings.cell])
    over = np.flatnonzero(excess > SLACK)
    if not len(over):
        return whole, prices
    over = over[np.argsort(crossings.cell[over], kind="stable")]
    piece = np.repeat(np.arange(len(needs.hours)), np.diff(crossings.start))[over]
    excess, cell = excess[over], crossings.cell[over]
    priced, piece = np.unique(piece, return_inverse=True)
    left = _leave_priced(needs, priced)
    is_new = np.append(True, cell[1:] != cell[:-1])
    first, run = np.flatnonzero(is_new), np.cumsum(is_new) - 1
    power = np.zeros(len(over))
    best, mean = 0.0, excess.mean()
    for step in range(steps):
        power -= np.maximum.reduceat(power, first)[run]
        share = np.exp(power)
        share /= np.add.reduceat(share, first)[run]
        price = np.bincount(piece, share * excess, len(priced)).astype(np.float64)
        value, used = _find_cheapest(needs, left, price)
        if 2 * step >= steps:
            prices[priced] += price
        best = max(best, value)
        power += (2.0 / mean / np.sqrt(step + 1.0)) * excess * used[piece]
    return whole - best, prices * 2 / steps


def take_cheapest(needs: Needs, prices: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return for each need its cheapest pieces that are enough, (n_pieces,) bool."""
    count = len(needs.limit)
    need = np.repeat(np.arange(count), np.diff(needs.start))
    used, cost = _fill(need, prices, needs.hours, needs.limit, count)
    group = np.repeat(np.arange(len(needs.wanted)), np.diff(needs.group))
    chosen, _ = _fill(group, cost, needs.weight, needs.wanted, len(needs.wanted))
    return (used > SLACK) & (chosen[need] > SLACK)


class _Priced(NamedTuple):
    """Pieces that cost something: their needs and hours, and what free ones leave of the limits."""

    need: NDArray[np.intp]
    hours: NDArray[np.float64]
    limit: NDArray[np.float64]


def _leave_priced(needs: Needs, priced: NDArray[np.intp]) -> _Priced:
    need = np.repeat(np.arange(len(needs.limit)), np.diff(needs.start))
    is_free = np.ones(len(needs.hours), np.bool_)
    is_free[priced] = False
    free = np.bincount(need[is_free], needs.hours[is_free], len(needs.limit))
    return _Priced(need[priced], needs.hours[priced], np.maximum(needs.limit - free, 0.0))


def _find_cheapest(
    needs: Needs, left: _Priced, price: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64]]:
    """Return the least sum of prices that meets all needs, and the share of each piece in it."""
    count, need = len(needs.limit), left.need
    used, cost = _fill(need, price, left.hours, left.limit, count)
    if len(needs.wanted) == count:
        return float(cost.sum()), used
    group = np.repeat(np.arange(len(needs.wanted)), np.diff(needs.group))
    chosen, least = _fill(group, cost, needs.weight, needs.wanted, len(needs.wanted))
    return float(least.sum()), used * chosen[need]


def _fill(
    owner: NDArray[np.int64], price: NDArray[np.float64], size: NDArray[np.float64],
    wanted: NDArray[np.float64], count: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """Fill each owner's wanted size with its items, the cheapest by size first: share and cost."""
    order = np.lexsort((price / size, owner))
    ends = np.cumsum(size[order])
    begins = ends - size[order]
    first = np.searchsorted(owner[order], np.arange(count))
    base = np.append(begins, ends[-1:] if len(ends) else 0.0)[first]
    room = wanted[owner[order]] - (begins - base[owner[order]])
    share = np.zeros(len(price))
    share[order] = np.clip(room / size[order], 0.0, 1.0)
    return share, np.bincount(owner, share * price, count).astype(np.float64)
