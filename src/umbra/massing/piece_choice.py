"""
Which pieces of sun to keep: a search for the heights of greatest volume.

A cell's height is the least over the kept pieces that cross it. What a receiver's pieces cost is
what they lower: a submodular cover problem, which is hard in general. A receiver's best pieces
beside all others are found greedily by the volume that they cost per hour; receivers take turns
until none improves, from four starts, one of them the prices of the bound. Then some that bind one
place are taken out together and put back in another order, which is kept where it is no worse.
Where nothing may be given up there is no choice, and the result is the exact upper envelope.

Raising cells, one after the other, until each is capped or would break a rule.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.massing.picks import keep_enough
from umbra.massing.planes import SLACK, SUM, Needs, measure_lit
from umbra.massing.upper_bounds import take_cheapest

__all__ = ["choose_pieces", "fill_up"]


def fill_up(
    needs: Needs, heights: NDArray[np.float64], top: NDArray[np.float64]
) -> NDArray[np.float64]:
    """
    Raise each cell as far as all rules stay kept with the other cells as they are.

    Parameters
    ----------
    needs : Needs
    heights : (n_cells,) float64
        Of the tops, which keep the rules [m].
    top : (n_cells,) float64
        Height that no cell may exceed [m].

    Returns
    -------
    heights : (n_cells,) float64
        None of which can be raised alone.
    """
    crossings = needs.crossings
    order = np.lexsort((crossings.clear, crossings.cell))
    piece = np.repeat(np.arange(len(needs.hours)), np.diff(crossings.start))[order]
    clear, cell = crossings.clear[order], crossings.cell[order]
    first = np.searchsorted(cell, np.arange(len(top) + 1))
    raised = heights.copy()
    cells = np.argsort(heights - top, kind="stable")
    _fill_up(needs, raised, top, cells, first, piece, clear)
    return raised


@kernel
def _fill_up(needs, heights, top, cells, first, piece, clear):
    crossings = needs.crossings
    hiding = np.zeros(needs.hours.size, np.int32)  # cells that hide each piece
    for u in range(needs.hours.size):
        for i in range(crossings.start[u], crossings.start[u + 1]):
            hiding[u] += heights[crossings.cell[i]] > crossings.clear[i] + 1e-9
    is_lit = hiding == 0
    groups = needs.wanted.size
    need_of = np.zeros(needs.hours.size, np.int64)
    group_of = np.zeros(needs.limit.size, np.int64)
    met = np.zeros(needs.limit.size, np.bool_)
    weight = np.zeros(groups)
    for g in range(groups):
        for need in range(needs.group[g], needs.group[g + 1]):
            group_of[need] = g
            need_of[needs.start[need] : needs.start[need + 1]] = need
            met[need] = measure_lit(needs, need, is_lit) >= needs.limit[need] - SLACK
            weight[g] += needs.weight[need] if met[need] else 0.0
    for c in cells:
        i = first[c]
        while i < first[c + 1] and clear[i] < heights[c] - 1e-9:
            i += 1
        height = top[c]
        while i < first[c + 1] and clear[i] < top[c]:
            u = piece[i]
            need = need_of[u]
            group = group_of[need]
            if is_lit[u]:
                is_lit[u] = False
                still = met[need]
                if still:
                    still = measure_lit(needs, need, is_lit) >= needs.limit[need] - SLACK
                if met[need] and not still:
                    if weight[group] - needs.weight[need] < needs.wanted[group] - SLACK:
                        is_lit[u] = True
                        height = clear[i]
                        break
                    weight[group] -= needs.weight[need]
                    met[need] = False
            hiding[u] += 1
            i += 1
        heights[c] = max(height, heights[c])


_ROUNDS = 24
"""Most turns of all receivers."""
_AGAIN = 4
"""Most times that the found heights begin the search again."""
_TIMES = 8  # that members of a group are weighed
_WORK, _EACH = 3e9, 3e4  # crossings that exchanges may look at, and what a member takes of them
_CHANCES = 64  # random numbers of each exchange


def choose_pieces(
    needs: Needs, top: NDArray[np.float64], prices: NDArray[np.float64], rounds: int
) -> NDArray[np.float64]:
    """
    Choose the pieces to keep, and return the heights that they leave.

    Parameters
    ----------
    needs : Needs
    top : (n_cells,) float64
        Height that no cell may exceed [m].
    prices : (n_pieces,) float64
        Of the bound: what each piece takes at least.
    rounds : int
        Number of times that some receivers are taken out and put back.

    Returns
    -------
    heights : (n_cells,) float64
        Of the tops; none can be raised alone [m].
    """
    chance = np.random.default_rng(1)
    groups, pieces = len(needs.wanted), len(needs.hours)
    none = np.zeros(pieces, np.bool_)
    if len(needs.limit) < 2 or _is_fixed(needs):
        is_kept = none.copy()
        return fill_up(
            needs, _take_turns(needs, top, np.arange(groups), is_kept, True, _ROUNDS), top
        )
    tries = []
    orders = (np.arange(groups), np.arange(groups)[::-1].copy(), chance.permutation(groups))
    for order in orders[: min(groups, 3)]:
        is_kept = none.copy()
        tries.append(_take_turns(needs, top, order, is_kept, True, _ROUNDS))
    is_kept = take_cheapest(needs, prices)
    tries.append(_take_turns(needs, top, np.arange(groups), is_kept, False, _ROUNDS))
    heights = max((fill_up(needs, left, top) for left in tries), key=np.sum)
    n_rounds = min(rounds, _count_rounds(needs))
    for _ in range(_AGAIN):
        is_kept, before = none.copy(), float(heights.sum())
        tried = _settle_all(needs, heights.copy(), is_kept)
        _exchange(needs, top, is_kept, tried, chance.random((n_rounds, _CHANCES)))
        tried = fill_up(needs, tried, top)
        if tried.sum() <= before + 1e-6:
            break
        heights = tried
    return heights


def _count_rounds(needs: Needs) -> int:
    """Return how many exchanges take some seconds: few where groups have many members."""
    crossings = float(needs.crossings.start[-1])
    members = np.diff(needs.group)
    weighed = float((members * np.minimum(members, _TIMES)).mean())
    return max(int(_WORK / (8 * crossings * (1 + weighed / members.sum()) + _EACH * weighed)), 2)


def _is_fixed(needs: Needs) -> bool:
    """Return whether no piece may be given up: then there is nothing to choose."""
    if len(needs.wanted) < len(needs.limit) or (needs.measure != SUM).any():
        return False
    pieces = np.diff(needs.start)
    has_pieces = pieces > 0
    if not has_pieces.any():
        return True
    first = needs.start[:-1][has_pieces]
    total = np.add.reduceat(needs.hours, first)
    least = np.minimum.reduceat(needs.hours, first)
    return bool((total - least < needs.limit[has_pieces] - SLACK).all())


@kernel
def find_cell_heights(needs, top, is_kept, without=-1):
    """Return the heights (n_cells,) that the kept pieces leave, without those of one group."""
    heights = top.copy()
    crossings = needs.crossings
    for g in range(needs.wanted.size):
        if g == without:
            continue
        first, last = needs.start[needs.group[g]], needs.start[needs.group[g + 1]]
        for u in range(first, last):
            if is_kept[u]:
                for i in range(crossings.start[u], crossings.start[u + 1]):
                    c = crossings.cell[i]
                    heights[c] = min(heights[c], crossings.clear[i])
    return heights


@kernel
def _settle_all(needs, heights, is_kept):
    """Let each group choose its pieces among what given heights leave; return these."""
    for g in range(needs.wanted.size):
        keep_enough(needs, g, heights, is_kept)
    return heights


@kernel
def _take_turns(needs, top, order, is_kept, begin, rounds):
    """Let each group choose its pieces beside those of all others, until none improves."""
    heights = top.copy()
    if begin:
        for g in order:
            keep_enough(needs, g, heights, is_kept)
    else:
        heights = find_cell_heights(needs, top, is_kept)
    volume = heights.sum()
    for _ in range(rounds):
        for g in order:
            others = find_cell_heights(needs, top, is_kept, g)
            keep_enough(needs, g, others, is_kept)
        heights = find_cell_heights(needs, top, is_kept)
        if heights.sum() <= volume + 1e-6:
            break
        volume = heights.sum()
    return heights


@kernel
def _exchange(needs, top, is_kept, heights, chances):
    """
    Take out groups that bind one place, put them back in another order; keep what is better.

    ``chances`` (rounds, n) from 0 to 1 choose the places and groups.
    """
    groups = needs.wanted.size
    dear = np.ones(needs.limit.size)
    for number, chance in enumerate(chances):
        lowered = np.flatnonzero(heights < top - 1e-9)
        if lowered.size == 0:
            return
        at = lowered[int(chance[0] * lowered.size)]
        reach = heights[at] + (top[at] - heights[at]) * chance[1] * chance[1]
        most = 2 + int(chance[2] * 7)
        binding = np.zeros(groups, np.bool_)
        for g in range(groups):
            binding[g] = _binds(needs, g, is_kept, at, reach)
        picked = np.flatnonzero(binding)
        for k in range(picked.size):  # a few of them, in an order of chance
            other = k + int(chance[3 + k % (chance.size - 3)] * (picked.size - k))
            picked[k], picked[other] = picked[other], picked[k]
        picked = picked[:most]
        before = is_kept.copy()
        for g in picked:
            is_kept[needs.start[needs.group[g]] : needs.start[needs.group[g + 1]]] = False
        tried = find_cell_heights(needs, top, is_kept)
        for need in range(dear.size):  # every other time members of a group are chosen by chance
            dear[need] = 1.0 + (number % 2) * 2.0 * chance[(7 * need + 3) % chance.size]
        for g in picked:
            keep_enough(needs, g, tried, is_kept, dear)
        for g in picked:
            others = find_cell_heights(needs, top, is_kept, g)
            keep_enough(needs, g, others, is_kept, dear)
        tried = find_cell_heights(needs, top, is_kept)
        if tried.sum() >= heights.sum() - 1e-9:
            heights[:] = tried
        else:
            is_kept[:] = before


@kernel
def _binds(needs, g, is_kept, cell, height):
    """Return whether a kept piece of a group limits a cell to a height at most."""
    crossings = needs.crossings
    for u in range(needs.start[needs.group[g]], needs.start[needs.group[g + 1]]):
        if is_kept[u]:
            for i in range(crossings.start[u], crossings.start[u + 1]):
                if crossings.cell[i] == cell and crossings.clear[i] <= height:
                    return True
    return False
