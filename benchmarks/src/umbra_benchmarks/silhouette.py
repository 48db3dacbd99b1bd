"""
Silhouette edges by tree, by hextree and by brute force, and by VTK.

Brute force is measured twice, since it is two things: one light at a time, as papers
have it, and 64 lights in one pass over the edges, as umbra asks a day's suns. What a
tree gains over the first is what it gains for frames, and over the second for studies.
"""

import time
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.machine import use_threads
from umbra.volume.adjacency import Caster, make_caster
from umbra.volume.dual_tree import make_dual_tree
from umbra.volume.duals import Tree
from umbra.volume.silhouette import find_silhouettes
from umbra_benchmarks.hextree import make_hextree
from umbra_benchmarks.measure import Contender, run_in_turn, timed
from umbra_benchmarks.report import BenchmarkRun, Report, Row, name_version
from umbra_benchmarks.scenes import SquareModel, make_boulder, make_suns, make_town

__all__ = ["bench_silhouette"]

_CASES = (
    ("town, 3,600 triangles", lambda: make_town(300, 500.0, 1), None, None),
    ("city, 100k triangles", lambda: make_town(8333, 2500.0, 2), None, None),
    ("smooth, 1.3M triangles", lambda: make_boulder(8), 10.0, 500.0),
)  # marks: against brute force, against VTK
_QUICK = (
    ("town, 120 triangles", lambda: make_town(10, 90.0, 1), None, None),
    ("smooth, 1,280 triangles", lambda: make_boulder(3), None, None),
)


def bench_silhouette(run: BenchmarkRun) -> Report:
    """
    Measure finding the silhouettes of one sun and of 33, the sweep of a day.

    The peer of one light is VTK's ``vtkPolyDataSilhouette`` if package vtk is
    installed, else brute force in numpy. Adjacency and trees, VTK's too, are built before
    the clock starts; the JSON object has the time that the trees take.
    """
    vtk = _find_vtk()
    if vtk is None:
        run.say(
            "the peer of one light is numpy; to compare with VTK: "
            "pip install 'umbra-benchmarks[vtk]'"
        )
    suns = np.append(make_suns(), np.zeros((33, 1)), 1)
    rows = []
    for name, make, brute_mark, vtk_mark in _QUICK if run.quick else _CASES:
        run.say(name)
        model = make()
        caster = make_caster(model.vertices, model.faces)
        trees, build_ms = _build(caster, run.threads)
        facts = {"edges": len(caster.edges), "build_ms": build_ms}
        rows.append(_compare_one(name, caster, model, suns[16], vtk, vtk_mark, run, facts, trees))
        rows += _compare_sweeps(name, caster, suns, brute_mark, run, facts, trees)
    return Report(run, "silhouette", "other", rows)


def _build(caster: Caster, threads: int) -> tuple[dict[str, Tree], dict[str, float]]:
    """Build trees; return them, and how long each took [ms]."""
    use_threads(threads)
    trees: dict[str, Tree] = {}
    milliseconds = {}
    for name, make in (("tree", make_dual_tree), ("hextree", make_hextree)):
        make(caster)  # compiles
        begun = time.perf_counter()
        trees[name] = make(caster)
        milliseconds[name] = 1e3 * (time.perf_counter() - begun)
    return trees, milliseconds


def _compare_one(
    name: str,
    caster: Caster,
    model: SquareModel,
    sun: NDArray[np.float64],
    vtk: SimpleNamespace | None,
    mark: float | None,
    run: BenchmarkRun,
    facts: dict[str, Any],
    trees: dict[str, Tree],
) -> Row:
    """Compare the tree with VTK, or numpy, for one light."""
    reference = _Numpy(caster, sun[None])
    rival = reference if vtk is None else _Vtk(vtk, model, sun[None])
    peer = f"numpy {name_version('numpy')}" if vtk is None else f"vtk {name_version('vtk')}"
    search = {n: _search(caster, sun[None], n, trees["tree"]) for n in (1, run.threads)}
    timings = run_in_turn(
        {"ours": search[1], "peer": timed(rival.run), "threads": search[run.threads]}, run.repeat
    )
    (expected,) = reference.run()
    (codes,) = _list_codes(caster, sun[None], trees["tree"])
    differ = len(np.setxor1d(codes >> 2, expected))
    if isinstance(rival, _Vtk):
        differ += abs(rival.count_edges() - len(expected))
    return Row(
        f"{name}, 1 light: tree against {peer}",
        timings["ours"], timings["peer"], timings["threads"],
        None if vtk is None else mark, differ, len(expected), {**facts, "lights": 1},
    )  # fmt: skip


def _compare_sweeps(
    name: str,
    caster: Caster,
    suns: NDArray[np.float64],
    mark: float | None,
    run: BenchmarkRun,
    facts: dict[str, Any],
    trees: dict[str, Tree],
) -> list[Row]:
    """Compare the ways to find many suns' silhouettes with each other, all in turn."""
    methods: dict[str, str | Tree] = {**trees, "brute force, 64 at once": "brute"}
    contenders = {
        f"{way} {n}": _search(caster, suns, n, method)
        for way, method in methods.items()
        for n in (1, run.threads)
    }
    alone = [_search(caster, suns[k : k + 1], 1, "brute") for k in range(len(suns))]
    contenders["brute force, one by one 1"] = timed(lambda: [search() for search in alone])
    reference = _Numpy(caster, suns)
    contenders["numpy, one by one 1"] = timed(reference.run)
    timings = run_in_turn(contenders, run.repeat)
    expected = reference.run()
    rows = []
    for ours, peer, to_reach in (
        ("tree", "brute force, one by one", mark),
        ("tree", "brute force, 64 at once", None),
        ("hextree", "brute force, one by one", None),
        ("brute force, 64 at once", "numpy, one by one", None),
    ):
        found = _list_codes(caster, suns, methods[ours])
        differ = sum(len(np.setxor1d(mine >> 2, theirs)) for mine, theirs in zip(found, expected))
        rows.append(
            Row(
                f"{name}, {len(suns)} lights: {ours} against {peer}",
                timings[f"{ours} 1"], timings[f"{peer} 1"], timings[f"{ours} {run.threads}"],
                to_reach, differ, sum(map(len, expected)), {**facts, "lights": len(suns)},
            )
        )  # fmt: skip
    return rows


def _search(
    caster: Caster, suns: NDArray[np.float64], threads: int, method: str | Tree
) -> Contender:
    def search() -> None:
        use_threads(threads)
        for _ in find_silhouettes(caster, suns, method):
            pass

    return timed(search)


def _list_codes(
    caster: Caster, suns: NDArray[np.float64], method: str | Tree
) -> list[NDArray[np.int32]]:
    """Return the codes of each light."""
    codes = []
    for _, found in find_silhouettes(caster, suns, method):
        codes += np.split(found.codes[: found.starts[-1]], found.starts[1:-1])
    return codes


@dataclass(frozen=True, eq=False)
class _Numpy:
    """Plain arrays: dot products, then a comparison across every edge (closed meshes)."""

    caster: Caster
    suns: NDArray[np.float64]

    def run(self) -> list[NDArray[np.intp]]:
        """Find the edges for each light."""
        first, second = self.caster.edge_faces.T
        found = []
        for sun in self.suns:
            is_lit = sun @ self.caster.planes > 0
            found.append(np.flatnonzero(is_lit[first] != is_lit[second]))
        return found


class _Vtk:
    """VTK's filter, seen along each light; its adjacency is built before the clock."""

    def __init__(self, vtk: Any, model: SquareModel, suns: NDArray[np.float64]) -> None:
        self.suns = suns
        self._points = model.vertices.astype(np.float64)
        offsets = np.arange(0, 3 * len(model.faces) + 1, 3, dtype=np.int64)
        cells = vtk.cells()
        cells.SetData(vtk.as_vtk(offsets), vtk.as_vtk(model.faces.ravel().astype(np.int64)))
        points = vtk.points()
        points.SetData(vtk.as_vtk(self._points))
        mesh = vtk.mesh()
        mesh.SetPoints(points)
        mesh.SetPolys(cells)
        self._filter = vtk.silhouette()
        self._filter.SetInputData(mesh)
        self._filter.SetDirectionToSpecifiedVector()
        self._filter.SetEnableFeatureAngle(0)

    def run(self) -> None:
        """Find the edges for each light."""
        for sun in self.suns:
            self._filter.SetVector(*-sun[:3])
            self._filter.Modified()  # else the same vector would not be looked at again
            self._filter.Update()

    def count_edges(self) -> int:
        """Return how many edges were found for the last light."""
        return self._filter.GetOutput().GetNumberOfLines()


def _find_vtk() -> SimpleNamespace | None:
    """Return what VTK's filter needs, or None if VTK is not installed."""
    try:
        from vtkmodules.util.numpy_support import numpy_to_vtk  # noqa: PLC0415
        from vtkmodules.vtkCommonCore import vtkPoints  # noqa: PLC0415
        from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData  # noqa: PLC0415
        from vtkmodules.vtkFiltersHybrid import vtkPolyDataSilhouette  # noqa: PLC0415
    except ImportError:
        return None
    return SimpleNamespace(
        as_vtk=partial(numpy_to_vtk, deep=True), points=vtkPoints, cells=vtkCellArray,
        mesh=vtkPolyData, silhouette=vtkPolyDataSilhouette,
    )  # fmt: skip
