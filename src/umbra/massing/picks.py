"""
The best pieces of one group beside given heights.

What a piece costs is the height that it takes from the cells that it crosses, where they are higher
than its planes; pieces that share cells cost less together.
"""

import numpy as np

from umbra.kernels import kernel
from umbra.massing.planes import LONGEST, SLACK, SUM

__all__ = ["NOT_DEAR", "keep_enough"]

NOT_DEAR = np.zeros(0)
_FEW, _TIMES = 64, 4
"""Members of a group from which costs are found so many times at most."""
_SHARE = 6
"""Of the pieces that are still needed, one by this is taken before costs are found again."""


@kernel
def keep_enough(needs, g, heights, is_kept, dear=NOT_DEAR):
    """
    Choose the needs of a group that are met, and their pieces; lower the heights by them.

    Members are taken by what they cost beside those that are taken already, the cheapest first;
    ``dear`` (n_needs,) are factors of their costs, none if empty.
    """
    first, last = needs.group[g], needs.group[g + 1]
    is_kept[needs.start[first] : needs.start[last]] = False
    if last - first == 1:
        _keep(needs, first, heights, is_kept)
        return
    met = 0.0
    cost = np.zeros(last - first)
    taken = np.zeros(last - first, np.bool_)
    while met < needs.wanted[g] - SLACK:
        for need in range(first, last):
            if taken[need - first]:
                cost[need - first] = np.inf
                continue
            local = heights.copy()
            before = local.sum()
            can = _keep(needs, need, local, is_kept)
            cost[need - first] = (before - local.sum()) / needs.weight[need] if can else np.inf
            if dear.size:
                cost[need - first] *= dear[need]
            is_kept[needs.start[need] : needs.start[need + 1]] = False
        # Many are taken at once, as their costs change little then.
        left = last - first - taken.sum()
        most = max(1, left // _SHARE)
        if last - first > _FEW:
            most = max(most, (last - first) // _TIMES)
        count = 0
        for k in np.argsort(cost):
            if met >= needs.wanted[g] - SLACK or cost[k] == np.inf or count >= most:
                break
            _keep(needs, first + k, heights, is_kept)
            taken[k] = True
            met += needs.weight[first + k]
            count += 1
        if count == 0:
            break


@kernel
def _keep(needs, need, heights, is_kept):
    """Choose a need's pieces beside given heights, and lower these; False if there are too few."""
    if needs.measure[need] == SUM:
        return _keep_sum(needs, need, heights, is_kept)
    return _keep_runs(needs, need, heights, is_kept)


@kernel
def _cost(crossings, u, heights):
    """Return what a piece lowers the heights by."""
    cost = 0.0
    for i in range(crossings.start[u], crossings.start[u + 1]):
        cost += max(heights[crossings.cell[i]] - crossings.clear[i], 0.0)
    return cost


@kernel
def _lower(crossings, u, heights):
    for i in range(crossings.start[u], crossings.start[u + 1]):
        c = crossings.cell[i]
        heights[c] = min(heights[c], crossings.clear[i])


@kernel
def _keep_sum(needs, need, heights, is_kept):
    """Choose pieces by their cost per hour, the cheapest first, until their hours are enough."""
    first, last = needs.start[need], needs.start[need + 1]
    limit = needs.limit[need] - SLACK
    met = needs.hours[first:last].sum()
    if met < limit:
        return False
    is_all = met - needs.hours[first:last].min() < limit if last > first else True
    met = 0.0
    rate = np.empty(last - first)
    while met < limit or is_all:
        for u in range(first, last):
            rate[u - first] = np.inf
            if not is_kept[u]:
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
            is_kept[first + k] = True
            _lower(needs.crossings, first + k, heights)
            met += needs.hours[first + k]
            if rate[k] > 0.0:
                taken += 1
        if is_all:
            break
    return True


@kernel
def _keep_runs(needs, need, heights, is_kept):
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
            if is_kept[s] and (s + 1 >= last or is_kept[s + 1] or not needs.goes_on[s + 1]):
                continue
            cost, gain, run, e = 0.0, 0.0, 0.0, s
            beside = is_kept[s] or (s > first and is_kept[s - 1] and needs.goes_on[s])
            while e < last and (e == s or needs.goes_on[e]):
                run += needs.hours[e]
                if not is_kept[e]:
                    gain += needs.hours[e]
                    cost += _cost(needs.crossings, e, local)
                    _lower(needs.crossings, e, local)
                if run >= length or (gain > 0.0 and not is_one and beside):
                    break
                is_met = e + 1 < last and is_kept[e + 1] and needs.goes_on[e + 1]
                if gain > 0.0 and not is_one and is_met:  # it reaches a spell ahead
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
            is_kept[u] = True
            _lower(needs.crossings, u, heights)
            _lower(needs.crossings, u, local)
        met += best_gain
        if is_one:
            return True
    return True
