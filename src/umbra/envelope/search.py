"""The search for the greatest heights, and their verification by an exact study."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting, prepare_casting
from umbra.envelope.asks import Ask, Base, find_base, join_needs
from umbra.envelope.bounds import bound_cells, bound_sum
from umbra.envelope.choice import choose_pieces
from umbra.envelope.filling import fill_up
from umbra.envelope.needs import Needs
from umbra.envelope.plot import Plot
from umbra.envelope.solid import make_solid
from umbra.scene import Mesh, Part, Scene

__all__ = ["KIND", "Found", "Violation", "search_heights"]

KIND = "Envelope"
"""Kind of the part that a found envelope is."""
_BELOW = 1e-3  # heights are whole millimetres, at least half of one below the planes [m]
_ROUNDS, _STEPS = 400, 200
_SHRINKS = 16
_FIRST_SHRINK = 0.01  # doubled each time [m]


@dataclass(frozen=True)
class Violation:
    """A receiver or area that has less than it needs, in hours."""

    ask: str
    name: str
    wanted: float
    measured: float


@dataclass(frozen=True, eq=False)
class Found:
    """
    The greatest heights that were found.

    Parameters
    ----------
    plot : Plot
    bases : list of Base
        What receivers have before, and need.
    heights : (n_cells,) float64
        Over the ground at the cells' centres [m].
    ceiling : (n_cells,) float64
        Bound of each cell alone [m].
    bound : float
        Upper bound of the volume [m3].
    mesh : Mesh or None
        The closed solid, local frame.
    violations : tuple of Violation
        By the exact study with the solid in the scene.
    hours : list of (n,) float64
        Hours of the receivers of each ask with the solid [h].
    shrunk : float
        What verification took from the volume [m3].
    """

    plot: Plot
    bases: list[Base]
    heights: NDArray[np.float64]
    ceiling: NDArray[np.float64]
    bound: float
    mesh: Mesh | None
    violations: tuple[Violation, ...]
    hours: list[NDArray[np.float64]]
    shrunk: float

    @property
    def volume(self) -> float:
        """Volume over the ground [m3]."""
        return float(self.heights.sum() * self.plot.area)


def search_heights(
    scene: Scene,
    casters: Sequence[int],
    asks: Sequence[Ask],
    plot: Plot,
    highest: float,
    threads: int,
    tell: Callable[[str], object] = lambda _: None,
) -> Found:
    """
    Search the greatest heights over a plot that keep all asks.

    Parameters
    ----------
    scene : Scene
        What stands around.
    casters : sequence of int
        Indices of the parts that cast.
    asks : sequence of Ask
    plot : Plot
    highest : float
        Height that no cell may exceed [m].
    threads : int
    tell : callable
        Called with the name of each stage.
    """
    around = prepare_casting(scene, casters, threads) if casters else None
    tell("finding the planes of the sun")
    bases = [find_base(ask, None if ask.is_alone else around, plot) for ask in asks]
    needs = join_needs(bases)
    top = plot.ground + highest
    tell("choosing hours of sun")
    ceiling = np.maximum(bound_cells(needs, top), plot.ground)
    _, tops = choose_pieces(needs, ceiling, _ROUNDS)
    tops = fill_up(needs, np.maximum(tops, plot.ground), top)
    tell("bounding the volume")
    bound = bound_sum(needs, ceiling, plot.ground, _STEPS) * plot.area
    tell("verifying by a study")
    heights = np.maximum(np.floor((tops - plot.ground - _BELOW / 2) / _BELOW) * _BELOW, 0.0)
    before = float(heights.sum())
    amount = _FIRST_SHRINK
    for _ in range(_SHRINKS):
        mesh = make_solid(plot, plot.ground + heights)
        hours = [_count(base.ask, scene, casters, mesh, threads) for base in bases]
        violations = _list_violations(bases, hours)
        if not violations or mesh is None:
            break
        heights = _shrink(plot, needs, bases, hours, heights, amount)
        amount *= 2
    return Found(
        plot, bases, heights, ceiling - plot.ground, bound, mesh, tuple(violations), hours,
        (before - float(heights.sum())) * plot.area,
    )  # fmt: skip


def _count(
    ask: Ask, scene: Scene, casters: Sequence[int], mesh: Mesh | None, threads: int
) -> NDArray[np.float64]:
    """Measure an ask with a solid in the scene."""
    if mesh is not None:
        part = Part("envelope", KIND, mesh)
        casters = [*([] if ask.is_alone else casters), len(scene.parts)]
        scene = replace(scene, parts=(*scene.parts, part))
    elif ask.is_alone:
        casters = []
    return ask.count(prepare_casting(scene, casters, threads) if casters else None)


def _list_violations(bases: list[Base], hours: list[NDArray[np.float64]]) -> list[Violation]:
    found = []
    for base, some in zip(bases, hours, strict=True):
        ask = base.ask
        for g in np.flatnonzero(~ask.meets(some)):
            mine = np.flatnonzero(ask.group == g)
            worst = mine[(some - ask.limit)[mine].argmin()]
            found.append(Violation(
                ask.name, ask.group_names[g], float(ask.limit[worst]), float(some[worst])
            ))  # fmt: skip
    return found


def _shrink(
    plot: Plot, needs: Needs, bases: list[Base], hours: list[NDArray[np.float64]],
    heights: NDArray[np.float64], amount: float,
) -> NDArray[np.float64]:  # fmt: skip
    """Lower the cells that receivers with too little sun look over."""
    lowered = np.zeros(len(heights), np.bool_)
    first = 0
    crossings = needs.crossings
    for base, some in zip(bases, hours, strict=True):
        ask = base.ask
        bad = ~ask.meets(some)
        for k in np.flatnonzero(bad[ask.group]):
            a, b = needs.start[first + k], needs.start[first + k + 1]
            i = slice(crossings.start[a], crossings.start[b])
            near = plot.ground + heights
            cell = crossings.cell[i]
            lowered[cell[near[cell] > crossings.clear[i] - 10 * amount]] = True
        first += len(ask.labels)
    return np.where(lowered, np.maximum(heights - amount, 0.0), heights)
