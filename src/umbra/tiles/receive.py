"""
The loop over the lights on some receivers of a city, with the groups of its casters.

Counter of a city's tile whose casters follow the lights that it is asked to count.

Counter of a window for many suns: those of each height with the casters that they need.

A low sun's shadows come from afar; few suns are low. If all casters that reach a window at any time
were counted for every sun, most of a year's work would be for casters whose shadows end far away.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights
from umbra.receivers.kind import Counter, Tile
from umbra.study.accumulators.attribution import Attribution
from umbra.study.compare import NeighbourSums
from umbra.study.counters import LightCounter, split_lights
from umbra.study.engine import count_each_tile
from umbra.study.loop import TileRun, make_tile_run
from umbra.study.result import Study
from umbra.tiles.city_proposal import find_neighbours
from umbra.tiles.job import WorkerContext

__all__ = ["ReachingCounter", "SunGroups", "Tiles", "count_receivers", "group_lights", "group_suns"]

_EDGES = np.sin(np.radians([0.5, 1, 2, 4, 8, 15, 30]))
LEAST = 128
"""Suns of a group: casters are prepared in the time in which some 100 suns are counted."""


class SunGroups:
    """
    Counter that prepares casters anew for each group of suns, one group after the other.

    Parameters
    ----------
    make : callable
        Returns the counter of the casters that can reach the receivers from some suns (n, 3).
    """

    def __init__(self, make: Callable[[NDArray[np.float64]], Counter]) -> None:
        self._make = make

    def add_weights(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each receiver the weights (n, k) of the suns that leave it in shadow."""
        for group in group_suns(suns):
            self._make(suns[group]).add_weights(suns[group], weights[group], sums, progress)

    def split(self, suns: NDArray[np.float64]) -> Iterator[tuple[NDArray[np.bool_], Counter]]:
        """Yield the groups of suns, each with the counter of the casters that it needs."""
        for group in group_suns(suns):
            run = np.zeros(len(suns), np.bool_)
            run[group] = True
            yield run, self._make(suns[group])

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each sun the receivers in shadow, cast or attached."""
        return self._make(suns).masks(suns)


def group_lights(lights: Lights) -> Iterator[NDArray[np.intp]]:
    """Yield the indices of lights: those of suns of similar height, then all others."""
    suns = np.flatnonzero(lights.are_suns)
    for group in group_suns(lights.vectors[suns, :3]):
        yield suns[group]
    others = np.flatnonzero(~lights.are_suns)
    if len(others):
        yield others


def group_suns(suns: NDArray[np.float64]) -> Iterator[NDArray[np.intp]]:
    """Yield the indices of suns (n, 3) of similar height, ``LEAST`` or more if there are enough."""
    band = np.searchsorted(_EDGES, suns[:, 2])
    counts = np.bincount(band, minlength=len(_EDGES) + 1)
    first = 0
    for last in range(len(counts)):
        left = counts[last + 1 :].sum()
        if last == len(counts) - 1 or (counts[first : last + 1].sum() >= LEAST <= left):
            group = np.flatnonzero((band >= first) & (band <= last))
            if len(group):
                yield group
            first = last + 1


class ReachingCounter(LightCounter):
    """
    Counter of any lights, with all casters that can hide them.

    Parameters
    ----------
    tile : Tile
        With the casters that the study's lights need.
    counter : Counter or None
        Of these lights, if not the tile's own.
    known : (n, 4) float64
        The study's lights.
    find_tile : callable
        Returns the tile with the casters that other lights need, (n, 3) or (n, 4).
    """

    def __init__(
        self,
        tile: Tile,
        counter: Counter | None,
        known: NDArray[np.float64],
        find_tile: Callable[[NDArray[np.float64]], Tile],
    ) -> None:
        super().__init__(tile, counter)
        self._known = {row.tobytes() for row in known}
        self._find_tile = find_tile

    def masks(self, lights: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each light, (n, 3) suns or (n, 4) any, the receivers in shadow."""
        if self._knows(lights):
            return super().masks(lights)
        return LightCounter(self._find_tile(lights)).masks(lights)

    def add_weights(
        self,
        lights: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each receiver the weights (n, k) of the lights that leave it in shadow."""
        if self._knows(lights):
            super().add_weights(lights, weights, sums, progress)
        else:
            tile = self._find_tile(lights)
            LightCounter(tile).add_weights(lights, weights, sums, progress)

    def split(self, lights: NDArray[np.float64]) -> Iterator[tuple[NDArray[np.bool_], Counter]]:
        """Yield runs of the study's lights (n, 3), each with its counter."""
        if lights.shape[1] == 3 and self._knows(lights):
            yield from split_lights(self.suns, lights)
        else:
            yield np.ones(len(lights), np.bool_), self

    def _knows(self, lights: NDArray[np.float64]) -> bool:
        whole = np.zeros((len(lights), 4))
        whole[:, : lights.shape[1]] = lights
        return all(row.tobytes() in self._known for row in whole)


Tiles = Sequence[tuple[Any, Callable[[], Tile]]]


def count_receivers(
    context: WorkerContext,
    laid: Any,
    tiles: Tiles,
    find_tiles: Callable[[NDArray[np.float64]], Tiles],
    counter: Counter | None = None,
    *,
    is_due: bool,
) -> tuple[Study, list[NeighbourSums]]:
    """
    Count all lights; return the study, and the neighbours that lose sun to a proposal.

    Parameters
    ----------
    context : WorkerContext
    laid : Receivers
        Among some of the city's parts.
    tiles : sequence
        As ``laid.make_tiles`` returns them.
    find_tiles : callable
        Returns the same tiles among the casters that other lights need, (n, 3) or (n, 4).
    counter : Counter, optional
        Of all casters; each tile's own by default.
    is_due : bool
        Whether casters of groups may reach the receivers. If not, none of their hours are counted.
    """
    canopy, setup = laid.casting.canopy, context.setup
    if context.groups is not None and context.job.options.proposed:
        setup = replace(setup, proposal=context.groups.proposal)
    scene, sees_all = laid.casting.scene, context.sees_whole_sky
    if context.groups is not None and (context.job.options.asks_hours or sees_all):
        attribution = context.groups.find(scene, canopy, is_due=is_due or sees_all)
        setup = replace(setup, attribution=attribution)
    if sees_all:
        casts = scene.spread(context.roles.find_casting)
        setup = replace(setup, casters=np.flatnonzero(casts).tolist())
    begun = replace(setup, canopy=canopy).begin(laid, reads_days=is_due or not context.adds_exactly)
    idle = [
        accumulator
        for accumulator in begun.accumulators
        if isinstance(accumulator, Attribution) and not is_due
    ]
    busy = [accumulator for accumulator in begun.accumulators if accumulator not in idle]

    def make_run(number: int, where: Any, tile: Tile) -> TileRun:
        reaching = ReachingCounter(
            tile, counter, context.lights.vectors, partial(_find, find_tiles, number)
        )
        run = make_tile_run(tile, canopy, where, reaching, partial(_reach, find_tiles, number))
        run = run.behind_land(context.period)
        for accumulator in idle:
            accumulator.skip(run)
        return run

    count_each_tile(tiles, context.lights, busy, make_run)
    return setup.finish(begun, laid, facts={}), find_neighbours(begun, laid)


def _reach(
    find_tiles: Callable[[NDArray[np.float64]], Tiles], number: int, lights: Lights
) -> Iterator[tuple[NDArray[np.intp], Tile]]:
    """Yield groups of lights of similar height, with the tile among the casters that they need."""
    toward = lights.vectors if (~lights.are_suns).any() else lights.directions
    for group in group_lights(lights):
        yield group, find_tiles(toward[group])[number][1]()


def _find(
    find_tiles: Callable[[NDArray[np.float64]], Tiles], number: int, lights: NDArray[np.float64]
) -> Tile:
    """Return a tile among the casters that some lights need."""
    return find_tiles(lights)[number][1]()
