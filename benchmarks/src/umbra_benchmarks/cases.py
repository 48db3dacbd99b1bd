"""How many triangles each of McGuire's three cases draws, over sizes of one shape."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.polygons import make_dark_cap, make_light_cap, make_sides
from umbra.scene.camera import Camera
from umbra.volume.adjacency import make_caster
from umbra.volume.placement import find_placement
from umbra_benchmarks.measure import repeat_work
from umbra_benchmarks.report import BenchmarkRun
from umbra_benchmarks.scenes import SquareModel, make_boulder

__all__ = ["CAMERAS", "LAMP", "DrawnTriangles", "count_cases", "find_growth"]

_MIDDLE = np.array([250.0, 250.0, 110.0])
LAMP = np.array([450.0, 350.0, 410.0, 1.0])
_AWAY = (_MIDDLE - LAMP[:3]) / np.linalg.norm(_MIDDLE - LAMP[:3])
_ASIDE = np.cross(_AWAY, [0.0, 0.0, 1.0])
CAMERAS = (
    # Beside the shape, which shades nothing here; in its shadow, looking on; looking back.
    Camera(_MIDDLE + 300.0 * _ASIDE, _MIDDLE),
    Camera(_MIDDLE + 90.0 * _AWAY, _MIDDLE + 200.0 * _AWAY),
    Camera(_MIDDLE + 150.0 * _AWAY, _MIDDLE),
)


@dataclass(frozen=True)
class DrawnTriangles:
    """
    Triangles drawn for one mesh.

    Parameters
    ----------
    shape : str
    faces, silhouette : int
        Triangles of the mesh; its silhouette edges, with multiplicity.
    drawn : tuple of int
        Triangles in cases 1, 2 and 3.
    directional : tuple of int
        The same for a directional light from the same side.
    extruded : int
        Triangles of z-fail with extruded caps, whatever the view (before McGuire).
    placing : tuple of float
        Median time to find each placement [s].
    """

    shape: str
    faces: int
    silhouette: int
    drawn: tuple[int, int, int]
    directional: tuple[int, int, int]
    extruded: int
    placing: tuple[float, float, float]


def count_cases(run: BenchmarkRun) -> list[DrawnTriangles]:
    """
    Count what each case draws of a ball and of a boulder, from 1k to 1M triangles.

    There is a camera for each case; that it gets the case it is meant for is checked.

    Returns
    -------
    drawn : list of DrawnTriangles
        All sizes of one shape, then of the next.

    Raises
    ------
    RuntimeError
        If a camera gets another case.
    """
    return [
        _measure(shape, make(splits), run)
        for shape, make in (("ball", _make_ball), ("boulder", make_boulder))
        for splits in ((2, 3) if run.quick else range(3, 9))
    ]


def find_growth(drawn: Sequence[DrawnTriangles], shape: str) -> tuple[float, float, float]:
    """
    Return how the triangles of each case grow: the power of the number of faces.

    Fitted through all sizes of a shape on logarithmic axes.
    """
    rows = [row for row in drawn if row.shape == shape]
    size = np.log([row.faces for row in rows])
    slopes = np.polyfit(size, np.log([row.drawn for row in rows]), 1)[0]
    return (float(slopes[0]), float(slopes[1]), float(slopes[2]))


def _measure(shape: str, model: SquareModel, run: BenchmarkRun) -> DrawnTriangles:
    run.say(f"{shape}, {len(model.faces):,} triangles")
    caster = make_caster(model.vertices, model.faces)
    placing = []
    for case, camera in enumerate(CAMERAS, 1):
        placement, took = repeat_work(partial(find_placement, caster, camera, LAMP), run.repeat)
        if placement.case != case:
            msg = f"the {shape}'s camera for case {case} got case {placement.case}"
            raise RuntimeError(msg)
        placing.append(took.median)
    sides = make_sides(caster, LAMP)
    edges = int(sides.multiplicity.sum())
    lit = len(make_light_cap(caster, LAMP).multiplicity)
    fan = int(make_dark_cap(caster, LAMP).multiplicity.sum())
    sun = np.append(-_AWAY, 0.0)
    far_edges = int(make_sides(caster, sun).multiplicity.sum())
    far_lit = len(make_light_cap(caster, sun).multiplicity)
    return DrawnTriangles(
        shape=shape,
        faces=len(caster.faces),
        silhouette=edges,
        drawn=(2 * edges, 2 * edges + fan, 2 * edges + fan + lit),
        directional=(far_edges, far_edges, far_edges + far_lit),
        extruded=2 * edges + 2 * lit,
        placing=(placing[0], placing[1], placing[2]),
    )


def _make_ball(splits: int) -> SquareModel:
    """Make the boulder round, its vertices where the boulder's would be without swell."""
    model = make_boulder(splits)
    apart: NDArray[np.float64] = model.vertices - _MIDDLE
    apart *= 70.0 / np.linalg.norm(apart, axis=1, keepdims=True)
    vertices = (_MIDDLE + apart).astype(np.float32).astype(np.float64)
    return SquareModel(vertices, model.faces, model.side)
