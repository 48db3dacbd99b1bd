"""
How far soft shadows are from the truth, by method and by how finely it works.

The truth is asked of rays in float64: from visible points in the penumbra to 4,096 places, evenly
spread over the disc that such a point sees of the lamp. Errors are those of these points, all
over what is seen, and of no others: what is fully lit or fully dark is easy.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.frame import FrameCounter
from umbra.methods import Softness
from umbra.rays.face_tree import make_face_tree
from umbra.rays.hidden import find_hidden
from umbra.scene import Camera, Mesh, Part, make_scene, point_light
from umbra.soft import AreaLight, ball_light, make_axes
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
)
from umbra_benchmarks.scenes import make_boxes

__all__ = ["SoftCase", "SoftErrors", "bench_soft", "find_share_by_rays", "spread_over_disc"]

RAYS = 4096
_POINTS = 2000  # of a penumbra, evenly picked
_LONG = 1.0  # seconds; what takes longer is not run again
_FINEST = 1024  # spots that find the penumbra's points
_TRIED = [
    ("hard", {}),
    *(("samples", {"samples": n}) for n in (16, 64, 256, 1024)),
    ("wedges", {}),
    ("weng", {}),
    *(("complexity", {"spots": n}) for n in (1, 4, 16, 64, 256)),
]
Boxes = tuple[list[list[float]], list[list[float]]]


def _plates(*spans: tuple[float, float, float]) -> Boxes:
    """Give thin boxes, 2 m deep, from x to x at a height each."""
    return (
        [[(a + b) / 2, 0, z] for a, b, z in spans],
        [[(b - a) / 2, 1, 0.005] for a, b, z in spans],
    )


_LAMP = ball_light(point_light((3.0, 1.7, 8.0)), 0.6)
_SCENES: dict[str, tuple[Boxes, AreaLight]] = {
    "cube": (([[0, 0, 1.6]], [[0.8] * 3]), ball_light(point_light((3.0, 2.0, 8.0)), 0.5)),
    "cube, a large lamp near": (
        ([[0, 0, 1.6]], [[0.8] * 3]),
        ball_light(point_light((0.5, 0.3, 4.0)), 1.5),
    ),
    "two plates": (_plates((-1, 0.6, 1), (-0.7, 1, 1.6)), _LAMP),
    "stack of eight": (_plates(*((-1 + 0.03 * k, 1, 1 + 0.2 * k) for k in range(8))), _LAMP),
    "fence": (
        ([[-1.95 + 0.2 * k, 0, 1.15] for k in range(20)], [[0.05, 0.05, 0.85]] * 20),
        _LAMP,
    ),
}


@dataclass(frozen=True)
class MethodError:
    """
    One method, as fine as it was tried.

    Parameters
    ----------
    name : str
    fineness : dict
        Of ``Softness``.
    seconds : float
        Least processor time of its runs, with what is seen known [s].
    l1, bias, rms, most : float
        Mean of the absolute and of the signed errors of visibility, root of the mean square, and
        largest; positive is too bright.
    """

    name: str
    fineness: dict[str, int]
    seconds: float
    l1: float
    bias: float
    rms: float
    most: float


@dataclass(frozen=True)
class SoftCase:
    """One scene: how many points were asked of rays, and the methods."""

    name: str
    points: int
    found: list[MethodError]


@dataclass(frozen=True)
class SoftErrors(BenchmarkReport):
    """Errors of all methods in all scenes, in pictures of a size."""

    cases: list[SoftCase]
    size: tuple[int, int]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        return self.head("soft", threads=1) | {
            "size": self.size,
            "rays": RAYS,
            "scenes": [
                {
                    "scene": case.name,
                    "points": case.points,
                    "methods": [vars(each) for each in case.found],
                }
                for case in self.cases
            ],
        }

    def to_table(self) -> str:
        """Return a Markdown table that can be read as it stands."""
        head = ["method", *(case.name for case in self.cases)]
        lines = [
            [
                " ".join([name, *map(str, fineness.values())]),
                *(
                    f"{each.l1:.4f}, {each.most:.2f}, {1e3 * each.seconds:.3g} ms"
                    for each in (case.found[place] for case in self.cases)
                ),
            ]
            for place, (name, fineness) in enumerate(_TRIED)
        ]
        cols, rows = self.size
        return (
            f"umbra bench soft: {self.machine}. {cols}x{rows} pixels. Mean and largest error "
            f"of visibility in the penumbra, against {RAYS:,} rays from each of up to {_POINTS:,} "
            f"points, and processor time on one thread.{self.small}\n\n{lay_out_table(head, lines)}"
        )


def bench_soft(run: BenchmarkRun) -> SoftErrors:
    """Find errors and times of all methods in scenes with and without overlaps."""
    size = (96, 72) if run.quick else (480, 360)
    camera = Camera(np.array((-4.5, -6.0, 5.0)), np.array((-0.6, -0.4, 0.6)), size=size, fov=45.0)
    cases = []
    for name, (boxes, light) in _SCENES.items():
        run.say(name)
        scene = make_scene([Part("caster", "", Mesh(*make_boxes(*boxes)))])
        cases.append(_measure(name, FrameCounter(scene, ground=0.0), camera, light, run))
    return SoftErrors(run, cases, size)


def _measure(
    name: str, counter: FrameCounter, camera: Camera, light: AreaLight, run: BenchmarkRun
) -> SoftCase:
    """Try all methods on one scene."""
    view, frame = counter.see(camera)

    def work(method: str, fineness: dict[str, int]) -> NDArray[np.float32]:
        if method == "hard":
            return (counter.count(view, camera, light.light) == 0).astype(np.float32)
        softness = Softness(**fineness)
        return counter.find_visibility(view, camera, [light], method, softness)[0]

    finest = work("complexity", {"spots": _FINEST})
    places = np.argwhere((finest > 0) & (finest < 1))
    places = places[:: max(len(places) // (_POINTS // (10 if run.quick else 1)), 1)].T
    truth = find_share_by_rays(counter, frame.position[*places], frame.normal[*places], light)
    in_part = (truth > 0) & (truth < 1)
    found = []
    for method, fineness in _TRIED:
        share, seconds = _time(partial(work, method, fineness), run.repeat)
        error = share[*places][in_part] - truth[in_part]
        found.append(
            MethodError(
                method, fineness, seconds, float(np.abs(error).mean()), float(error.mean()),
                float(np.sqrt((error**2).mean())), float(np.abs(error).max()),
            )
        )  # fmt: skip
    return SoftCase(name, int(in_part.sum()), found)


def _time(work: Callable[[], NDArray], repeat: int) -> tuple[NDArray, float]:
    """Return what the work gives, and its least processor time [s]; the first run compiles."""
    taken: list[float] = []
    while len(taken) <= repeat and sum(taken) < _LONG:
        begun = time.process_time()
        found = work()
        taken.append(time.process_time() - begun)
    return found, min(taken)


def find_share_by_rays(
    counter: FrameCounter,
    positions: NDArray[np.float64],
    normals: NDArray[np.float64],
    light: AreaLight,
) -> NDArray[np.float64]:
    """
    Find what share of a ball visible points see, by rays to the disc that each sees of it.

    Parameters
    ----------
    counter : FrameCounter
        Of the casters.
    positions, normals : (n, 3) float64
        In the model's own coordinates; normals of the sides that are seen.
    light : AreaLight
        Of `ball_light`, at a place.

    Returns
    -------
    shares : (n,) float64
    """
    tree = make_face_tree(counter.caster)
    middle = light.light.local(counter.scene.origin)[:3]
    across = spread_over_disc(RAYS)
    shares = np.zeros(len(positions))
    lights = np.ones((RAYS, 4))
    for k, (point, normal) in enumerate(
        zip(positions - counter.scene.origin, normals, strict=True)
    ):
        way = middle - point
        away = np.linalg.norm(way)
        apparent = light.radius * away / np.sqrt(away**2 - light.radius**2)
        lights[:, :3] = middle + apparent * across @ np.stack(make_axes(way / away))
        hidden = find_hidden(tree, point[None], normal[None], lights)
        shares[k] = 1.0 - hidden.mean()
    return shares


def spread_over_disc(n: int) -> NDArray[np.float64]:
    """Spread places (n, 2) evenly over the unit disc, by square rings: no spiral, no sequence."""
    side = int(np.sqrt(n))
    steps = (np.arange(side) + 0.5) / side
    away, turn = np.meshgrid(np.sqrt(steps), 2 * np.pi * steps)
    return np.stack([(away * np.cos(turn)).ravel(), (away * np.sin(turn)).ravel()], 1)
