"""Raising cells, one after the other, until each is capped or would break a rule."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.massing.needs import SLACK, Needs, measure_lit

__all__ = ["fill_up"]


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


@njit(cache=True, nogil=True)
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
