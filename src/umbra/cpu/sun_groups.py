"""
Groups of suns that are neighbours in the sky, and the edges in any of their silhouettes.

What may lie between a patch and one sun may also lie between it and the next: it is looked up once
for a group.
"""

import math

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel, take_next

__all__ = ["find_groups", "unite_silhouettes"]

_MOST = 32  # suns of a group
_WIDE = math.radians(20)  # all lie within this angle of their mean
_SLANT = 0.8  # and within this share of its altitude: low suns see across many houses


def find_groups(
    suns: NDArray[np.float64], *, in_order: bool = False
) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
    """
    Divide suns into groups of neighbours, which follow one another in the sky, too.

    Parameters
    ----------
    suns : (n, 3) float64
        Unit directions.
    in_order : bool
        Whether the suns keep their order.

    Returns
    -------
    order : (n,) intp
        Indices of the suns, group after group.
    first : (n_groups + 1,) int64
        First place of each group in ``order``.
    """
    waiting = [np.arange(len(suns))] if len(suns) else []
    groups = []
    while waiting:
        group = waiting.pop()
        own = suns[group]
        middle = own.mean(0)
        length = np.linalg.norm(middle)
        wide = min(_WIDE, _SLANT * math.asin(min(abs(middle[2]) / max(length, 1e-300), 1.0)))
        is_narrow = (own @ middle).min() >= math.cos(wide) * length > 0
        if len(group) == 1 or (len(group) <= _MOST and is_narrow):
            groups.append(group)
            continue
        if not in_order:
            group = group[np.argsort(own[:, np.ptp(own, axis=0).argmax()], kind="stable")]
        parts = max(2, -(-len(group) // _MOST))
        cut = len(group) * (parts // 2) // parts
        waiting += [group[cut:], group[:cut]]
    first = np.cumsum([0, *map(len, groups)])
    return np.concatenate([np.zeros(0, np.intp), *groups]), first.astype(np.int64)


@kernel
def unite_silhouettes(edge, begin, first, n_edges, lengths, united, suns, place, taken):
    """
    Unite the silhouettes of each group's suns, until all groups are taken.

    Parameters
    ----------
    edge : (n,) int32
        Edges of the suns' silhouettes, one sun after another.
    begin : (n_suns + 1,) int64
        First of each sun.
    first : (n_groups + 1,) int64
        First sun of each group.
    n_edges : int
        Number of edges of the caster.
    lengths : (n_groups,) int64
        Written to: number of edges of each group, which are written from ``begin[first]`` on.
    united : (n,) int32
        Written to: edges of each group, each once.
    suns : (n,) int64
        Written to: a bit for each of the group's suns in whose silhouette that edge is.
    place : (n,) int32
        Written to: index among its group's edges of each edge of a silhouette.
    """
    while True:
        g = take_next(taken)
        if g >= first.size - 1:
            return
        places = np.full(n_edges, -1, np.int32)
        base = begin[first[g]]
        n = 0
        for s in range(first[g], first[g + 1]):
            for at in range(begin[s], begin[s + 1]):
                e = edge[at]
                if places[e] < 0:
                    places[e] = n
                    united[base + n] = e
                    n += 1
                place[at] = places[e]
                suns[base + places[e]] |= np.int64(1) << (s - first[g])
        lengths[g] = n
