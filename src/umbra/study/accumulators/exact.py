"""
Times at which each receiver enters and leaves shadow, solved to a tolerance.

Instants are counted at most a minute apart, including the steps' ends and midpoints.
Where two consecutive instants differ at a receiver, the change is bisected: the sun's
position is interpolated, and the ray to it is tested face by face, in float64, with the
same rules. Between two equal instants a receiver is taken not to change, so that sun or
shadow of more than a minute is always found, or of more than half a step if that is
shorter. Sunrise and sunset are solved too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel, run_shared, take_next
from umbra.lights import Lights, Period
from umbra.rays.face_tree import DEEPEST
from umbra.rays.hidden import get, is_hidden
from umbra.study.accumulators.arrays import ResultArrays
from umbra.study.accumulators.intervals import (
    BEGAN,
    BLOCK,
    IntervalState,
    SunIntervalTable,
    end_interval,
)
from umbra.study.accumulators.step_masks import DayIntervals
from umbra.study.loop import TileRun
from umbra.sun import find_sun

__all__ = [
    "ExactIntervals", "SunTrack", "find_least_interval", "find_runs", "find_time_behind_land",
    "follow_sun",
]  # fmt: skip

_LOOK = 60_000_000
"""Longest gap between instants: no longer interval is missed [us]."""
_SECOND = 1_000_000


@dataclass(frozen=True, eq=False)
class SunTrack(Lights):
    """
    Instants with the sun up in time order, and the sun's path.

    Parameters
    ----------
    paths : (n, 3, 3) float64
        Sun directions from the previous instant of the run: at start, middle and end.
        Within half a minute the path is straight, to 0.01 s.
    """

    paths: NDArray[np.float64]


def find_runs(period: Period, day: int) -> list[NDArray[np.int64]]:
    """
    Find the instants of a day to count, one list per period with the sun up before no land.

    Parameters
    ----------
    period : Period
    day : int

    Returns
    -------
    runs : list of (n,) int64
        UTC [us since 1970]: the steps' ends and midpoints with the sun up, instants between
        them at most a minute apart, and sunrise and sunset within the period.
    """
    times = _find_times(period, day)
    is_up = _find_up(period, times)
    change = np.flatnonzero(is_up[1:] != is_up[:-1])
    low, high = times[change], times[change + 1]
    while len(change) and (high - low).max() > 1000:  # 1 ms
        middle = (low + high) // 2
        is_low = _find_up(period, middle) == is_up[change]
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    # Keep the bracket's end with the sun up: later for sunrise, earlier for sunset.
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


def find_least_interval(period: Period) -> float:
    """Return the length above which no interval of sun or shadow is missed [s]."""
    return max(
        float(np.diff(_find_times(period, day)).max()) / _SECOND for day in range(len(period.days))
    )


class ExactIntervals(DayIntervals):
    """
    Accumulator of the solved times at which each receiver enters and leaves shadow.

    Needs a ``SunTrack`` as lights, and a run with tiles.

    Parameters
    ----------
    arrays : ResultArrays
        Written to.
    """

    def __init__(self, arrays: ResultArrays) -> None:
        super().__init__(arrays)
        self._tolerance = round(arrays.results.tolerance * _SECOND)

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin a tile."""
        super().begin(run, lights)
        self._run, self._lights = run, lights
        self._begin_day()

    def _begin_day(self) -> None:
        least = self.arrays.results.min_spell
        self._states = [IntervalState(self._run.shape, least) for _ in self._run.counters]

    def begin_run(self, lights: Lights, span: slice) -> None:
        """Begin at sunrise, or at the start of the day's period."""
        self._before: list[NDArray[np.uint8] | None] = [None] * len(self._states)

    def add(self, lights: Lights, span: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """Add the next instants, and solve the changes between them."""
        for i in range(span.start, span.stop):
            for k, mask in enumerate(masks):
                self._follow(k, mask[i - span.start].ravel(), i)

    def _follow(self, k: int, mask: NDArray[np.uint8], i: int) -> None:
        times, state = self._lights.starts, self._states[k].state
        before = self._before[k]
        if before is None:
            run_shared(-(-mask.size // BLOCK), _begin, mask, times[i], state)
        else:
            tree, places = self._run.tiles[k].tree, self._run.tiles[0].places
            run_shared(
                -(-before.size // 256), _advance, before, mask, times[i - 1], times[i],
                self._lights.paths[i],  # type: ignore[attr-defined]
                self._tolerance, places.points, places.normals, tree,
                self.arrays.results.min_spell, state,
            )  # fmt: skip
        self._before[k] = mask

    def end_run(self, lights: Lights, span: slice) -> None:
        """Close all open intervals when the sun sets."""
        for state in self._states:
            state.end_all(int(lights.starts[span.stop - 1]))

    def finish_day(self, day: int) -> tuple[SunIntervalTable, int]:
        """End the day; the sun is up in each run from first to last instant, and behind land."""
        arrays, times = self.arrays, self._lights.starts
        up = sum(int(times[run.stop - 1] - times[run.start]) for run in self._lights.days[day])
        up += find_time_behind_land(arrays.period, day)
        arrays.up_hours_by_day[day] = up / 3.6e9
        finished = [state.finish() for state in self._states]
        if day + 1 < len(self._lights.days):
            self._begin_day()
        if arrays.shares is None:
            return finished[0], up
        weakened, solid = finished
        intervals = solid if arrays.is_fully_transmissive(day) else weakened
        behind = np.maximum(solid.sun - weakened.sun, 0)
        return intervals.add_behind(behind, float(arrays.shares[day])), up


def _find_times(period: Period, day: int) -> NDArray[np.int64]:
    """Return the ends and midpoints of a day's steps, and instants evenly between."""
    steps = period.steps[day]
    times = np.zeros(2 * len(steps.hours) + 1, np.int64)
    times[::2], times[1::2] = steps.stamps.astype(np.int64), steps.instants.astype(np.int64)
    gaps = np.diff(times)
    parts = -(-gaps // _LOOK)
    first = np.repeat(np.cumsum(parts) - parts, parts)
    index = np.arange(len(first)) - first
    between = np.repeat(times[:-1], parts) + np.repeat(gaps, parts) * index // np.repeat(
        parts, parts
    )
    return np.append(between, times[-1])


def _find_up(period: Period, times: NDArray[np.int64]) -> NDArray[np.bool_]:
    path = find_sun(period.site, times.view("datetime64[us]"), refraction=period.refraction)
    return path.is_up & ~period.meets_land(path.direction)


def find_time_behind_land(period: Period, day: int) -> int:
    """Return the time of a day for which the sun is up behind the land [us]."""
    if period.horizon is None:
        return 0
    both = (find_runs(variant, day) for variant in (replace(period, horizon=None), period))
    whole, free = (sum(int(run[-1] - run[0]) for run in runs) for runs in both)
    return whole - free


@lru_cache(maxsize=4)
def follow_sun(period: Period, tolerance: float) -> SunTrack:
    """
    Find the sun along all days' runs, once for all accumulators.

    Parameters
    ----------
    period : Period
    tolerance : float
        Tolerance of solved instants [s].
    """
    inside = round(tolerance * _SECOND / 2)
    times, suns, paths = [np.zeros(0, np.int64)], [np.zeros((0, 3))], [np.zeros((0, 3, 3))]
    days: list[tuple[slice, ...]] = []
    count = 0
    for day in range(len(period.days)):
        slices = []
        for run in find_runs(period, day):
            # At sunrise and sunset, a moment inside the run.
            seen = np.clip(run, run[0] + inside, max(run[-1] - inside, run[0] + inside))
            between = (run[:-1] + run[1:]) // 2
            sun = find_sun(
                period.site,
                np.concatenate([seen, run, between]).view("datetime64[us]"),
                refraction=period.refraction,
            ).direction
            at, ends, middle = np.split(sun, [len(run), 2 * len(run)])
            times.append(run)
            suns.append(at)
            paths.append(np.zeros((1, 3, 3)))
            paths.append(np.stack([ends[:-1], middle, ends[1:]], 1))
            slices.append(slice(count, count + len(run)))
            count += len(run)
        days.append(tuple(slices))
    instants, vectors = np.concatenate(times), np.zeros((count, 4))
    vectors[:, :3] = np.concatenate(suns)
    return SunTrack(
        vectors, np.zeros((count, 1)), ("shadow",), ("h",), instants, instants,
        _find_steps(period, instants), tuple(days), np.concatenate(paths),
    )  # fmt: skip


def _find_steps(period: Period, times: NDArray[np.int64]) -> NDArray[np.int64]:
    """Find the step whose midpoint each instant is; -1 for other instants."""
    instants = period.instants.astype(np.int64)
    index = np.minimum(np.searchsorted(instants, times), len(instants) - 1)
    return np.where(instants[index] == times, index, -1)


@partial(kernel, boundscheck=False)
def _begin(mask, at, state, taken):
    """Open an interval at each sunlit receiver at the first instant of a run."""
    cells = mask.size
    while True:
        block = take_next(taken)
        if block >= (cells + BLOCK - 1) // BLOCK:
            return
        for c in range(block * BLOCK, min(cells, (block + 1) * BLOCK)):
            if mask[c] == 0:
                state[BEGAN, c] = at


@kernel
def _advance(
    before, after, start, end, path, tolerance, points, normals, tree, least, state, taken
):  # fmt: skip
    """Advance to the next instant: solve the time of each receiver's change."""
    cells = before.size
    steps = path.shape[0] - 1
    while True:
        block = take_next(taken)
        if block >= (cells + 255) // 256:
            return
        stack = np.zeros(DEEPEST, np.int32)
        for c in range(block * 256, min(cells, (block + 1) * 256)):
            if before[c] == after[c]:
                continue
            low = start
            high = end
            p, n = get(points, c), get(normals, c)
            last = -1
            while high - low > tolerance:
                middle = low + (high - low) // 2
                at = steps * ((middle - start) / (end - start))
                k = min(np.int64(at), steps - 1)
                a, b, part = get(path, k), get(path, k + 1), at - k
                d = (
                    a[0] + part * (b[0] - a[0]),
                    a[1] + part * (b[1] - a[1]),
                    a[2] + part * (b[2] - a[2]),
                )
                is_dark = n[0] * d[0] + n[1] * d[1] + n[2] * d[2] <= 0.0
                if not is_dark:
                    face = is_hidden(p, n, d, tree, stack, last)
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
                end_interval(state, c, middle, least)
