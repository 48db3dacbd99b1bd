"""A day's study: umbra counts all suns; Embree asks every cell for each sun."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.height_field import HeightFieldSweep
from umbra.cpu.plane import PlaneSweep
from umbra.cpu.raster_sweep import Sweep
from umbra.receivers.zenith import Surface, find_surface
from umbra.scene import make_scene
from umbra.scene.grid import Grid
from umbra.volume.adjacency import Caster, make_caster
from umbra_benchmarks.embree import OFFSET, Embree
from umbra_benchmarks.measure import Contender, counted, run_in_turn, timed
from umbra_benchmarks.packets import PACKETS, EmbreePackets, sort_along_curve
from umbra_benchmarks.report import BenchmarkRun, Report, Row, SecondPeer, name_version
from umbra_benchmarks.scenes import SquareModel, make_boulder, make_suns, make_town
from umbra_benchmarks.whole import Whole, lay_out_wholes, measure_whole

__all__ = ["StudyReport", "bench_study"]


@dataclass(frozen=True)
class _Work:
    receivers: str
    cells: int  # a side
    mark: float | None = None  # against embreex
    packets_mark: float | None = None


@dataclass(frozen=True)
class _StudyCase:
    name: str
    make: Callable[[], SquareModel]
    works: tuple[_Work, ...]
    whole: int | None = None  # cells a side of the whole study, if it is measured


_CASES = (
    _StudyCase(
        "town, 3,600 triangles",
        lambda: make_town(300, 500.0, 1),
        (
            _Work("plane", 512, 150.0),
            _Work("topmost", 512, 60.0),
            _Work("plane", 2048, 500.0, 100.0),
        ),
        512,
    ),
    _StudyCase(
        "city, 100k triangles",
        lambda: make_town(8333, 2500.0, 2),
        (_Work("plane", 512, 30.0, 15.0), _Work("topmost", 512, 25.0)),
        512,
    ),
    _StudyCase(
        "smooth, 1.3M triangles",
        lambda: make_boulder(8),
        (_Work("plane", 2048, 200.0), _Work("topmost", 512)),
    ),
)
_QUICK = (
    _StudyCase(
        "town, 120 triangles",
        lambda: make_town(10, 90.0, 1),
        (_Work("plane", 64), _Work("topmost", 64)),
        64,
    ),
    _StudyCase("smooth, 1,280 triangles", lambda: make_boulder(3), (_Work("plane", 64),)),
)


@dataclass(frozen=True)
class StudyReport(Report):
    """
    The kernels beside Embree's, and whole studies beside a script with trimesh and embreex.

    Parameters
    ----------
    wholes : list of Whole
    """

    wholes: list[Whole]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        return super().to_dict() | {"wholes": [whole.to_dict() for whole in self.wholes]}

    def to_table(self) -> str:
        """Return both tables."""
        told = (
            "The same from arrays to hours (call) and from file to files (command), one thread, "
            "beside a script for the same hours; kernels compiled, files in memory."
        )
        return f"{super().to_table()}\n\n{told}\n\n{lay_out_wholes(self.wholes)}"


def bench_study(run: BenchmarkRun) -> StudyReport:
    """
    Measure studies on planes and on topmost surfaces, and whole studies of level ground.

    Everything that a study prepares once (adjacency, the surface, ray origins, Embree's
    trees) is done before the clock starts; finding silhouettes is not. On one thread the time
    of the processor counts, on more the clock's.
    """
    suns = make_suns()
    rows, wholes = [], []
    for case in _QUICK if run.quick else _CASES:
        model = case.make()
        soup = make_scene(model.vertices, model.faces).triangles()
        caster = make_caster(soup.vertices, soup.faces)
        embree = Embree(soup.vertices, soup.faces)
        packets = EmbreePackets(soup.vertices, soup.faces)
        for work in case.works:
            name = f"{work.receivers}, {case.name}, {work.cells}²"
            run.say(name)
            cell = model.side / work.cells
            grid = Grid(cell / 2, cell / 2, cell, cell, work.cells, work.cells)
            surface = find_surface(soup, grid, 0.0)
            rays = _Rays(embree, packets, *_place_points(grid, surface, work.receivers), suns)
            alone = _make_sweep(caster, grid, surface, work.receivers, 1)
            together = _make_sweep(caster, grid, surface, work.receivers, run.threads)
            timings = run_in_turn(
                {
                    "ours": _count(alone, suns, counted),
                    "threads": _count(together, suns, timed),
                    "peer": rays.run,
                    "packets": counted(rays.run_packets),
                },
                run.repeat,
            )
            differ, compared, packets_differ = _count_differences(alone, rays)
            rows.append(
                Row(
                    name, timings["ours"], timings["peer"], timings["threads"], work.mark,
                    differ, compared, {"suns": len(suns), "cells": work.cells**2},
                    SecondPeer(PACKETS, timings["packets"], work.packets_mark, packets_differ),
                )
            )  # fmt: skip
        if case.whole is not None:
            wholes.append(measure_whole(run, case.name, model, case.whole))
    return StudyReport(run, "study", f"embreex {name_version('embreex')}", rows, wholes)


@dataclass(frozen=True, eq=False)
class _Rays:
    """Embree's side: one ray from each cell to each sun."""

    embree: Embree
    packets: EmbreePackets
    points: NDArray[np.float32]
    normals: NDArray[np.float64]
    suns: NDArray[np.float64]

    @cached_property
    def order(self) -> NDArray[np.intp]:
        """The order in which sixteen points after one another are neighbours."""
        return sort_along_curve(self.points)

    @cached_property
    def ordered(self) -> NDArray[np.float32]:
        """The points in that order."""
        return self.points[self.order]

    def run_packets(self) -> list[NDArray[np.bool_]]:
        """Ask for all suns, 16 rays a call; return what is hidden, in the packets' order."""
        return [
            self.packets.find_occluded(self.ordered, sun[None])
            for sun in self.suns.astype(np.float32)
        ]

    def ask(self) -> Iterator[tuple[NDArray[np.int32], float]]:
        """Return for each sun what was found, and the seconds that Embree took."""
        directions = np.zeros_like(self.points)
        for sun in self.suns:
            directions[:] = sun
            begun = time.process_time()
            found = self.embree.find_occluded(self.points, directions)
            yield found, time.process_time() - begun

    def run(self) -> float:
        """Ask for all suns."""
        return sum(seconds for _, seconds in self.ask())


def _make_sweep(
    caster: Caster, grid: Grid, surface: Surface, receivers: str, threads: int
) -> Sweep:
    if receivers == "plane":
        return PlaneSweep(caster, grid, 0.0, threads)
    return HeightFieldSweep(caster, grid, surface.heights, threads, surface.slopes)


def _place_points(
    grid: Grid, surface: Surface, receivers: str
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Return where rays start and the receiver's unit normal there, (n, 3) each."""
    x, y = np.meshgrid(grid.x, grid.y)
    flat = np.zeros((grid.rows, grid.cols))
    points = np.stack([x, y, flat if receivers == "plane" else surface.heights], -1).reshape(-1, 3)
    normals = np.zeros_like(points)
    normals[:, 2] = 1.0
    if receivers == "topmost":
        slopes = surface.slopes
        up = slopes.planes[:3, slopes.face].T
        normals[slopes.cells] = up / np.linalg.norm(up, axis=1, keepdims=True)
    return (points + OFFSET * normals).astype(np.float32), normals


def _count_differences(sweep: Sweep, rays: _Rays) -> tuple[int, int, int]:
    """
    Count the answers that differ, all where the surface faces the sun, and those of the packets.

    The first are umbra's that are not embreex's, the last the packets' that are not.
    """
    differ = compared = packets_differ = 0
    for sun, (found, _), packed in zip(rays.suns, rays.ask(), rays.run_packets(), strict=True):
        facing = rays.normals @ sun > 0
        in_shadow = (sweep.counts(sun[None]) != 0).ravel()
        differ += int(((found == 0) != in_shadow)[facing].sum())
        compared += int(facing.sum())
        packets_differ += int(((found == 0)[rays.order] != packed)[facing[rays.order]].sum())
    return differ, compared, packets_differ


def _count(
    sweep: Sweep, suns: NDArray[np.float64], clock: Callable[[Callable[[], object]], Contender]
) -> Contender:
    once = np.ones((len(suns), 1), np.int32)
    steps = np.zeros((1, sweep.grid.rows, sweep.grid.cols), np.int32)
    return clock(lambda: sweep.add_weights(suns, once, steps))
