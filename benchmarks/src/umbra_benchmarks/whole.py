"""A day's study as it is asked for: kernel, call and command, and a peer's whole script."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import umbra
from umbra.cpu.plane import PlaneSweep
from umbra.errors import InputError
from umbra.scene import Scene, make_scene
from umbra.scene.grid import Grid
from umbra.volume.adjacency import make_caster
from umbra_benchmarks.embree import OFFSET
from umbra_benchmarks.measure import Timing, run_in_turn, timed
from umbra_benchmarks.report import BenchmarkRun, lay_out_table, show_timing
from umbra_benchmarks.scenes import SquareModel
from umbra_benchmarks.startup import run_study, write_obj

__all__ = ["WHOLE_HEAD", "Whole", "measure_whole"]

_SITE = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
_DAY, _OTHER_DAY = "2026-09-18", "2026-04-18"
_PERIOD = {"start": "09:00", "end": "17:00", "every": "15min"}
_STEP = 0.25  # [h]
_TIMES = {
    "kernel": "kernel, ms (min)",
    "again": "call, another date",
    "first": "call, first",
    "plain": "command, no pictures",
    "command": "command",
    "peer": "trimesh + embreex",
}
WHOLE_HEAD = ["work", *_TIMES.values(), "times the call", "times the command", "differ"]


@dataclass(frozen=True)
class Whole:
    """
    One study in every way of asking for it, and a peer's script for the same hours.

    Parameters
    ----------
    work : str
    timings : dict of Timing
        By the names of ``_TIMES``.
    differ, of : int
        Cells whose hours are not the peer's, and how many there are.
    """

    work: str
    timings: dict[str, Timing]
    differ: int
    of: int

    @property
    def ratios(self) -> dict[str, float]:
        """How many times longer the peer's script takes than the first call and the command."""
        peer = self.timings["peer"].median
        return {name: peer / self.timings[name].median for name in ("first", "command")}

    def to_dict(self) -> dict[str, Any]:
        """Return numbers for programs; times in ms."""
        times: dict[str, float] = {}
        for name, timing in self.timings.items():
            times |= timing.to_ms(f"{name}_")
        return {"work": self.work, **times, "ratios": self.ratios, "differ": self.differ,
                "cells": self.of}  # fmt: skip

    def to_line(self) -> list[str]:
        """Return the cells of its line in a table."""
        shown = [show_timing(self.timings[name]) for name in _TIMES]
        ratios = [f"{ratio:.3g}" for ratio in self.ratios.values()]
        return [self.work, *shown, *ratios, f"{self.differ} of {self.of:,}"]


def measure_whole(run: BenchmarkRun, name: str, model: SquareModel, cells: int) -> Whole:
    """
    Measure a study of level ground, on one thread: from arrays to hours, and from file to files.

    The first call meets a new scene; another date is asked of a scene that was studied before.
    The command runs from start to exit in a process of its own, its kernels compiled. The peer's
    script makes a mesh, and asks for a ray from every cell to every sun.
    """
    run.say(f"whole, {name}, {cells}²")
    options: dict[str, Any] = {
        **_PERIOD, "receivers": "ground", "ground": 0.0, "size": (cells, cells),
        "extent": (0.0, 0.0, model.side, model.side), "threads": 1,
    }  # fmt: skip
    kept = make_scene(model.vertices, model.faces)
    study = umbra.shadow_study(kept, _SITE, date=_DAY, **options)
    sun = study.result.period.sun
    suns = sun.direction[sun.is_up]
    peer = _load_peer(model, cells, suns)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.obj"
        write_obj(path, model)
        typed = _type(path, model, cells)
        timings = run_in_turn(
            {
                "kernel": _time_kernel(kept, model, cells, suns),
                "again": _time_dates(kept, options),
                "first": timed(lambda: _study(make_scene(model.vertices, model.faces), options)),
                "plain": lambda: run_study([*typed, "--no-pictures"]).seconds,
                "command": lambda: run_study(typed).seconds,
                "peer": timed(peer),
            },
            run.repeat,
        )
    differ = int((np.abs(peer() - study.result.shadow_hours) > _STEP / 2).sum())
    return Whole(f"{name}, {cells}²", timings, differ, cells**2)


def _study(scene: Scene, options: dict[str, Any], date: str = _DAY) -> None:
    """Ask for a study's hours."""
    umbra.shadow_study(scene, _SITE, date=date, **options).result.shadow_hours  # noqa: B018


def _time_dates(scene: Scene, options: dict[str, Any]) -> Callable[[], float]:
    """Return a contender that asks one scene for two dates in turn, another at each run."""
    dates = [_DAY, _OTHER_DAY]

    def ask() -> None:
        dates.reverse()
        _study(scene, options, dates[0])

    return timed(ask)


def _time_kernel(
    scene: Scene, model: SquareModel, cells: int, suns: NDArray[np.float64]
) -> Callable[[], float]:
    """Return a contender that counts alone: everything is prepared."""
    soup, cell = scene.triangles(), model.side / cells
    grid = Grid(cell / 2 - scene.origin[0], cell / 2 - scene.origin[1], cell, cell, cells, cells)
    sweep = PlaneSweep(make_caster(soup.vertices, soup.faces), grid, -scene.origin[2], 1)
    once, steps = np.ones((len(suns), 1), np.int32), np.zeros((1, cells, cells), np.int32)
    return timed(partial(sweep.add_weights, suns, once, steps))


def _type(path: Path, model: SquareModel, cells: int) -> list[str]:
    """Type the command of this study; where results go is added."""
    return [
        str(path), "--lat", "48.2", "--lon", "16.37", "--tz", "Europe/Vienna", "--date", _DAY,
        "--from", _PERIOD["start"], "--to", _PERIOD["end"], "--every", _PERIOD["every"],
        "--receivers", "ground", "--ground", "0", "--up", "z", "--size", f"{cells}x{cells}",
        "--extent", f"0,0,{model.side:g},{model.side:g}", "--threads", "1", "--quiet",
    ]  # fmt: skip


def _load_peer(
    model: SquareModel, cells: int, suns: NDArray[np.float64]
) -> Callable[[], NDArray[np.float64]]:
    """Return the peer's script: from arrays to hours in shadow, as trimesh's users write it."""
    try:
        import trimesh  # noqa: PLC0415
        from trimesh.ray.ray_pyembree import RayMeshIntersector  # noqa: PLC0415
    except ImportError:
        msg = (
            "this benchmark compares with trimesh and embreex, of which one is not installed; "
            "pip install 'umbra-benchmarks[embree]'"
        )
        raise InputError(msg) from None

    def ask() -> NDArray[np.float64]:
        rays = RayMeshIntersector(trimesh.Trimesh(model.vertices, model.faces, process=False))
        centres = (np.arange(cells) + 0.5) * (model.side / cells)
        x, y = np.meshgrid(centres, centres)
        points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, OFFSET)])
        hours = np.zeros(len(points))
        for sun in suns:
            hours += _STEP * rays.intersects_any(points, np.broadcast_to(sun, points.shape))
        return hours.reshape(cells, cells)

    return ask


def lay_out_wholes(wholes: list[Whole]) -> str:
    """Return the Markdown table of some studies."""
    return lay_out_table(WHOLE_HEAD, [whole.to_line() for whole in wholes])
