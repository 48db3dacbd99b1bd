"""The one loop of every study: lights pass over receivers, accumulators see their shadows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.receivers.kind import Counter, Receivers, Tile, Variables
from umbra.study.lights import Lights

__all__ = [
    "AT_ONCE", "Accumulator", "TileRun", "add_up", "count_passes", "look", "make_advance",
    "pass_lights",
]  # fmt: skip

AT_ONCE = 8
"""Lights whose masks are held at a time."""
_FEW = 4  # lights of equal weight, on average, from which their integers are added


def _ignore(_: int) -> None:
    """Ignore progress."""


@dataclass(frozen=True, eq=False)
class TileRun:
    """
    Some receivers while lights pass over them.

    Parameters
    ----------
    shape : tuple of int
        Of the receivers.
    counters : sequence of Counter
        Of all that casts; if there are canopies, then a second one without them.
    where : index
        Index of these receivers among all; all of them by default.
    tiles : sequence of Tile
        Tiles of the counters, where accumulators ask for single casters or places.
    """

    shape: tuple[int, ...]
    counters: Sequence[Counter]
    where: Any = ...
    tiles: Sequence[Tile] = ()


class Accumulator:
    """
    Keeps a result of the lights that pass over receivers.

    Attributes
    ----------
    is_streamed : bool
        Whether lights have to pass in time order; else ``add_sums`` takes them all at once.
    needs_masks : bool
        Whether ``add`` needs to know which receivers are in shadow.
    more_passes : int
        How many times it tells progress of all lights in ``end``.
    """

    is_streamed = True
    needs_masks = True
    more_passes = 0

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin with a tile."""

    def add_sums(self, run: TileRun, lights: Lights, progress: Callable[[int], object]) -> None:
        """Add all lights up, in any order."""

    def begin_run(self, lights: Lights, some: slice) -> None:
        """Begin with lights that follow one another."""

    def add(self, lights: Lights, some: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """
        Add some lights, later than all before.

        Parameters
        ----------
        lights : Lights
        some : slice
            Indices of these lights.
        masks : sequence of (n, ...) uint8
            Of each counter: 1 where in shadow.
        """

    def end_run(self, lights: Lights, some: slice) -> None:
        """End a run of lights: after it comes a gap in time."""

    def end_day(self, day: int) -> None:
        """End a day."""

    def end(self, progress: Callable[[int], object]) -> None:
        """End the tile."""

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the results where nothing receives."""

    def variables(self, laid: Receivers) -> Variables:
        """Return the arrays of the result that it holds itself, when all tiles are counted."""
        return {}


def look(
    tile: Tile, canopy: Canopy | None, where: Any = ..., counter: Counter | None = None
) -> TileRun:
    """
    Make a tile ready for lights to pass, a second time without canopies if there are any.

    Parameters
    ----------
    tile : Tile
    canopy : Canopy, optional
    where : index
        Index of its receivers among all.
    counter : Counter, optional
        Of all that casts, on some device; the tile's own by default.
    """
    tiles = [tile] if canopy is None else [tile, tile.with_casters()]
    others = [one.make_counter() for one in tiles[1:]]
    return TileRun(tile.shape, [counter or tile.make_counter(), *others], where, tiles)


def pass_lights(
    run: TileRun,
    lights: Lights,
    accumulators: Sequence[Accumulator],
    progress: Callable[[int], object] = _ignore,
) -> None:
    """
    Let lights pass over the receivers of a tile.

    Parameters
    ----------
    run : TileRun
    lights : Lights
    accumulators : sequence of Accumulator
        Told in this order.
    progress : callable
        Told how many lights were done, now and then; of each ``count_passes`` times.
    """
    for one in accumulators:
        one.begin(run, lights)
        if not one.is_streamed:
            one.add_sums(run, lights, progress)
    streamed = [one for one in accumulators if one.is_streamed]
    has_masks = any(one.needs_masks for one in streamed)
    times = len({one.needs_masks for one in streamed})
    directions = lights.directions
    for day, runs in enumerate(lights.days if streamed else ()):
        for whole in runs:
            for one in streamed:
                one.begin_run(lights, whole)
            for first in range(whole.start, whole.stop, AT_ONCE):
                some = slice(first, min(first + AT_ONCE, whole.stop))
                counters = run.counters if has_masks else ()
                masks = [counter.masks(directions[some]) for counter in counters]
                for one in streamed:
                    one.add(lights, some, masks)
                progress(times * (some.stop - some.start))
            for one in streamed:
                one.end_run(lights, whole)
        for one in streamed:
            one.end_day(day)
    for one in accumulators:
        one.end(progress)


def count_passes(accumulators: Sequence[Accumulator]) -> int:
    """
    Count how often progress is told of each light: for its masks, sums and single casters.

    Parameters
    ----------
    accumulators : sequence of Accumulator
    """
    sums = sum(not one.is_streamed for one in accumulators)
    more = sum(one.more_passes for one in accumulators)
    return sums + more + len({one.needs_masks for one in accumulators if one.is_streamed})


def add_up(
    counter: Counter,
    shape: tuple[int, ...],
    lights: Lights,
    progress: Callable[[int], object] = _ignore,
) -> NDArray[np.float32]:
    """
    Add the weights of the lights that each receiver does not see.

    Where many lights weigh the same they are counted in integers, so that the sum does not
    depend on their order; else masks are weighed one by one.

    Parameters
    ----------
    counter : Counter
    shape : tuple of int
        Of the receivers.
    lights : Lights
    progress : callable

    Returns
    -------
    sums : (k, ...) float32
        Of each column.
    """
    sums = np.zeros((lights.weights.shape[1], *shape), np.float32)
    rows, group = np.unique(lights.weights, axis=0, return_inverse=True)
    group, directions = group.ravel(), lights.directions
    if _FEW * len(rows) > len(lights) > _FEW * lights.weights.shape[1]:
        weights = lights.weights.astype(np.float32)
        for first in range(0, len(lights), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            masks = counter.masks(directions[some]).astype(np.float32)
            sums += np.tensordot(weights[some].T, masks, 1)
            progress(len(masks))
        return sums
    for k, row in enumerate(rows):
        counts = np.zeros(shape, np.int32)
        counter.add_steps(directions[group == k], counts, progress)
        for column in np.flatnonzero(row):
            total, weight = np.atleast_2d(sums[column]), np.float32(row[column])
            for i, some in enumerate(np.atleast_2d(counts)):  # row by row: no copy of them all
                total[i] += np.multiply(some, weight, dtype=np.float32)
    return sums


def make_advance(
    progress: Callable[[int, int], object], tile: int, tiles: int, works: int
) -> Callable[[int], object]:
    """Return progress within one of several tiles of equal work as progress of all tiles."""
    done = tile * works

    def advance(n: int) -> None:
        nonlocal done
        if n:  # in a night there is nothing to tell
            done += n
            progress(done, tiles * works)

    return advance
