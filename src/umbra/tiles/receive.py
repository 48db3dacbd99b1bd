"""The loop over the lights on some receivers of a city, with the groups of its casters."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from umbra.receivers.kind import Counter, Tile
from umbra.study.accumulators.attribution import Attribution
from umbra.study.compare import NeighbourSums
from umbra.study.loop import look, pass_lights
from umbra.study.result import Study
from umbra.tiles.job import Workplace
from umbra.tiles.neighbours import find_neighbours

__all__ = ["count_receivers"]


def count_receivers(
    place: Workplace,
    laid: Any,
    tiles: Sequence[tuple[Any, Callable[[], Tile]]],
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
    counter : Counter, optional
        Of all casters; each tile's own by default.
    is_due : bool
        Whether casters of groups may reach the receivers. If not, none of their hours are counted.
    """
    canopy, setup = laid.casting.canopy, place.setup
    if place.groups is not None:
        found = place.groups.find(laid.casting.scene, canopy, is_due=is_due)
        setup = replace(setup, attribution=found)
    begun = replace(setup, canopy=canopy).begin(laid, reads_days=is_due or not place.adds_exactly)
    idle = [one for one in begun.accumulators if isinstance(one, Attribution) and not is_due]
    busy = [one for one in begun.accumulators if one not in idle]
    for where, make in tiles:
        tile = make()
        run = look(tile, canopy, where, counter or tile.make_counter())
        for one in idle:
            one.skip(run)
        pass_lights(run, place.lights, busy)
    nothing = laid.finish()
    if nothing is not None:
        begun.blank(nothing)
    arrays = begun.arrays
    study = Study(
        laid, place.period, arrays.shadow_hours, arrays.up_hours, begun.masks, {},
        begun.variables(laid),
    )  # fmt: skip
    return study, find_neighbours(begun, laid)
