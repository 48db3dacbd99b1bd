"""
When each receiver enters and leaves shadow, solved to a tolerance.

Instants are counted as ever, a minute apart at most, the steps' ends and midpoints among
them. Where two that follow one another differ at a receiver, the instant of the change is
bisected: the sun's place is found in between, and the way to it is tried face by face, in
float64, with the same rules. Between two instants that agree a receiver is taken to stay
as it is, so that sun or shadow of more than a minute is surely found, whatever the step;
with a smaller step also what is longer than half of it. Sunrise and sunset are solved too.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import is_hidden
from umbra.receivers.kind import Counter
from umbra.scene.places import Places
from umbra.study.counting import enter_day, enter_period
from umbra.study.ledger import Ledger
from umbra.study.period import Period
from umbra.study.spells import BEGAN, BLOCK, Spells, SpellState, end_spell, join_days
from umbra.sun import find_sun

__all__ = ["Caught", "count_exactly", "find_least_spell", "find_runs"]

_LOOK = 60_000_000
"""Instants are at most so far apart, so that nothing longer is missed [us]."""


@dataclass(frozen=True, eq=False)
class _Run:
    """
    Instants with the sun up, one after another, and the sun.

    Parameters
    ----------
    times : (n,) int64
        UTC [us since 1970].
    suns : (n, 3) float64
        At these.
    paths : (n - 1, 3, 3) float64
        From each to the next: at its beginning, middle and end. Within half a minute
        the path is straight, to 0.01 s.
    """

    times: NDArray[np.int64]
    suns: NDArray[np.float64]
    paths: NDArray[np.float64]


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
        UTC [us since 1970]: the steps' ends and midpoints with the sun up, instants
        between them at most a minute apart, and sunrise and sunset where they fall into
        the period.
    """
    times = _find_times(period, day)
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


def find_least_spell(period: Period) -> float:
    """Give the length from which no spell of sun or shadow is missed [s]."""
    return max(
        float(np.diff(_find_times(period, day)).max()) / _SECOND for day in range(len(period.days))
    )


@dataclass(eq=False)
class Caught:
    """
    Receivers and what casts on them, followed from instant to instant.

    Parameters
    ----------
    counter : Counter
        Of these receivers.
    tree : FaceTree
        Of what casts in it.
    """

    counter: Counter
    tree: FaceTree
    state: SpellState = field(init=False)
    before: NDArray[np.uint8] | None = None


def count_exactly(
    caught: Sequence[Caught],
    places: Places,
    shape: tuple[int, ...],
    ledger: Ledger,
    where: Any = ...,
    progress: Callable[[int], object] = lambda _: None,
) -> None:
    """
    Solve when each receiver enters and leaves shadow; enter its hours and spells.

    Parameters
    ----------
    caught : sequence of Caught
        All that casts; if there are canopies, then without them.
    places : Places
        The same receivers, flat.
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
        for one in caught:
            one.state = SpellState(shape, wanted.min_spell)
        runs = _follow_sun(period, day, wanted.tolerance)
        up = sum(int(run.times[-1] - run.times[0]) for run in runs)
        told, steps = 0, int(period.sun.is_up[owner == day].sum())
        for run in runs:
            for one in caught:
                one.before = None
            count = len(run.times)
            for first in range(0, count, 8):
                masks = [one.counter.masks(run.suns[first : first + 8]) for one in caught]
                _keep(ledger, run.times[first : first + 8], masks, where)
                for i in range(first, min(first + 8, count)):
                    for one, mask in zip(caught, masks):
                        _follow(one, mask[i - first].ravel(), run, i, places, ledger)
                done = min(steps, steps * (first + 8) // count) - told
                if done > 0:
                    progress(done)
                    told += done
            for one in caught:
                one.state.end_all(int(run.times[-1]))
        if told < steps:
            progress(steps - told)
        spells = _weigh([one.state.finish() for one in caught], ledger, day)
        ledger.up_hours_by_day[day] = up / 3.6e9
        enter_day(ledger, spells, up, where, day)
        days = [join_days([*days, spells])]
        everything += up
    enter_period(ledger, days[0], everything, where)


def _follow(
    one: Caught,
    mask: NDArray[np.uint8],
    run: _Run,
    i: int,
    places: Places,
    ledger: Ledger,
) -> None:
    """Go on to the next instant of a run."""
    if one.before is None:
        _begin(mask, run.times[0], one.state.state)
    else:
        tree = one.tree
        _advance(
            one.before, mask, run.times[i - 1], run.times[i], run.paths[i - 1],
            round(ledger.wanted.tolerance * _SECOND), places.points, places.normals, tree.boxes,
            tree.links, tree.corners, tree.ids, tree.normals, ledger.wanted.min_spell,
            one.state.state,
        )  # fmt: skip
    one.before = mask


def _weigh(found: list[Spells], ledger: Ledger, day: int) -> Spells:
    """Give the spells of a day with the time behind canopies, if there are any."""
    if ledger.shares is None:
        return found[0]
    weakened, solid = found
    spells = solid if ledger.lets_all_through(day) else weakened
    return spells.add_behind(np.maximum(solid.sun - weakened.sun, 0), float(ledger.shares[day]))


def _find_times(period: Period, day: int) -> NDArray[np.int64]:
    """Give a day's steps' ends and midpoints, and what lies evenly between them."""
    steps = period.steps[day]
    times = np.zeros(2 * len(steps.hours) + 1, np.int64)
    times[::2], times[1::2] = steps.stamps.astype(np.int64), steps.instants.astype(np.int64)
    gaps = np.diff(times)
    parts = -(-gaps // _LOOK)
    first = np.repeat(np.cumsum(parts) - parts, parts)
    place = np.arange(len(first)) - first
    between = np.repeat(times[:-1], parts) + np.repeat(gaps, parts) * place // np.repeat(
        parts, parts
    )
    return np.append(between, times[-1])


def _keep(
    ledger: Ledger, times: NDArray[np.int64], masks: list[NDArray[np.uint8]], where: Any
) -> None:
    """Keep the masks of the instants that are steps' midpoints, if masks are asked for."""
    if ledger.masks is None:
        return
    instants = ledger.period.instants.astype(np.int64)
    place = np.minimum(np.searchsorted(instants, times), len(instants) - 1)
    is_middle = instants[place] == times
    dark = masks[-1][is_middle]
    behind = masks[0][is_middle] & ~dark if len(masks) > 1 else None
    ledger.keep_masks(place[is_middle], dark, behind, where)


def _find_up(period: Period, times: NDArray[np.int64]) -> NDArray[np.bool_]:
    path = find_sun(period.site, times.view("datetime64[us]"), refraction=period.refraction)
    return path.is_up


@lru_cache(maxsize=32)
def _follow_sun(period: Period, day: int, tolerance: float) -> list[_Run]:
    """Find the sun along a day's runs, once for all that is counted on it."""
    found = []
    inside = round(tolerance * _SECOND / 2)
    for times in find_runs(period, day):
        # At sunrise and sunset a moment within the run.
        seen = np.clip(times, times[0] + inside, max(times[-1] - inside, times[0] + inside))
        between = (times[:-1] + times[1:]) // 2
        sun = find_sun(
            period.site,
            np.concatenate([seen, times, between]).view("datetime64[us]"),
            refraction=period.refraction,
        ).direction
        suns, ends, middle = np.split(sun, [len(times), 2 * len(times)])
        found.append(_Run(times, suns, np.stack([ends[:-1], middle, ends[1:]], 1)))
    return found


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
