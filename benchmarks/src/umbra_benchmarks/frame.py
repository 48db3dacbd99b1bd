"""A frame with one point light: umbra counts; Embree asks every visible point."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from umbra.cpu.frame import FrameCounter
from umbra.rays.depth import NOTHING
from umbra.scene import Camera, make_scene, point_light
from umbra.volume.silhouette import prepare_tree
from umbra_benchmarks.embree import OFFSET, Embree
from umbra_benchmarks.measure import counted, run_in_turn, timed
from umbra_benchmarks.packets import PACKETS, EmbreePackets, sort_along_curve
from umbra_benchmarks.report import BenchmarkRun, Report, Row, SecondPeer, name_version
from umbra_benchmarks.scenes import SquareModel, make_boulder, make_town

__all__ = ["bench_frame"]

_LARGE = 500_000
"""Faces of a mesh whose frames find silhouettes in a tree."""
_TURN = 0.1
"""Seconds that each side has for its frames before the other's turn."""
_REACH = 1 - 1e-5  # rays stop just short of the light
_Place = tuple[float, float, float]


@dataclass(frozen=True)
class _FrameCase:
    name: str
    make: Callable[[], SquareModel]
    eye: _Place
    target: _Place
    light: _Place
    pixels: int
    mark: float | None


_CASES = (
    _FrameCase(
        "town from the air, 3,600 triangles",
        lambda: make_town(300, 500.0, 1),
        (-120, -150, 160), (250, 250, 0), (260, 240, 70), 1024, 45.0,
    ),
    _FrameCase(
        "city from the air, 100k triangles",
        lambda: make_town(8333, 2500.0, 2),
        (-200, -300, 450), (1250, 1250, 0), (1250, 1250, 150), 1024, 8.0,
    ),
    _FrameCase(
        "smooth, 1.3M triangles",
        lambda: make_boulder(8),
        (-100, -150, 220), (250, 250, 70), (480, -40, 300), 1024, 9.0,
    ),
)  # fmt: skip
_QUICK = (
    _FrameCase(
        "town, 120 triangles",
        lambda: make_town(10, 90.0, 1),
        (-20, -30, 60), (45, 45, 0), (50, 40, 70), 96, None,
    ),
)  # fmt: skip


def bench_frame(run: BenchmarkRun) -> Report:
    """Measure frames over a ground plane; both sides know the visible surface."""
    rows = []
    for case in _QUICK if run.quick else _CASES:
        work = f"{case.name}, {case.pixels}²"
        run.say(work)
        rows.append(_compare(work, case, run))
    return Report(run, "frame", f"embreex {name_version('embreex')}", rows)


def _compare(work: str, case: _FrameCase, run: BenchmarkRun) -> Row:
    model = case.make()
    scene = make_scene(model.vertices, model.faces)
    camera = Camera(np.array(case.eye), np.array(case.target), size=(case.pixels, case.pixels))
    light = point_light(case.light)
    alone = FrameCounter(scene, ground=0.0)
    together = FrameCounter(scene, ground=0.0, threads=run.threads)
    view, frame = alone.see(camera)
    if len(alone.caster.faces) >= _LARGE:  # as in a run of frames, and as Embree's tree is
        for counter in (alone, together):
            prepare_tree(counter.caster)

    seen = frame.part != NOTHING
    place, normal = frame.position[seen], frame.normal[seen]
    way = np.array(case.light) - place
    facing = np.einsum("ij,ij->i", normal, way) > 0
    stand = place + OFFSET * normal * np.where(facing, 1.0, -1.0)[:, None]
    origins = stand.astype(np.float32)
    directions = (np.array(case.light) - stand).astype(np.float32)
    reach = np.full(len(origins), _REACH, np.float32)
    embree = Embree(model.vertices, model.faces)
    packets = EmbreePackets(model.vertices, model.faces)
    order = sort_along_curve(origins)
    ordered = origins[order], directions[order], reach

    timings = run_in_turn(
        {
            "ours": counted(lambda: alone.count(view, camera, light), _TURN),
            "threads": timed(lambda: together.count(view, camera, light), _TURN),
            "peer": counted(lambda: embree.find_occluded(origins, directions, reach), _TURN),
            "packets": counted(lambda: packets.find_occluded(*ordered), _TURN),
        },
        run.repeat,
    )
    in_shadow = alone.count(view, camera, light)[seen] != 0
    occluded = embree.find_occluded(origins, directions, reach) == 0
    packed = packets.find_occluded(*ordered)
    return Row(
        work, timings["ours"], timings["peer"], timings["threads"], case.mark,
        int((in_shadow != occluded)[facing].sum()), int(facing.sum()),
        {"pixels": case.pixels**2, "visible": int(seen.sum())},
        SecondPeer(
            PACKETS, timings["packets"], None, int((occluded[order] != packed)[facing[order]].sum())
        ),
    )  # fmt: skip
