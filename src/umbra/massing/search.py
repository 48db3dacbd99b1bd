"""The search for the greatest heights, and their verification by an exact study."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import prepare_casting
from umbra.massing.asks import Ask
from umbra.massing.bounds import bound_cells, bound_sum
from umbra.massing.choice import choose_pieces
from umbra.massing.plot import Plot
from umbra.massing.problem import Group, Problem, pose_problem
from umbra.massing.solid import make_solid
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
    """A receiver or an area that does not get what it must, with what the least served has."""

    name: str
    wanted: float
    measured: float


@dataclass(frozen=True, eq=False)
class Found:
    """
    The greatest heights that were found.

    Parameters
    ----------
    problem : Problem
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

    problem: Problem
    heights: NDArray[np.float64]
    ceiling: NDArray[np.float64]
    bound: float
    mesh: Mesh | None
    violations: tuple[Violation, ...]
    hours: list[NDArray[np.float64]]
    shrunk: float

    @property
    def plot(self) -> Plot:
        """The plot."""
        return self.problem.plot

    @property
    def volume(self) -> float:
        """Volume over the ground [m3]."""
        return float(self.heights.sum() * self.plot.area)


def search_heights(
    scene: Scene,
    casters: Sequence[int],
    asks: Sequence[Ask],
    groups: Sequence[Group],
    plot: Plot,
    highest: float,
    threads: int,
    tell: Callable[[str], object] = lambda _: None,
) -> Found:
    """
    Search the greatest heights over a plot that keep what groups of receivers need.

    Parameters
    ----------
    scene : Scene
        What stands around.
    casters : sequence of int
        Indices of the parts that cast.
    asks : sequence of Ask
    groups : sequence of Group
    plot : Plot
    highest : float
        Height that no cell may exceed [m].
    threads : int
    tell : callable
        Called with the name of each stage.

    Raises
    ------
    InputError
        If the planes do not fit in memory.
    """
    around = prepare_casting(scene, casters, threads) if casters else None
    tell("finding the planes of the sun")
    problem = pose_problem(plot, asks, groups, around)
    needs = problem.needs
    top = plot.ground + highest
    tell("bounding the volume")
    ceiling = np.maximum(bound_cells(needs, top), plot.ground)
    bound, prices = bound_sum(needs, ceiling, plot.ground, _STEPS)
    tell("choosing hours of sun")
    tops = choose_pieces(needs, ceiling, prices, _ROUNDS)
    tell("verifying by a study")
    heights = np.maximum(np.floor((tops - plot.ground - _BELOW / 2) / _BELOW) * _BELOW, 0.0)
    before = float(heights.sum())
    amount = _FIRST_SHRINK
    for _ in range(_SHRINKS):
        mesh = make_solid(plot, plot.ground + heights)
        hours = [_count(ask, scene, casters, mesh, threads) for ask in asks]
        unmet = problem.find_unmet(hours)
        if not len(unmet) or mesh is None:
            break
        heights = _shrink(problem, unmet, heights, amount)
        amount *= 2
    return Found(
        problem, heights, ceiling - plot.ground, bound * plot.area, mesh,
        tuple(_list_violations(problem, unmet, hours)), hours,
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


def _list_violations(
    problem: Problem, unmet: NDArray[np.intp], hours: list[NDArray[np.float64]]
) -> list[Violation]:
    found = []
    for g in unmet:
        members = range(problem.needs.group[g], problem.needs.group[g + 1])
        lacks = [
            (hours[problem.ask[k]][problem.receiver[k]] - problem.needs.limit[k], k)
            for k in members
        ]
        _, worst = min(lacks)
        limit = float(problem.needs.limit[worst])
        measured = float(hours[problem.ask[worst]][problem.receiver[worst]])
        found.append(Violation(problem.groups[g].name, limit, measured))
    return found


def _shrink(
    problem: Problem, unmet: NDArray[np.intp], heights: NDArray[np.float64], amount: float
) -> NDArray[np.float64]:
    """Lower the cells that groups with too little sun look over."""
    needs, tops = problem.needs, problem.plot.ground + heights
    lowered = np.zeros(len(heights), np.bool_)
    for g in unmet:
        pieces = needs.start[needs.group[g : g + 2]]
        first, last = needs.crossings.start[pieces]
        cell, clear = needs.crossings.cell[first:last], needs.crossings.clear[first:last]
        lowered[cell[tops[cell] > clear - 10 * amount]] = True
    return np.where(lowered, np.maximum(heights - amount, 0.0), heights)
