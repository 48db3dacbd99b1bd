"""
When each receiver enters and leaves shadow, solved to a tolerance.

The instants at the steps' ends and midpoints are counted as ever. Where two that follow
one another differ at a receiver, the instant of the change is bisected: the sun's place
is found in between, and the way to it is tried face by face, in float64, with the same
rules. Between two instants that agree a receiver is taken to stay as it is, so a spell
shorter than half a step can be missed; a smaller step finds it. Sunrise and sunset are
solved too.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.cpu.face_tree import FaceTree
from umbra.cpu.rays import is_hidden
from umbra.study.counting import Counter, enter_day, enter_period
from umbra.study.ledger import Ledger
from umbra.study.period import Period
from umbra.study.receivers import Places
from umbra.study.spells import BEGAN, BLOCK, Spells, SpellState, end_spell, join_days
from umbra.sun import find_sun

__all__ = ["count_exactly", "find_runs"]

_NODE = 30_000_000  # the sun's path is straight between instants so far apart, to 0.01 s [us]
_SECOND = 1_000_000


def find_runs(period: Period, day: int) -> list[NDArray[np.int64]]:
    """
    Find the instants of a day to be counted, one list for each time the sun is up.

    Parameters
    ----------
    period : Period
    day : int

    Returns
    -------
    runs : list of (n,) int64
        UTC [us since 1970]: the steps' ends and midpoints with the sun up, and sunrise
        and sunset where they fall into the period.
    """
    steps = period.steps[day]
    times = np.zeros(2 * len(steps.hours) + 1, np.int64)
    times[::2], times[1::2] = steps.stamps.astype(np.int64), steps.instants.astype(np.int64)
    is_up = _find_up(period, times)
    change = np.flatnonzero(is_up[1:] != is_up[:-1])
    low, high = times[change], times[change + 1]
    while len(change) and (high - low).max() > 1000:  # a thousandth of a second
        middle = (low + high) // 2
        is_low = _find_up(period, middle) == is_up[change]
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    # The instant of a change belongs to the sun: the later for sunrise, the earlier for sunset.
    edges = np.where(is_up[change], low, high)
    runs = []
    for part in np.split(np.arange(len(times)), change + 1):
        if not is_up[part[0]]:
            continue
        run = times[part]
        if part[0] > 0:
            run = np.append(edges[np.searchsorted(change, part[0] - 1)], run)
        if part[-1] < len(times) - 1:
            run = np.append(run, edges[np.searchsorted(change, part[-1])])
        runs.append(np.unique(run))
    return [run for run in runs if len(run) > 1]


def count_exactly(
    counter: Counter,
    places: Places,
    tree: FaceTree,
    shape: tuple[int, ...],
    ledger: Ledger,
    where: Any = ...,
    progress: Callable[[int], object] = lambda _: None,
) -> None:
    """
    Solve when each receiver enters and leaves shadow; enter its hours and spells.

    Parameters
    ----------
    counter : Counter
        Of these receivers.
    places : Places
        The same receivers, flat.
    tree : FaceTree
        Of what casts.
    shape : tuple of int
    ledger : Ledger
        Written to.
    where : index
        Where these receivers lie among the ledger's.
    progress : callable
        Told how many steps with the sun up were done, now and then.
    """
    period, wanted = ledger.period, ledger.wanted
    owner = period.day_of_step
    everything = 0
    days: list[Spells] = []
    for day in range(len(period.days)):
        state = SpellState(shape, wanted.min_spell)
        runs = find_runs(period, day)
        up = sum(int(run[-1] - run[0]) for run in runs)
        told, steps = 0, int(period.sun.is_up[owner == day].sum())
        for run in runs:
            before = None
            for first in range(0, len(run), 8):
                masks = counter.masks(_find_directions(period, run, first, wanted.tolerance))
                _keep(ledger, run[first : first + 8], masks, where)
                for i, mask in enumerate(masks.reshape(len(masks), -1), first):
                    if before is None:
                        _begin(mask, run[0], state.state)
                    else:
                        _advance(
                            before, mask, run[i - 1], run[i],
                            _find_path(period, run[i - 1], run[i]),
                            round(wanted.tolerance * _SECOND), places.points, places.normals,
                            tree.boxes, tree.links, tree.corners, tree.ids, tree.normals,
                            wanted.min_spell, state.state,
                        )  # fmt: skip
                    before = mask
                done = min(steps, steps * (first + 8) // len(run)) - told
                if done > 0:
                    progress(done)
                    told += done
            state.end_all(int(run[-1]))
        if told < steps:
            progress(steps - told)
        spells = state.finish()
        ledger.up_hours_by_day[day] = up / 3.6e9
        enter_day(ledger, spells, up, where, day)
        days = [join_days([*days, spells])]
        everything += up
    enter_period(ledger, days[0], everything, where)


def _keep(ledger: Ledger, times: NDArray[np.int64], masks: NDArray[np.uint8], where: Any) -> None:
    """Keep the masks of the instants that are steps' midpoints, if masks are asked for."""
    if ledger.masks is None:
        return
    instants = ledger.period.instants.astype(np.int64)
    place = np.minimum(np.searchsorted(instants, times), len(instants) - 1)
    is_middle = instants[place] == times
    ledger.masks.keep(place[is_middle], masks[is_middle], where)


def _find_up(period: Period, times: NDArray[np.int64]) -> NDArray[np.bool_]:
    path = find_sun(period.site, times.view("datetime64[us]"), refraction=period.refraction)
    return path.is_up


def _find_directions(
    period: Period, run: NDArray[np.int64], first: int, tolerance: float
) -> NDArray[np.float64]:
    """Give the sun at the next few instants; at sunrise and sunset a moment within the run."""
    inside = round(tolerance * _SECOND / 2)
    some = np.clip(run[first : first + 8], run[0] + inside, max(run[-1] - inside, run[0] + inside))
    return find_sun(
        period.site, some.view("datetime64[us]"), refraction=period.refraction
    ).direction


def _find_path(period: Period, start: int, end: int) -> NDArray[np.float64]:
    """Give the sun at equal distances from one instant to another, (n, 3)."""
    count = -(-int(end - start) // _NODE) + 1
    times = np.linspace(start, end, max(count, 2)).astype(np.int64)
    return find_sun(
        period.site, times.view("datetime64[us]"), refraction=period.refraction
    ).direction


@njit(cache=True, nogil=True, parallel=True, boundscheck=False)
def _begin(mask, at, state):
    """Begin a spell wherever the sun is at the first instant of a run."""
    cells = mask.size
    for block in prange((cells + BLOCK - 1) // BLOCK):
        for c in range(block * BLOCK, min(cells, (block + 1) * BLOCK)):
            if mask[c] == 0:
                state[BEGAN, c] = at


@njit(cache=True, nogil=True, parallel=True)
def _advance(
    before, after, start, end, path, tolerance, points, normals,
    boxes, links, corners, ids, face_normals, least, state,
):  # fmt: skip
    """Go from one instant to the next: where the receiver changed, solve when."""
    cells = before.size
    steps = path.shape[0] - 1
    for block in prange((cells + 255) // 256):
        d = np.empty(3)
        for c in range(block * 256, min(cells, (block + 1) * 256)):
            if before[c] == after[c]:
                continue
            low = start
            high = end
            n = normals[c]
            last = -1
            while high - low > tolerance:
                middle = low + (high - low) // 2
                at = steps * ((middle - start) / (end - start))
                k = min(np.int64(at), steps - 1)
                for j in range(3):
                    d[j] = path[k, j] + (at - k) * (path[k + 1, j] - path[k, j])
                is_dark = n[0] * d[0] + n[1] * d[1] + n[2] * d[2] <= 0.0
                if not is_dark:
                    face = is_hidden(
                        points[c], n, d, boxes, links, corners, ids, face_normals, last
                    )
                    is_dark = face >= 0
                    if is_dark:
                        last = face
                if is_dark == (before[c] != 0):
                    low = middle
                else:
                    high = middle
            middle = low + (high - low) // 2
            if before[c] != 0:
                state[BEGAN, c] = middle
            else:
                end_spell(state, c, middle, least)
