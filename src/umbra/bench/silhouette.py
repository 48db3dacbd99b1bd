"""Silhouette edges by brute force, for one light and for many."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.bench.measure import Contender, run_in_turn, timed
from umbra.bench.report import Report, Row, name_version
from umbra.bench.scenes import Model, make_boulder, make_suns, make_town
from umbra.cpu.threads import use_threads
from umbra.volume.adjacency import Caster, make_caster
from umbra.volume.silhouette import find_silhouettes

__all__ = ["bench_silhouette"]

_CASES = (
    ("town, 3,600 triangles", lambda: make_town(300, 500.0, 1)),
    ("city, 100k triangles", lambda: make_town(8333, 2500.0, 2)),
    ("smooth, 1.3M triangles", lambda: make_boulder(8)),
)
_QUICK = (
    ("town, 120 triangles", lambda: make_town(10, 90.0, 1)),
    ("smooth, 1,280 triangles", lambda: make_boulder(3)),
)


def bench_silhouette(
    *, threads: int, repeat: int, quick: bool, say: Callable[[str], object] = lambda _: None
) -> Report:
    """
    Measure finding the silhouettes of one sun and of 33.

    The peer is VTK's ``vtkPolyDataSilhouette`` if package vtk is installed, else the
    same brute force in numpy. Edges are compared with numpy's in both cases.

    Parameters
    ----------
    threads : int
        Also run umbra on so many.
    repeat : int
    quick : bool
    say : callable
        Told what is measured next.

    Returns
    -------
    report : Report
    """
    vtk = _find_vtk()
    if vtk is None:
        peer = f"numpy {name_version('numpy')}"
        say("the peer is numpy; to compare with VTK: pip install vtk")
    else:
        peer = f"vtk {name_version('vtk')}"
    all_suns = np.append(make_suns(), np.zeros((33, 1)), 1)
    rows = []
    for name, make in _QUICK if quick else _CASES:
        model = make()
        caster = make_caster(model.vertices, model.faces)
        for suns in (all_suns[16:17], all_suns):
            work = f"{name}, {len(suns)} {'light' if len(suns) == 1 else 'lights'}"
            say(work)
            reference = _Numpy(caster, suns)
            rival = reference if vtk is None else _Vtk(vtk, model, suns)
            timings = run_in_turn(
                {
                    "ours": _search(caster, suns, 1),
                    "peer": timed(rival.run),
                    "threads": _search(caster, suns, threads),
                },
                repeat,
            )
            differ, found = _count_differences(caster, suns, reference.run())
            edges = len(caster.edges)
            rows.append(
                Row(
                    work, timings["ours"], timings["peer"], timings["threads"], None,
                    differ, found,
                    {
                        "edges": edges,
                        "lights": len(suns),
                        "edges_per_second": edges * len(suns) / timings["ours"].median,
                    },
                )
            )  # fmt: skip
    return Report("silhouette", peer, threads, repeat, quick, rows)


def _search(caster: Caster, suns: NDArray[np.float64], threads: int) -> Contender:
    def search() -> None:
        use_threads(threads)
        for _ in find_silhouettes(caster, suns):
            pass

    return timed(search)


def _count_differences(
    caster: Caster, suns: NDArray[np.float64], expected: list[NDArray[np.intp]]
) -> tuple[int, int]:
    """Count the edges that only one side found, and all that were expected."""
    differ = 0
    for which, found in find_silhouettes(caster, suns):
        for k, edges in enumerate(expected[which]):
            mine = found.codes[found.starts[k] : found.starts[k + 1]] >> 2
            differ += len(np.setxor1d(mine, edges))
    return differ, sum(len(edges) for edges in expected)


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

    def __init__(self, vtk: Any, model: Model, suns: NDArray[np.float64]) -> None:
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


@dataclass(frozen=True)
class _VtkNames:
    as_vtk: Callable[..., Any]
    points: Any
    cells: Any
    mesh: Any
    silhouette: Any


def _find_vtk() -> _VtkNames | None:
    try:
        from vtkmodules.util.numpy_support import numpy_to_vtk  # noqa: PLC0415
        from vtkmodules.vtkCommonCore import vtkPoints  # noqa: PLC0415
        from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData  # noqa: PLC0415
        from vtkmodules.vtkFiltersHybrid import vtkPolyDataSilhouette  # noqa: PLC0415
    except ImportError:
        return None
    as_vtk = lambda array: numpy_to_vtk(array, deep=True)  # noqa: E731
    return _VtkNames(as_vtk, vtkPoints, vtkCellArray, vtkPolyData, vtkPolyDataSilhouette)
