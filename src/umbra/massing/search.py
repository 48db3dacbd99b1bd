"""
The search for the greatest heights, and their verification by an exact study.

`HeightEnvelope` is its result: numbers, raster, solid, and what was assumed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import prepare_casting
from umbra.massing.asks import Ask
from umbra.massing.flat_choice import FlatChoice, choose_flats
from umbra.massing.picks import keep_enough
from umbra.massing.piece_choice import choose_pieces
from umbra.massing.plot import Plot
from umbra.massing.problem import Problem, ReceiverGroup, pose_problem
from umbra.massing.solid import make_solid
from umbra.massing.upper_bounds import bound_cells, bound_sum
from umbra.scene import Mesh, Part, Scene
from umbra.sun import Site

__all__ = ["KIND", "Found", "HeightEnvelope", "Violation", "search_heights"]

KIND = "Envelope"
"""Kind of the part that a found envelope is."""
_BELOW = 1e-3  # heights are whole millimetres, at least half of one below the planes [m]
_ROUNDS, _STEPS, _FEWEST = 400, 200, 40
_AT_ONCE = 3e8  # crossings that all steps of the bound may look at, but for the fewest
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
    told : tuple of str
        Of choices that were made, a line each.
    """

    problem: Problem
    heights: NDArray[np.float64]
    ceiling: NDArray[np.float64]
    bound: float
    mesh: Mesh | None
    violations: tuple[Violation, ...]
    hours: list[NDArray[np.float64]]
    shrunk: float
    told: tuple[str, ...] = ()

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
    groups: Sequence[ReceiverGroup],
    plot: Plot,
    highest: float,
    threads: int,
    tell: Callable[[str], object] = lambda _: None,
    candidates: Sequence[ReceiverGroup] = (),
    choices: Sequence[FlatChoice] = (),
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
    candidates : sequence of Group
        Of which the choices take some.
    choices : sequence of FlatChoice

    Raises
    ------
    InputError
        If the planes do not fit in memory.
    """
    around = prepare_casting(scene, casters, threads) if casters else None
    tell("finding the planes of the sun")
    problem = pose_problem(plot, asks, [*groups, *candidates], around)
    top = plot.ground + highest
    tell("bounding the volume")
    whole = problem
    if candidates:  # no bound of theirs: another choice may hold more
        problem = whole.pick(range(len(groups)))
    ceiling = np.maximum(bound_cells(problem.needs, top), plot.ground)
    steps = _count_steps(problem)  # each gives a valid bound
    bound, prices = bound_sum(problem.needs, ceiling, plot.ground, steps)
    told: tuple[str, ...] = ()
    highest_tops = ceiling
    if candidates:
        chosen, told = _choose(whole, len(groups), choices, ceiling)
        problem = whole.pick([*range(len(groups)), *chosen])
        highest_tops = np.maximum(bound_cells(problem.needs, top), plot.ground)
        _, prices = bound_sum(problem.needs, highest_tops, plot.ground, _count_steps(problem))
    needs = problem.needs
    tell("choosing hours of sun")
    tops = choose_pieces(needs, highest_tops, prices, _ROUNDS)
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
        (before - float(heights.sum())) * plot.area, told,
    )  # fmt: skip


def _count_steps(problem: Problem) -> int:
    """Return the number of steps of a bound."""
    crossings = max(len(problem.needs.crossings.cell), 1)
    return int(np.clip(_AT_ONCE / crossings, _FEWEST, _STEPS))


def _choose(
    problem: Problem, fixed: int, choices: Sequence[FlatChoice], ceiling: NDArray[np.float64]
) -> tuple[list[int], tuple[str, ...]]:
    """Choose the flats that keep their sun; return their groups, and what is told of it."""
    heights = ceiling.copy()
    is_kept = np.zeros(len(problem.needs.hours), np.bool_)
    for group in range(fixed):
        keep_enough(problem.needs, group, heights, is_kept)
    groups, told = list[int](), []
    for choice in choices:
        own, count = choose_flats(problem.needs, fixed, problem.broken, choice, heights)
        groups += [fixed + group for group in own]
        few = "" if count == choice.wanted else f"; only {count} have enough before"
        told.append(
            f"{choice.name} keep their sun, each room by one window that costs least{few}; "
            "another choice may hold more, up to bound_m3, which leaves these flats out"
        )
    return sorted(set(groups)), tuple(told)


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
    violations = []
    for g in unmet:
        members = range(problem.needs.group[g], problem.needs.group[g + 1])
        lacks = [
            (hours[problem.ask[k]][problem.receiver[k]] - problem.needs.limit[k], k)
            for k in members
        ]
        _, worst = min(lacks)
        limit = float(problem.needs.limit[worst])
        measured = float(hours[problem.ask[worst]][problem.receiver[worst]])
        violations.append(Violation(problem.groups[g].name, limit, measured))
    return violations


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


_CAPPED = 0.01  # below the cap by which a cell counts as capped [m]


@dataclass(frozen=True, eq=False)
class HeightEnvelope:
    """
    The greatest heights over a plot that keep rules.

    Parameters
    ----------
    scene : Scene
        What stands around, without what is replaced.
    site : Site
    found : Found
    rules : tuple of str
        Titles of the rules.
    times : tuple of str
        Dates, hours and clock of their checks.
    highest : float
        The cap of all heights [m].
    replaced : tuple of str
        Names of what stood on the plot and was left out.
    notes : tuple of str
        What was assumed, a line each.
    """

    scene: Scene
    site: Site
    found: Found
    rules: tuple[str, ...]
    times: tuple[str, ...]
    highest: float
    replaced: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def heights(self) -> NDArray[np.float64]:
        """Heights above the ground, (rows, cols), row 0 the south; NaN off the plot [m]."""
        return self.found.plot.spread(self.found.heights)

    @property
    def x(self) -> NDArray[np.float64]:
        """Centres of the columns in the model's own coordinates, (cols,) [m]."""
        plot = self.found.plot
        along = np.arange(plot.index.shape[1], dtype=np.float64) + 0.5
        return plot.x0 + along * plot.cell + float(self.scene.origin[0])

    @property
    def y(self) -> NDArray[np.float64]:
        """Centres of the rows in the model's own coordinates, (rows,) [m]."""
        plot = self.found.plot
        along = np.arange(plot.index.shape[0], dtype=np.float64) + 0.5
        return plot.y0 + along * plot.cell + float(self.scene.origin[1])

    @property
    def cell(self) -> float:
        """Side of a cell [m]."""
        return self.found.plot.cell

    @property
    def volume_m3(self) -> float:
        """Volume over the ground [m3]."""
        return self.found.volume

    @property
    def max_height_m(self) -> float:
        """Greatest height above the ground [m]."""
        return float(self.found.heights.max(initial=0.0))

    @property
    def bound_m3(self) -> float:
        """Upper bound of the volume that any choice of hours allows [m3]."""
        return self.found.bound

    @property
    def violations(self) -> tuple[Violation, ...]:
        """What the exact study with the envelope in the scene found broken."""
        return self.found.violations

    @property
    def mesh(self) -> Mesh | None:
        """The closed solid in the model's own coordinates; None where nothing may stand."""
        mesh = self.found.mesh
        return None if mesh is None else Mesh(mesh.vertices + self.scene.origin, mesh.faces)

    @cached_property
    def broken(self) -> tuple[str, ...]:
        """Receivers that have too little before anything is built."""
        problem = self.found.problem
        return tuple(problem.groups[g].name for g in np.flatnonzero(problem.broken))

    def list_receivers(self) -> tuple[NDArray[np.float64], NDArray[np.bool_], list[str]]:
        """
        List the places of receivers, each once.

        Returns
        -------
        points : (n, 3) float64
            In the model's own coordinates [m].
        is_broken : (n,) bool
            Whether what it belongs to has too little before anything is built.
        names : list of str
        """
        problem = self.found.problem
        lacks = [np.zeros(len(ask.labels), np.bool_) for ask in problem.asks]
        for g in np.flatnonzero(problem.broken):
            for a, r in zip(problem.groups[g].ask, problem.groups[g].receiver, strict=True):
                lacks[a][r] = True
        points = np.concatenate([ask.places.points for ask in problem.asks]) + self.scene.origin
        labels = [ask.labels[k] for ask in problem.asks for k in ask.receivers]
        is_broken = np.concatenate(
            [own[ask.receivers] for own, ask in zip(lacks, problem.asks, strict=True)]
        )
        order = np.argsort(~is_broken, kind="stable")
        _, first = np.unique(np.round(points[order], 3), axis=0, return_index=True)
        chosen = order[first]
        return points[chosen], is_broken[chosen], [labels[k] for k in chosen]

    @property
    def capped(self) -> int:
        """Number of cells that the cap binds."""
        return int((self.found.heights > self.highest - _CAPPED).sum())

    def sum_up(self) -> dict[str, Any]:
        """Return the numbers as plain values, for JSON."""
        return {
            "volume_m3": self.volume_m3,
            "max_height_m": self.max_height_m,
            "violations": len(self.violations),
            "bound_m3": self.bound_m3,
            "cells": len(self.found.heights),
            "cell_m": self.cell,
            "capped_cells": self.capped,
            "cap_m": self.highest,
            "receivers": len(self.list_receivers()[0]),
            "broken_before": list(self.broken),
            "replaced": list(self.replaced),
            "shrunk_m3": self.found.shrunk,
        }
