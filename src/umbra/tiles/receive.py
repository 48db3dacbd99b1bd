"""The loop over the lights on some receivers of a city, with the groups of its casters."""

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
from umbra.study.engine import count_each_tile
from umbra.study.loop import TileRun, make_tile_run
from umbra.study.result import Study
from umbra.tiles.job import Workplace
from umbra.tiles.neighbours import find_neighbours
from umbra.tiles.reaching import ReachingCounter
from umbra.tiles.sun_groups import group_lights

__all__ = ["Tiles", "count_receivers"]

Tiles = Sequence[tuple[Any, Callable[[], Tile]]]


def count_receivers(
    place: Workplace,
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
    place : Workplace
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
    canopy, setup = laid.casting.canopy, place.setup
    if place.groups is not None and place.job.options.proposed:
        setup = replace(setup, proposal=place.groups.proposal)
    scene, sees_all = laid.casting.scene, place.sees_whole_sky
    if place.groups is not None and (place.job.options.asks_hours or sees_all):
        found = place.groups.find(scene, canopy, is_due=is_due or sees_all)
        setup = replace(setup, attribution=found)
    if sees_all:
        casts = scene.spread(place.roles.find_casting)
        setup = replace(setup, casters=np.flatnonzero(casts).tolist())
    begun = replace(setup, canopy=canopy).begin(laid, reads_days=is_due or not place.adds_exactly)
    idle = [one for one in begun.accumulators if isinstance(one, Attribution) and not is_due]
    busy = [one for one in begun.accumulators if one not in idle]

    def make_run(number: int, where: Any, tile: Tile) -> TileRun:
        reaching = ReachingCounter(
            tile, counter, place.lights.vectors, partial(_find, find_tiles, number)
        )
        run = make_tile_run(tile, canopy, where, reaching, partial(_reach, find_tiles, number))
        run = run.behind_land(place.period)
        for one in idle:
            one.skip(run)
        return run

    count_each_tile(tiles, place.lights, busy, make_run)
    return setup.finish(begun, laid, facts={}), find_neighbours(begun, laid)


def _reach(
    find_tiles: Callable[[NDArray[np.float64]], Tiles], number: int, lights: Lights
) -> Iterator[tuple[NDArray[np.intp], Tile]]:
    """Yield groups of lights of similar height, with the tile among the casters that they need."""
    toward = lights.vectors if (~lights.are_suns).any() else lights.directions
    for some in group_lights(lights):
        yield some, find_tiles(toward[some])[number][1]()


def _find(
    find_tiles: Callable[[NDArray[np.float64]], Tiles], number: int, lights: NDArray[np.float64]
) -> Tile:
    """Return a tile among the casters that some lights need."""
    return find_tiles(lights)[number][1]()
