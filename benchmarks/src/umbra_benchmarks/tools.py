"""
A day's study of a town beside the tools of the trade, each in a process of its own.

Umbra and its peers get the same boxes, cells and suns, and take turns. Every answer is
held against float64 rays: what differs near a shadow's edge is sampling, all else is wrong.
"""

import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import umbra
from umbra.cpu.height_field import HeightFieldSweep
from umbra.cpu.plane import PlaneSweep
from umbra.cpu.raster_sweep import Sweep
from umbra.receivers.zenith import find_surface
from umbra.scene import Scene, make_scene
from umbra.scene.grid import Grid
from umbra.sun import Site, make_steps
from umbra.volume.adjacency import make_caster
from umbra_benchmarks.exact import Exact, Mistakes, find_exact
from umbra_benchmarks.measure import Timing, timed
from umbra_benchmarks.peer import Child, PeerKind, find_peers
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
    show_timing,
)
from umbra_benchmarks.scenes import SquareModel, make_suns, make_town

__all__ = ["TOOLS", "ToolReport", "ToolRow", "bench_tools"]

_SITE = Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
_HOURS = 0.25
_PATIENCE = 3600.0
_ENOUGH = 60.0
"""A turn that takes this long [s] is not repeated, nor run once before it counts."""
_LEAST_HOURS = 0.001  # in tables
_SCRIPTS = Path(__file__).parent / "peers"

TOOLS = {
    kind.name: kind
    for kind in (
        PeerKind(
            "ladybug", "Ladybug", "ladybug_radiance", "pip install ladybug-radiance pyradiance",
            100.0, _SCRIPTS / "ladybug_sun.py",
        ),
        PeerKind(
            "pybdshadow", "pybdshadow", "pybdshadow", "pip install pybdshadow",
            500.0, _SCRIPTS / "bdshadow_sun.py",
        ),
        PeerKind("umep", "UMEP", "umep", "pip install umep", None, _SCRIPTS / "umep_sun.py"),
        PeerKind(
            "solweig", "SOLWEIG", "solweig", "pip install solweig", None,
            _SCRIPTS / "solweig_sun.py",
        ),
    )
}  # fmt: skip
"""The peers by name."""
_OF_SURFACES = ("umep", "solweig")
"""Those that also answer for roofs, and are held against umbra's topmost surfaces."""


class ToolSeconds(NamedTuple):
    """Of one turn [s]: what tells shadow from sun; from the model to hours, if that is more."""

    calculation: float
    whole: float | None


@dataclass(frozen=True)
class ToolRow:
    """
    One tool.

    Parameters
    ----------
    peer : str
        Its name among ``TOOLS``; 'ground' or 'top' for umbra.
    name : str
        Product and version.
    calculation : Timing
        Only what tells shadow from sun.
    whole : Timing or None
        From the model in memory to hours; None where that is all.
    runs : int
        Behind each median.
    mistakes : Mistakes
    sun_error : float
        How far its suns are from umbra's, at most [degrees].
    mark : float, optional
        How many times longer than umbra it should take.
    """

    peer: str
    name: str
    calculation: Timing
    whole: Timing | None
    runs: int
    mistakes: Mistakes
    sun_error: float
    mark: float | None = None


@dataclass(frozen=True)
class ToolReport(BenchmarkReport):
    """
    The benchmark's result; tools that take a minute ran once.

    Parameters
    ----------
    work : str
    cells, suns : int
    rows : sequence of ToolRow
        The first two are umbra's: the ground, and the topmost surfaces.
    missing : dict of str
        How to install each peer that was left out.
    """

    work: str
    cells: int
    suns: int
    rows: Sequence[ToolRow]
    missing: Mapping[str, str] = field(default_factory=dict)

    def compare(self, row: ToolRow) -> dict[str, float]:
        """Return how many times longer a peer takes than umbra for the same receivers."""
        ours = self.rows[1 if row.peer in _OF_SURFACES else 0]
        ratios = {
            "ratio": row.calculation.median / ours.calculation.median,
            "ratio_of_minima": row.calculation.least / ours.calculation.least,
        }
        if row.whole is not None and ours.whole is not None:
            ratios["ratio_of_whole"] = row.whole.median / ours.whole.median
        return ratios

    def to_dict(self) -> dict[str, Any]:
        """Return numbers for programs; times in ms."""
        return self.head(
            "tools",
            work=self.work,
            cells=self.cells,
            suns=self.suns,
            rows=[
                {
                    "peer": row.peer,
                    "name": row.name,
                    **row.calculation.to_ms(),
                    "whole_ms": None if row.whole is None else 1e3 * row.whole.median,
                    "whole_min_ms": None if row.whole is None else 1e3 * row.whole.least,
                    "runs": row.runs,
                    **(self.compare(row) if row.peer in TOOLS else {}),
                    "mark": row.mark,
                    "wrong": row.mistakes.wrong,
                    "near_edges": row.mistakes.near,
                    "compared": row.mistakes.of,
                    "mean_error_hours": row.mistakes.mean_hours,
                    "max_error_hours": row.mistakes.most_hours,
                    "sun_error_deg": row.sun_error,
                }
                for row in self.rows
            ],
            missing=dict(self.missing),
        )

    def to_table(self) -> str:
        """Return a Markdown table that can be read as it stands."""
        times, errors = [], []
        for row in self.rows:
            ratios = self.compare(row) if row.peer in TOOLS else {}
            found = row.mistakes
            times.append(
                [
                    row.name,
                    show_timing(row.calculation),
                    _times(ratios.get("ratio")),
                    "" if row.mark is None else f"{row.mark:g}",
                    "" if row.whole is None else show_timing(row.whole),
                    _times(ratios.get("ratio_of_whole")),
                ]
            )
            errors.append(
                [
                    row.name,
                    f"{found.wrong:,}",
                    f"{found.near:,}",
                    _hours(found.mean_hours),
                    _hours(found.most_hours),
                    f"{row.sun_error:.2g}°" if row.sun_error else "",
                ]
            )
        of_times = [
            "who", "ms (min)", "times umbra", "mark", "model to hours, ms (min)", "times umbra",
        ]  # fmt: skip
        of_errors = [
            "who", "wrong", "near an edge", "hours off, mean", "most", "suns off by",
        ]  # fmt: skip
        compared = self.rows[0].mistakes.of
        runs = ", ".join(
            f"{row.name} {row.runs}" for row in self.rows if row.runs != self.run.repeat
        )
        missing = "".join(
            f"\nNot measured: {TOOLS[name].title}; {how}." for name, how in self.missing.items()
        )
        return (
            f"umbra bench tools: {self.work}; {self.machine}. Medians of {self.run.repeat} "
            f"runs in turn{f' ({runs})' if runs else ''}, one thread each.{self.small}\n\n"
            f"{lay_out_table(of_times, times)}\n\n"
            f"Answers that differ from float64 rays, of {compared:,} on open ground:\n\n"
            f"{lay_out_table(of_errors, errors)}\n{missing}"
        ).rstrip("\n")


def _times(ratio: float | None) -> str:
    if ratio is None:
        return ""
    return f"{ratio:.3g}" if ratio < 100 else f"{ratio:,.0f}"


def _hours(error: float) -> str:
    return f"{error:.3g}" if error >= _LEAST_HOURS or not error else f"below {_LEAST_HOURS}"


def bench_tools(run: BenchmarkRun) -> ToolReport:
    """
    Measure a day's study of a town against other tools: time, and error.

    Raises
    ------
    InputError
        If a peer that was asked for is not installed.
    UmbraError
        If a peer fails.
    """
    found, absent = find_peers(TOOLS, run)
    missing = {
        kind.name: f"{kind.install}, and name it with --peer-python {kind.name}=PATH"
        for kind in absent
    }
    for name, how in missing.items():
        run.say(f"{TOOLS[name].title} is not installed and left out; {how}")
    model = make_town(10, 90.0, 1) if run.quick else make_town(300, 500.0, 1)
    cells = 64 if run.quick else 512
    ours = _Ours(model, cells)
    work = f"{len(model.vertices) // 8} boxes, {cells}² cells, {len(ours.suns)} suns"
    run.say(f"{work}: the exact answer")
    corners = model.vertices[model.faces]
    exact = find_exact(corners, ours.suns, ours.grid, ours.surface.heights == 0, _HOURS)

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        ours.save(folder / "block.npz")
        tools = [stack.enter_context(_Tool(kind, python, folder)) for kind, python in found.items()]
        turns = {"ground": ours.run_ground, "top": ours.run_top}
        turns |= {tool.kind.name: tool.run for tool in tools}
        took = _take_turns(turns, run.repeat, run.say)
        rows = [
            _make_row("ground", "umbra, ground", took, exact, ours.ground.masks(ours.suns), 0.0),
            _make_row("top", "umbra, topmost", took, exact, ours.top.masks(ours.suns), 0.0),
        ]
        for tool in tools:
            masks, suns = tool.find_answer()
            apart = np.linalg.norm(suns - ours.suns, axis=1).max()
            rows.append(
                _make_row(
                    tool.kind.name, tool.name, took, exact, masks,
                    float(np.degrees(apart)), tool.kind.mark,
                )
            )  # fmt: skip
    return ToolReport(run, work, cells**2, len(ours.suns), rows, missing)


def _take_turns(
    turns: Mapping[str, Callable[[], ToolSeconds]], repeat: int, say: Callable[[str], object]
) -> dict[str, list[ToolSeconds]]:
    """Run A B C A B C ..., after one run of each that does not count; the slow run once."""
    took: dict[str, list[ToolSeconds]] = {}
    for name, run in turns.items():
        say(f"{name}, first run")
        first = run()
        slow = max(first.calculation, first.whole or 0.0) >= _ENOUGH
        took[name] = [first] if slow else []
    quick = [name for name, runs in took.items() if not runs]
    for turn in range(repeat):
        say(f"turn {turn + 1} of {repeat}")
        for name in quick:
            took[name].append(turns[name]())
    return took


def _make_row(
    peer: str,
    name: str,
    took: Mapping[str, Sequence[ToolSeconds]],
    exact: Exact,
    masks: NDArray,
    sun_error: float,
    mark: float | None = None,
) -> ToolRow:
    runs = took[peer]
    wholes = [run.whole for run in runs if run.whole is not None]
    return ToolRow(
        peer, name, Timing.of([run.calculation for run in runs]),
        Timing.of(wholes) if wholes else None, len(runs),
        exact.judge(masks.astype(bool)), sun_error, mark,
    )  # fmt: skip


class _Ours:
    """
    Umbra's side, on one thread.

    Parameters
    ----------
    model : SquareModel
    cells : int
        A side of the ground.
    """

    def __init__(self, model: SquareModel, cells: int) -> None:
        self.model, self.suns = model, make_suns()
        cell = model.side / cells
        self.grid = Grid(cell / 2, cell / 2, cell, cell, cells, cells)
        soup = make_scene(model.vertices, model.faces).triangles()
        caster = make_caster(soup.vertices, soup.faces)
        self.surface = find_surface(soup, self.grid, 0.0)
        self.ground = PlaneSweep(caster, self.grid, 0.0)
        self.top = HeightFieldSweep(caster, self.grid, self.surface.heights, 1, self.surface.slopes)

    def run_ground(self) -> ToolSeconds:
        """Count on the plane; then study it from the scene on."""
        return self._run(self.ground, "ground")

    def run_top(self) -> ToolSeconds:
        """Count on the topmost surfaces; then study them from the scene on."""
        return self._run(self.top, "top")

    def study(self, scene: Scene, receivers: str) -> Any:
        """Study the town; the steps' midpoints are the suns' instants."""
        side = self.model.side
        return umbra.shadow_study(
            scene, _SITE, date="2026-09-18", start="08:52:30", end="17:07:30", every="15min",
            receivers=receivers, ground=0.0, extent=(0.0, 0.0, side, side),
            size=(self.grid.cols, self.grid.rows), threads=1,
        )  # fmt: skip

    def save(self, path: Path) -> None:
        """Write what the peers get (``peers.block.TownBlock``)."""
        steps = make_steps("2026-09-18", "09:00", "17:00", "15min", _SITE.zone)
        np.savez(
            path, vertices=self.model.vertices, faces=self.model.faces, suns=self.suns,
            instants=np.asarray(steps.stamps, "datetime64[ms]"), heights=self.surface.heights,
            cell=self.grid.dx, hours=_HOURS, latitude=_SITE.latitude, longitude=_SITE.longitude,
        )  # fmt: skip

    def _run(self, sweep: Sweep, receivers: str) -> ToolSeconds:
        once = np.ones((len(self.suns), 1), np.int32)
        steps = np.zeros((1, self.grid.rows, self.grid.cols), np.int32)
        counted = timed(lambda: sweep.add_weights(self.suns, once, steps), at_least=0.05)()
        scene = make_scene(self.model.vertices, self.model.faces)
        return ToolSeconds(counted, timed(lambda: self.study(scene, receivers))())


class _Tool(Child):
    """
    A peer's process, which has the town.

    Parameters
    ----------
    kind : PeerKind
    python : Path
        The interpreter to run it in.
    folder : Path
        Holds ``block.npz``.
    """

    def __init__(self, kind: PeerKind, python: Path, folder: Path) -> None:
        super().__init__(kind, python, _PATIENCE)
        self._folder = folder
        self.name = str(self.open(block=str(folder / "block.npz"))["name"])

    def run(self) -> ToolSeconds:
        """Find the hours once, timed on the other side."""
        answer = self.ask(do="run")
        whole = answer["whole"]
        return ToolSeconds(float(answer["calculation"]), None if whole is None else float(whole))

    def find_answer(self) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
        """Return what was in shadow (n_suns, rows, cols), and the suns that it used."""
        path = self._folder / f"{self.kind.name}.npz"
        self.ask(do="save", path=str(path))
        with np.load(path) as arrays:
            return arrays["masks"], arrays["suns"]
