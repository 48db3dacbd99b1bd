"""The loop of every study: count each light's shadows and pass them to accumulators."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.lights import Lights, Period
from umbra.receivers.kind import Counter, Receivers, Tile, Variables
from umbra.study.counters import LandCounter, LightCounter
from umbra.study.light_sums import add_up

__all__ = [
    "AT_ONCE", "Accumulator", "TileRun", "count_passes", "make_tile_run", "pass_lights",
]  # fmt: skip

AT_ONCE = 8
"""Number of lights whose masks are held at a time."""
Reach = Callable[[Lights], Iterable[tuple[NDArray[np.intp], Tile]]]


def _ignore(_: int) -> None:
    """Ignore progress."""


@dataclass(frozen=True, eq=False)
class TileRun:
    """
    Receivers of a tile and their counters, for one pass of the lights.

    Parameters
    ----------
    shape : tuple of int
        Of the receivers.
    counters : sequence of Counter
        One of all casters; with canopies a second one without them.
    where : index
        Index of these receivers among all; all of them by default.
    tiles : sequence of Tile
        Tiles of the counters, for accumulators that need single casters or positions. Of a city
        they hold the casters that the study's own lights need.
    reach : callable, optional
        Yields groups of other lights, as indices, each with the tile among all casters that can
        hide them; by default all with that of ``tiles``.
    """

    shape: tuple[int, ...]
    counters: Sequence[Counter]
    where: Any = ...
    tiles: Sequence[Tile] = ()
    reach: "Reach | None" = None

    def find_tiles(self, lights: Lights) -> Iterable[tuple[NDArray[np.intp], Tile, Counter | None]]:
        """
        Yield groups of lights, as indices, each with a tile among all casters that can hide them.

        With each comes the counter of these casters, if there is one already.
        """
        if self.reach is None:
            yield np.arange(len(lights)), self.tiles[0], self.counters[0]
            return
        for indices, tile in self.reach(lights):
            yield indices, tile, None

    def behind_land(self, period: Period | None) -> Self:
        """Return the run with every receiver in shadow while the sun is behind a period's land."""
        if period is None or period.horizon is None:
            return self
        find = period.meets_land
        return replace(
            self, counters=[LandCounter(counter, self.shape, find) for counter in self.counters]
        )

    def add_up(self, lights: Lights) -> NDArray[np.float32]:
        """
        Add the weights of an accumulator's own lights that each receiver does not see.

        Parameters
        ----------
        lights : Lights
            Suns, lamps, directions from anywhere.

        Returns
        -------
        sums : (k, ...) float32
            Sum of each column.
        """
        counter = self.counters[0]
        if not isinstance(getattr(counter, "counter", counter), LightCounter):
            counter = LightCounter(self.tiles[0], counter)
        return add_up(counter, self.shape, lights)


class Accumulator:
    """
    Base of accumulators: one result of the lights counted on receivers.

    Attributes
    ----------
    is_streamed : bool
        Whether lights must come in time order; else ``add_sums`` takes them all at once.
    needs_masks : bool
        Whether ``add`` needs masks of the receivers in shadow.
    more_passes : int
        Number of passes over all lights in ``end``, for progress.
    own_lights : int
        Number of lights of its own, whose progress it reports instead of the study's.
    of_any_date : frozenset of str
        Names of its variables that hold for each date as for all together, such as names. All
        others are results of the whole period, which are not those of a date: a date has only
        those that also come as ``NAME_by_day``.
    """

    is_streamed = True
    needs_masks = True
    more_passes = 0
    own_lights = 0
    of_any_date: frozenset[str] = frozenset()

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin a tile."""

    def add_sums(self, run: TileRun, lights: Lights, progress: Callable[[int], object]) -> None:
        """Add all lights up, in any order."""

    def begin_run(self, lights: Lights, span: slice) -> None:
        """Begin a run of consecutive lights."""

    def add(self, lights: Lights, span: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """
        Add some lights, later than all before.

        Parameters
        ----------
        lights : Lights
        span : slice
            Indices of these lights.
        masks : sequence of (n, ...) uint8
            One per counter: 1 where in shadow.
        """

    def end_run(self, lights: Lights, span: slice) -> None:
        """End a run of lights, before a gap in time."""

    def end_day(self, day: int) -> None:
        """End a day."""

    def end(self, progress: Callable[[int], object]) -> None:
        """End the tile."""

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the results where nothing receives."""

    def variables(self, laid: Receivers) -> Variables:
        """Return its own arrays of the result, after all tiles are counted."""
        return {}


def make_tile_run(
    tile: Tile, canopy: Canopy | None, where: Any = ..., counter: Counter | None = None,
    reach: "Reach | None" = None,
) -> TileRun:  # fmt: skip
    """
    Prepare a tile for counting; with canopies, prepare it again without them.

    Parameters
    ----------
    tile : Tile
    canopy : Canopy, optional
    where : index
        Index of its receivers among all.
    counter : Counter, optional
        Counter of all casters, on any device; the tile's own by default.
    reach : callable, optional
        As of ``TileRun``.
    """
    tiles = [tile] if canopy is None else [tile, tile.with_casters()]
    others = [tile.make_counter() for tile in tiles[1:]]
    return TileRun(tile.shape, [counter or tile.make_counter(), *others], where, tiles, reach)


def pass_lights(
    run: TileRun,
    lights: Lights,
    accumulators: Sequence[Accumulator],
    progress: Callable[[int], object] = _ignore,
) -> None:
    """
    Count lights on the receivers of a tile and feed the accumulators.

    Parameters
    ----------
    run : TileRun
    lights : Lights
    accumulators : sequence of Accumulator
        Called in this order.
    progress : callable
        Called with the number of lights done; each light ``count_passes`` times.
    """
    for accumulator in accumulators:
        accumulator.begin(run, lights)
        if not accumulator.is_streamed:
            accumulator.add_sums(run, lights, progress)
    streamed = [accumulator for accumulator in accumulators if accumulator.is_streamed]
    has_masks = any(accumulator.needs_masks for accumulator in streamed)
    times = len({accumulator.needs_masks for accumulator in streamed})
    directions = lights.directions
    for day, runs in enumerate(lights.days if streamed else ()):
        for whole in runs:
            for accumulator in streamed:
                accumulator.begin_run(lights, whole)
            for first in range(whole.start, whole.stop, AT_ONCE):
                span = slice(first, min(first + AT_ONCE, whole.stop))
                counters = run.counters if has_masks else ()
                masks = [counter.masks(directions[span]) for counter in counters]
                for accumulator in streamed:
                    accumulator.add(lights, span, masks)
                progress(times * (span.stop - span.start))
            for accumulator in streamed:
                accumulator.end_run(lights, whole)
        for accumulator in streamed:
            accumulator.end_day(day)
    for accumulator in accumulators:
        accumulator.end(progress)


def count_passes(accumulators: Sequence[Accumulator]) -> int:
    """
    Count the progress reports of each light: for its masks, sums and single casters.

    Parameters
    ----------
    accumulators : sequence of Accumulator
    """
    sums = sum(
        not accumulator.is_streamed and not accumulator.own_lights for accumulator in accumulators
    )
    more = sum(accumulator.more_passes for accumulator in accumulators)
    return (
        sums
        + more
        + len({accumulator.needs_masks for accumulator in accumulators if accumulator.is_streamed})
    )
