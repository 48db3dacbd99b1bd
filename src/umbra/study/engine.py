"""
The engine: tiles of any receivers, any lights, counters of any device, all accumulators.

A study, a chunk, the tiles of a city, ``umbra.count`` and the instants of a page are calls of
``count_each_tile``.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.devices import StudyCounters
from umbra.lights import Lights, Period
from umbra.receivers.kind import Counter, Tile
from umbra.study.counters import RayCounter
from umbra.study.light_sums import add_up
from umbra.study.loop import Accumulator, TileRun, count_passes, make_tile_run, pass_lights

__all__ = ["HiddenSums", "Progress", "count_each_tile", "run_by_tiles", "run_on_device"]

MakeRun = Callable[[int, Any, Tile], TileRun]
Progress = Callable[[int, int], object]
_warm: set[type] = set()
"""Counters whose kernels have run in this process."""


def count_each_tile(
    tiles: Sequence[tuple[Any, Callable[[], Tile]]],
    lights: Lights,
    accumulators: Sequence[Accumulator],
    make_run: MakeRun,
    progress: Progress = lambda _done, _all: None,
) -> float:
    """
    Count lights on all tiles of receivers, one after the other, and feed the accumulators.

    Parameters
    ----------
    tiles : sequence
        Index of each tile's receivers among all, and a callable that makes the tile.
    lights : Lights
        For accumulators without lights of their own.
    accumulators : sequence of Accumulator
    make_run : callable
        Makes the run of a tile, of its number, its index and itself.
    progress : callable
        Called with the number of lights done and the total.

    Returns
    -------
    seconds : float
        Time spent counting, without making tiles [s].
    """
    works = len(lights) * count_passes(accumulators)
    works += sum(accumulator.own_lights for accumulator in accumulators)
    seconds = 0.0
    for n, (where, make_tile) in enumerate(tiles):
        run = make_run(n, where, make_tile())
        started = time.perf_counter()
        pass_lights(run, lights, accumulators, _make_advance(progress, n, len(tiles), works))
        seconds += time.perf_counter() - started
        del run  # else two tiles are held while the next is made
    return seconds


def run_by_tiles(canopy: Canopy | None, period: Period | None = None) -> MakeRun:
    """Count each tile by its own counter, and suns behind the land of a period as shadow."""
    return lambda _n, where, tile: make_tile_run(tile, canopy, where).behind_land(period)


def run_on_device(
    counters: StudyCounters, canopy: Canopy | None, suns: NDArray[np.float64],
    period: Period | None = None,
) -> MakeRun:  # fmt: skip
    """Count each tile on a device, whose kernels are loaded for suns (n, 3) before the clock."""

    def make_run(_number: int, where: Any, tile: Tile) -> TileRun:
        counter = counters.make(tile)
        if type(counter) not in _warm and len(suns):
            trial = np.ascontiguousarray(suns[:2])  # as a single one has kernels of its own
            once = np.ones((len(trial), 1), np.int32)
            counter.add_weights(trial, once, np.zeros((1, *tile.shape), np.int32))
            _warm.add(type(counter))
        return make_tile_run(tile, canopy, where, counter).behind_land(period)

    return make_run


def _make_advance(progress: Progress, tile: int, tiles: int, works: int) -> Callable[[int], object]:
    """Return a callback that turns a tile's progress into progress of all tiles."""
    done = tile * works

    def advance(n: int) -> None:
        nonlocal done
        if n:  # nights report nothing
            done += n
            progress(done, tiles * works)

    return advance


class HiddenSums(Accumulator):
    """
    Accumulator of the weights of lights that each receiver does not see.

    Canopies hide the share of a light that they do not transmit, with leaves.

    Parameters
    ----------
    suns, others : Lights
        Directions above the horizon; all other lights, which rays count.
    shape : tuple of int
        Of the receivers.
    canopy : Canopy, optional
    """

    is_streamed = False
    needs_masks = False

    def __init__(
        self, suns: Lights, others: Lights, shape: tuple[int, ...], canopy: Canopy | None
    ) -> None:
        self._suns, self._others, self._canopy = suns, others, canopy
        self.sums = np.zeros((suns.weights.shape[1], *shape), np.float32)

    def add_sums(self, run: TileRun, lights: Lights, progress: Callable[[int], object]) -> None:
        """Add the hidden weights of a tile, of all casters and of all but canopies."""
        inside = run.where if isinstance(run.where, tuple) else (run.where,)
        pairs = zip(run.tiles, run.counters, strict=True)
        hidden, *opaque = [self._add(tile, counter) for tile, counter in pairs]
        if self._canopy is not None:
            (dark,) = opaque
            share = np.float32(1 - self._canopy.season.with_leaves)
            hidden = dark + share * (hidden - dark)
        self.sums[:, *inside] += hidden

    def _add(self, tile: Tile, counter: Counter) -> NDArray[np.float32]:
        """Add up on a tile the weights of all lights that are hidden."""
        hidden = np.zeros((len(self.sums), *tile.shape), np.float32)
        if len(self._suns):
            hidden += add_up(counter, tile.shape, self._suns)
        if len(self._others):
            hidden += add_up(RayCounter(tile, tile.casting.threads), tile.shape, self._others)
        return hidden

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the results where nothing receives."""
        self.sums[:, nothing] = np.nan
