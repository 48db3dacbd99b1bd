"""
Which pieces of sun to keep: a search for the heights of greatest volume.

A cell's height is the least over the kept pieces that cross it. What a receiver's pieces cost is
what they lower: a submodular cover problem, which is hard in general. A receiver's best pieces
beside all others are found greedily by the volume that they cost per hour; receivers take turns
until none improves; then some that bind one place are taken out together and put back in another
order, which is kept where it is no worse. Where nothing may be given up there is no choice, and the
result is the exact upper envelope.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.envelope.needs import LONGEST, SLACK, SPELLS, SUM, Needs

__all__ = ["choose_pieces", "find_heights"]

_ROUNDS = 24
"""Most turns of all receivers."""
_SHARE = 6  # of what is still needed, the part that is taken at once is one by this


def choose_pieces(
    needs: Needs, top: NDArray[np.float64], rounds: int, seed: int = 1
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """
    Choose the pieces to keep.

    Parameters
    ----------
    needs : Needs
    top : (n_cells,) float64
        Height that no cell may exceed [m].
    rounds : int
        Number of times that some receivers are taken out and put back.
    seed : int

    Returns
    -------
    kept : (n_pieces,) bool
    heights : (n_cells,) float64
        Of the tops [m].
    """
    np_random = np.random.default_rng(seed)
    groups = len(needs.wanted)
    best: tuple[float, NDArray[np.bool_], NDArray[np.float64]] | None = None
    starts = [np.arange(groups), np.arange(groups)[::-1].copy(), np_random.permutation(groups)]
    for order in starts if rounds and groups > 1 else starts[:1]:
        kept = np.zeros(len(needs.hours), np.bool_)
        heights = _take_turns(needs, top, order, kept, _ROUNDS if rounds else 1)
        volume = float(heights.sum())
        if best is None or volume > best[0] + SLACK:
            best = volume, kept, heights
    assert best is not None
    _, kept, heights = best
    if rounds and groups > 1:
        _exchange(needs, top, kept, heights, rounds, np_random.integers(1 << 30))
    return kept, heights


@njit(cache=True, nogil=True)
def find_heights(needs, top, kept, without=-1):
    """Return the heights (n_cells,) that the kept pieces leave, without those of one group."""
    heights = top.copy()
    crossings = needs.crossings
    for g in range(needs.wanted.size):
        if g == without:
            continue
        first, last = needs.start[needs.group[g]], needs.start[needs.group[g + 1]]
        for u in range(first, last):
            if kept[u]:
                for i in range(crossings.start[u], crossings.start[u + 1]):
                    c = crossings.cell[i]
                    heights[c] = min(heights[c], crossings.clear[i])
    return heights


@njit(cache=True, nogil=True)
def _take_turns(needs, top, order, kept, rounds):
    """Let each group choose its pieces beside those of all others, until none improves."""
    heights = top.copy()
    for g in order:
        _settle(needs, g, heights, kept)
    volume = heights.sum()
    for _ in range(1, rounds):
        for g in order:
            others = find_heights(needs, top, kept, g)
            _settle(needs, g, others, kept)
        heights = find_heights(needs, top, kept)
        if heights.sum() <= volume + 1e-6:
            break
        volume = heights.sum()
    return heights


@njit(cache=True, nogil=True)
def _exchange(needs, top, kept, heights, rounds, seed):
    """Take out groups that bind one place, put them back in another order; keep what is better."""
    np.random.seed(seed)
    groups, cells = needs.wanted.size, top.size
    crossings = needs.crossings
    binding = np.zeros(groups, np.bool_)
    for _ in range(rounds):
        # The place: a cell that is lowered, by chance.
        at = -1
        for _ in range(64):
            c = np.random.randint(cells)
            if heights[c] < top[c] - 1e-9:
                at = c
                break
        if at < 0:
            return
        binding[:] = False
        count = 0
        most = 2 + np.random.randint(7)
        # Groups with a kept piece near the cell's height, most binding first by chance.
        reach = heights[at] + (top[at] - heights[at]) * np.random.random() ** 2
        for g in range(groups):
            if count >= 4 * most:
                break
            done = False
            for u in range(needs.start[needs.group[g]], needs.start[needs.group[g + 1]]):
                if not kept[u]:
                    continue
                for i in range(crossings.start[u], crossings.start[u + 1]):
                    if crossings.cell[i] == at and crossings.clear[i] <= reach:
                        done = True
                        break
                if done:
                    break
            if done:
                binding[g] = True
                count += 1
        some = np.flatnonzero(binding)
        np.random.shuffle(some)
        some = some[:most]
        before = kept.copy()
        for g in some:
            kept[needs.start[needs.group[g]] : needs.start[needs.group[g + 1]]] = False
        tried = find_heights(needs, top, kept)
        for g in some:
            _settle(needs, g, tried, kept)
        for g in some:
            others = find_heights(needs, top, kept, g)
            _settle(needs, g, others, kept)
        tried = find_heights(needs, top, kept)
        if tried.sum() >= heights.sum() - 1e-9:
            heights[:] = tried
        else:
            kept[:] = before


@njit(cache=True, nogil=True)
def _settle(needs, g, heights, kept):
    """Choose the needs of a group that are met, and their pieces; lower the heights by them."""
    first, last = needs.group[g], needs.group[g + 1]
    kept[needs.start[first] : needs.start[last]] = False
    if last - first == 1:
        _keep(needs, first, heights, kept)
        return
    cost = np.empty(last - first)
    for need in range(first, last):
        local = heights.copy()
        before = local.sum()
        can = _keep(needs, need, local, kept)
        cost[need - first] = (before - local.sum()) / needs.weight[need] if can else np.inf
        kept[needs.start[need] : needs.start[need + 1]] = False
    met = 0.0
    for k in np.argsort(cost):
        if met >= needs.wanted[g] - SLACK or cost[k] == np.inf:
            break
        _keep(needs, first + k, heights, kept)
        met += needs.weight[first + k]


@njit(cache=True, nogil=True)
def _keep(needs, need, heights, kept):
    """Choose a need's pieces beside given heights, and lower these; False if there are too few."""
    if needs.measure[need] == SUM:
        return _keep_sum(needs, need, heights, kept)
    return _keep_runs(needs, need, heights, kept)


@njit(cache=True, nogil=True)
def _cost(crossings, u, heights):
    """Return what a piece lowers the heights by."""
    cost = 0.0
    for i in range(crossings.start[u], crossings.start[u + 1]):
        cost += max(heights[crossings.cell[i]] - crossings.clear[i], 0.0)
    return cost


@njit(cache=True, nogil=True)
def _lower(crossings, u, heights):
    for i in range(crossings.start[u], crossings.start[u + 1]):
        c = crossings.cell[i]
        heights[c] = min(heights[c], crossings.clear[i])


@njit(cache=True, nogil=True)
def _keep_sum(needs, need, heights, kept):
    """Choose pieces by their cost per hour, the cheapest first, until their hours are enough."""
    first, last = needs.start[need], needs.start[need + 1]
    limit = needs.limit[need] - SLACK
    met, left = 0.0, 0
    for u in range(first, last):
        left += 1
        met += needs.hours[u]
    if met < limit:
        return False
    is_all = met - needs.hours[first:last].min() < limit if last > first else True
    met = 0.0
    rate = np.empty(last - first)
    while met < limit or is_all:
        for u in range(first, last):
            rate[u - first] = np.inf
            if not kept[u]:
                rate[u - first] = _cost(needs.crossings, u, heights) / needs.hours[u]
        order = np.argsort(rate)
        taken = 0
        size = needs.hours[first + order[0]] if last > first else 1.0
        most = max(1, int((limit - met) / max(size, 1e-9)) // _SHARE)
        for k in order:
            if rate[k] == np.inf:
                break
            if not is_all and rate[k] > 0.0 and (taken >= most or met >= limit):
                break
            if not is_all and met >= limit:
                break
            kept[first + k] = True
            _lower(needs.crossings, first + k, heights)
            met += needs.hours[first + k]
            if rate[k] > 0.0:
                taken += 1
        if is_all:
            break
    return True


@njit(cache=True, nogil=True)
def _keep_runs(needs, need, heights, kept):
    """
    Choose an unbroken spell of the limit's length; or spells of a least length, one by one.

    Each time the stretch with the least cost per hour that is gained is taken: a new spell, or a
    piece at the end of one.
    """
    first, last = needs.start[need], needs.start[need + 1]
    limit = needs.limit[need] - SLACK
    is_one = needs.measure[need] == LONGEST
    length = limit if is_one else needs.least[need] - SLACK
    met = 0.0
    local = heights.copy()
    while met < limit:
        best, best_from, best_to, best_gain = np.inf, -1, -1, 0.0
        for s in range(first, last):
            if kept[s] and (s + 1 >= last or kept[s + 1] or not needs.goes_on[s + 1]):
                continue
            cost, gain, run, e = 0.0, 0.0, 0.0, s
            beside = kept[s] or (s > first and kept[s - 1] and needs.goes_on[s])
            while e < last and (e == s or needs.goes_on[e]):
                run += needs.hours[e]
                if not kept[e]:
                    gain += needs.hours[e]
                    cost += _cost(needs.crossings, e, local)
                    _lower(needs.crossings, e, local)
                if run >= length or (gain > 0.0 and not is_one and beside):
                    break
                if gain > 0.0 and not is_one and e + 1 < last and kept[e + 1]:
                    if needs.goes_on[e + 1]:  # it reaches a spell ahead
                        break
                e += 1
            reaches = e < last and (e == s or needs.goes_on[e])
            if reaches and gain > 0.0:
                rate = cost / gain
                if rate < best:
                    best, best_from, best_to, best_gain = rate, s, e, gain
            for u in range(s, min(e + 1, last)):  # as it was
                for i in range(needs.crossings.start[u], needs.crossings.start[u + 1]):
                    c = needs.crossings.cell[i]
                    local[c] = heights[c]
        if best_from < 0:
            return False
        for u in range(best_from, best_to + 1):
            kept[u] = True
            _lower(needs.crossings, u, heights)
            _lower(needs.crossings, u, local)
        met += best_gain
        if is_one:
            return True
    return True
