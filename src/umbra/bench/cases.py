"""How many triangles each of McGuire's three cases draws, over sizes of one shape."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.bench.report import describe_machine, lay_out_table, name_version
from umbra.bench.scenes import Model, make_boulder
from umbra.scene.camera import Camera
from umbra.volume.adjacency import make_caster
from umbra.volume.placement import find_placement
from umbra.volume.polygons import make_dark_cap, make_light_cap, make_sides

__all__ = ["Cases", "Drawn", "bench_cases"]

_MIDDLE = np.array([250.0, 250.0, 110.0])
_LIGHT = np.array([450.0, 350.0, 410.0, 1.0])
_AWAY = (_MIDDLE - _LIGHT[:3]) / np.linalg.norm(_MIDDLE - _LIGHT[:3])
_ASIDE = np.cross(_AWAY, [0.0, 0.0, 1.0])
_CAMERAS = (
    # Beside the shape, which shades nothing here; in its shadow, looking on; looking back.
    Camera(_MIDDLE + 300.0 * _ASIDE, _MIDDLE),
    Camera(_MIDDLE + 90.0 * _AWAY, _MIDDLE + 200.0 * _AWAY),
    Camera(_MIDDLE + 150.0 * _AWAY, _MIDDLE),
)


@dataclass(frozen=True)
class Drawn:
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


@dataclass(frozen=True)
class Cases:
    """
    What each case draws, over shapes and sizes.

    Parameters
    ----------
    rows : list of Drawn
    repeat : int
        Runs behind each median.
    quick : bool
        Whether sizes are too small to mean anything.
    """

    rows: list[Drawn]
    repeat: int
    quick: bool

    def growth(self, shape: str) -> tuple[float, float, float]:
        """
        Give how the triangles of each case grow: the power of the number of faces.

        Fitted through all sizes of a shape on logarithmic axes.
        """
        rows = [row for row in self.rows if row.shape == shape]
        size = np.log([row.faces for row in rows])
        drawn = np.log([row.drawn for row in rows])
        slopes = np.polyfit(size, drawn, 1)[0]
        return (float(slopes[0]), float(slopes[1]), float(slopes[2]))

    def shapes(self) -> list[str]:
        """Name the shapes, each once."""
        return list(dict.fromkeys(row.shape for row in self.rows))

    def to_dict(self) -> dict[str, Any]:
        """Give the JSON object."""
        return {
            "benchmark": "cases",
            "umbra": name_version("umbra-shadows"),
            "machine": describe_machine(),
            "repeat": self.repeat,
            "quick": self.quick,
            "rows": [
                {
                    "shape": row.shape,
                    "faces": row.faces,
                    "silhouette_edges": row.silhouette,
                    "triangles": row.drawn,
                    "triangles_directional": row.directional,
                    "triangles_extruded_caps": row.extruded,
                    "placing_ms": [1e3 * seconds for seconds in row.placing],
                }
                for row in self.rows
            ],
            "growth": {shape: self.growth(shape) for shape in self.shapes()},
        }

    def to_table(self) -> str:
        """Give a Markdown table that can be read as it stands."""
        head = [
            "shape", "faces", "silhouette edges", "case 1", "case 2", "case 3",
            "directional 1, 2, 3", "extruded caps", "placed in ms 1, 2, 3",
        ]  # fmt: skip
        lines = [
            [
                row.shape,
                f"{row.faces:,}",
                f"{row.silhouette:,}",
                *(f"{count:,}" for count in row.drawn),
                "; ".join(f"{count:,}" for count in row.directional),
                f"{row.extruded:,}",
                "; ".join(f"{1e3 * seconds:.3g}" for seconds in row.placing),
            ]
            for row in self.rows
        ]
        small = " Sizes are too small to mean anything (--quick)." if self.quick else ""
        growth = "\n".join(
            f"{shape}: triangles grow as the number of faces to the power of "
            + ", ".join(f"{power:.2f}" for power in self.growth(shape))
            + " in cases 1, 2, 3."
            for shape in self.shapes()
        )
        return (
            f"umbra bench cases: {describe_machine()}. Triangles drawn; times are medians of "
            f"{self.repeat} runs.{small}\n\n{lay_out_table(head, lines)}\n\n{growth}"
        )


def bench_cases(
    *,
    repeat: int,
    quick: bool,
    say: Callable[[str], object] = lambda _: None,
) -> Cases:
    """
    Count what each case draws of a ball and of a boulder, from 1k to 1M triangles.

    There is a camera for each case; that it gets the case it is meant for is checked.

    Parameters
    ----------
    repeat : int
    quick : bool
    say : callable
        Told what is measured next.

    Returns
    -------
    cases : Cases

    Raises
    ------
    RuntimeError
        If a camera gets another case.
    """
    rows = []
    for shape, make in (("ball", _make_ball), ("boulder", make_boulder)):
        for splits in (2, 3) if quick else range(3, 9):
            say(f"{shape}, {20 * 4**splits:,} triangles")
            rows.append(_measure(shape, make(splits), repeat))
    return Cases(rows, repeat, quick)


def _measure(shape: str, model: Model, repeat: int) -> Drawn:
    caster = make_caster(model.vertices, model.faces)
    placing = []
    for case, camera in enumerate(_CAMERAS, 1):
        seconds = []
        for _ in range(repeat):
            begun = time.perf_counter()
            placement = find_placement(caster, camera, _LIGHT)
            seconds.append(time.perf_counter() - begun)
        if placement.case != case:
            msg = f"the {shape}'s camera for case {case} got case {placement.case}"
            raise RuntimeError(msg)
        placing.append(float(np.median(seconds)))
    sides = make_sides(caster, _LIGHT)
    edges = int(sides.multiplicity.sum())
    lit = len(make_light_cap(caster, _LIGHT).multiplicity)
    fan = int(make_dark_cap(caster, _LIGHT).multiplicity.sum())
    sun = np.append(-_AWAY, 0.0)
    far_edges = int(make_sides(caster, sun).multiplicity.sum())
    far_lit = len(make_light_cap(caster, sun).multiplicity)
    return Drawn(
        shape=shape,
        faces=len(caster.faces),
        silhouette=edges,
        drawn=(2 * edges, 2 * edges + fan, 2 * edges + fan + lit),
        directional=(far_edges, far_edges, far_edges + far_lit),
        extruded=2 * edges + 2 * lit,
        placing=(placing[0], placing[1], placing[2]),
    )


def _make_ball(splits: int) -> Model:
    """Make the boulder round, its vertices where the boulder's would be without swell."""
    model = make_boulder(splits)
    apart: NDArray[np.float64] = model.vertices - _MIDDLE
    apart *= 70.0 / np.linalg.norm(apart, axis=1, keepdims=True)
    vertices = (_MIDDLE + apart).astype(np.float32).astype(np.float64)
    return Model(vertices, model.faces, model.side)
