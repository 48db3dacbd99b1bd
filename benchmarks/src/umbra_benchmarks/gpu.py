"""
What a graphics card makes of the gl device: features, frames by size, and counts beside the CPU's.

One command for whoever has a card: passes are timed by the device's own timer queries, counts
are compared pixel by pixel with the CPU's, depth bounds are tried where the driver has them. On
a device in software everything runs, too: passes are timed by the clock, and what is asked for
is mostly drawn before the call returns.
"""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from umbra.cpu.frame import FrameCounter
from umbra.errors import UmbraError
from umbra.gl.context import Device, open_device
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.resources import Timers
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.selection import VolumeOptions
from umbra.machine import find_memory, name_memory
from umbra.scene import Camera, Light, Scene, directional_light, point_light
from umbra_benchmarks.growth import find_side, look_down, make_stack, make_town_scene
from umbra_benchmarks.measure import Timing
from umbra_benchmarks.motion import make_rocks
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
    show_timing,
)
from umbra_benchmarks.skinning import SkinRow, bench_skin

__all__ = ["ANCHORS", "CountRow", "FrameRow", "GpuReport", "bench_gpu"]


@dataclass(frozen=True)
class FrameRow:
    """
    Frames of one scene.

    Parameters
    ----------
    triangles, lights, samples, pixels : int
    depth_bounds : bool
        Whether lamps of limited range are counted within depth bounds.
    detail : float
        By how many pixels shadows may be off, cast from coarser meshes.
    volumes : int
        Triangles of the last frame's volumes.
    calls, frame : Timing
        Until all is asked for, and until it is drawn, by the clock [s].
    passes : dict of float
        By name: the device's time for each pass of a frame, medians [ms].
    """

    triangles: int
    lights: int
    samples: int
    pixels: int
    depth_bounds: bool
    detail: float
    volumes: int
    calls: Timing
    frame: Timing
    passes: dict[str, float]


@dataclass(frozen=True)
class CountRow:
    """
    Counts of one scene beside the CPU's.

    Parameters
    ----------
    scene, light : str
    counts_in : str
        ``stencil`` or ``float``.
    deepest : int
        The largest count.
    compared : int
        Pixels in which both see the same face.
    differ : int
        Those in which counts differ: pixels on edges of shadows.
    """

    scene: str
    light: str
    counts_in: str
    deepest: int
    compared: int
    differ: int


@dataclass(frozen=True)
class GpuReport(BenchmarkReport):
    """The benchmark's result; ``features`` name what the driver has."""

    driver: str
    features: dict[str, bool]
    frames: Sequence[FrameRow]
    counts: Sequence[CountRow]
    skins: Sequence[SkinRow]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        frames = [
            {
                **{name: getattr(row, name) for name in _SIZES},
                "calls_ms": 1e3 * row.calls.median,
                **row.frame.to_ms("frame_"),
                "passes_ms": row.passes,
            }
            for row in self.frames
        ]
        counts = [vars(row) for row in self.counts]
        return self.head(
            "gpu", driver=self.driver, features=self.features, frames=frames, counts=counts,
            skins=[row.to_dict() for row in self.skins],
        )  # fmt: skip

    def to_table(self) -> str:
        """Return Markdown tables that can be read as they stand."""
        passes = list(dict.fromkeys(name for row in self.frames for name in row.passes))
        head = ["triangles", "lights", "samples", "pixels", "depth bounds", "detail", "volumes",
                "calls ms (min)", "frame ms (min)", *(f"{name} ms" for name in passes)]  # fmt: skip
        lines = [
            [
                f"{row.triangles:,}", str(row.lights), str(row.samples), f"{row.pixels:,}",
                "on" if row.depth_bounds else "off", f"{row.detail:g}", f"{row.volumes:,}",
                show_timing(row.calls),
                show_timing(row.frame), *(f"{row.passes.get(name, 0.0):.3g}" for name in passes),
            ]
            for row in self.frames
        ]  # fmt: skip
        counted = [
            [
                row.scene, row.light, row.counts_in, str(row.deepest),
                f"{row.differ:,} of {row.compared:,}",
            ]
            for row in self.counts
        ]  # fmt: skip
        posed = [
            [
                f"{row.triangles:,}", *map(show_timing, (row.processor, row.upload, row.device)),
                f"{row.differ} of {row.sides:,}",
            ]
            for row in self.skins
        ]  # fmt: skip
        has = ", ".join(f"{name} {'yes' if there else 'no'}" for name, there in
                        self.features.items())  # fmt: skip
        return (
            f"umbra bench gpu: {self.machine}; {self.driver} ({has}). By the clock, medians "
            f"of {self.run.repeat}; passes by the device's timers.{self.small}\n\n"
            f"{lay_out_table(head, lines)}\n\n"
            + lay_out_table(["scene", "light", "counts in", "deepest", "differ"], counted)
            + "\n\nSkinned meshes: skin, planes and silhouette on the processor, as umbra finds "
            "them, and by transform feedback\n\n"
            + lay_out_table(
                [
                    "triangles",
                    "processor ms (min)",
                    "upload ms (min)",
                    "device ms (min)",
                    "sides differ",
                ],
                posed,
            )
        )


ANCHORS = (12_700_000, 73_800_000)
"""
Triangles of the largest models of Deves et al. (2018), whose shadows took 20 and 28 ms of a card.
"""
BASE_MEMORY, TRIANGLE_MEMORY = 0.3e9, 400.0
"""What frames of a town take [byte]: without it, and for each triangle."""
_SIZES = ("triangles", "lights", "samples", "pixels", "depth_bounds", "detail", "volumes")


def bench_gpu(run: BenchmarkRun) -> GpuReport:
    """
    Measure frames and compare counts on the device that opens.

    Raises
    ------
    UmbraError
        If there is no OpenGL, or less memory than the triangles that are asked for need.
    """
    size = 64 if run.quick else 1024
    with open_device() as device:
        features = {
            "depth bounds": device.has_depth_bounds,
            "timer queries": device.has_timer_queries and not device.is_software,
            "reversed depth": device.reverses_depth,
        }
        if run.triangles:
            frames = list(_time_large(device, run, run.triangles, size))
            return GpuReport(run, device.renderer, features, frames, (), ())
        frames = list(_time_scenes(device, run, size))
        run.say("counts")
        counts = list(_compare_counts(device, _list_towns(run)[0], 64 if run.quick else 512))
        skins = []
        for splits in (2,) if run.quick else (4, 6, 7):
            run.say(f"a skinned mesh of {20 * 4**splits:,} triangles")
            skins.append(bench_skin(device, splits, run.repeat))
        return GpuReport(run, device.renderer, features, frames, counts, skins)


def _list_towns(run: BenchmarkRun) -> tuple[int, ...]:
    """List the boxes of each town."""
    return (25,) if run.quick else (900, 8_333, 83_333)


def _time_scenes(device: Device, run: BenchmarkRun, size: int) -> Iterator[FrameRow]:
    """Time towns by lights, samples and depth bounds, the largest, and rocks from afar."""
    lamps = (1, 3) if run.quick else (1, 8, 64)
    for boxes in _list_towns(run):
        scene, side = make_town_scene(boxes), find_side(boxes)
        camera = look_down(side, size)
        for lights, samples in [*product(lamps, (1,)), (1, 4), (1, 8)]:
            run.say(f"{12 * boxes:,} triangles, {lights} lights, {samples} samples")
            yield _time_frames(device, scene, camera, lights, samples, run.repeat)
        if device.has_depth_bounds:
            for has in (True, False):
                run.say(f"{12 * boxes:,} triangles, depth bounds {'on' if has else 'off'}")
                with _limiting(device, has=has):
                    row = _time_frames(device, scene, camera, lamps[-1], 1, run.repeat, 0.1 * side)
                yield replace(row, depth_bounds=has)
    if not run.quick:
        yield from _time_large(device, run, ANCHORS, size)
    rocks = 20 if run.quick else 1000
    side = 10.0 * np.sqrt(rocks)
    scene, far = make_rocks(rocks), np.array([0.5, -2.0, 2.5]) * side
    camera = Camera(far, np.array([side / 2, side / 2, 0.0]), size=(size, size))
    for detail in 0.0, 1.0, 2.0, 4.0:
        run.say(f"{rocks} rocks from afar, shadows off by {detail:g} pixels")
        yield _time_frames(device, scene, camera, 1, 1, run.repeat, detail=detail)


def _time_large(
    device: Device, run: BenchmarkRun, sizes: Sequence[int], size: int
) -> Iterator[FrameRow]:
    """Time towns of so many triangles under the sun, where there is the memory; say how much."""
    for triangles in sizes:
        boxes = max(triangles // 12, 1)
        taken, held = BASE_MEMORY + 12 * boxes * TRIANGLE_MEMORY, find_memory()
        needs = f"{12 * boxes:,} triangles need {taken / 1e9:.1f} GB and {name_memory(held)}"
        if taken > held and run.triangles:
            msg = f"{needs}; ask for fewer (--triangles)"
            raise UmbraError(msg, option="triangles", needed=taken, held=held)
        if taken > held:
            run.say(f"{needs}: left out")
        elif device.is_software and not run.triangles:
            run.say(f"{needs}: left out in software; --triangles {triangles} measures them")
        else:
            run.say(needs)
            scene, camera = make_town_scene(boxes), look_down(find_side(boxes), size)
            yield _time_frames(device, scene, camera, 1, 1, run.repeat)


@contextmanager
def _limiting(device: Device, *, has: bool) -> Iterator[None]:
    """Let a device that has depth bounds do without them for a while."""
    before, device.has_depth_bounds = device.has_depth_bounds, has
    try:
        yield
    finally:
        device.has_depth_bounds = before


def _make_lights(count: int, side: float, reach: float, frame: int) -> list[Light]:
    """Let one sun turn, or lamps wander over a town."""
    if count == 1:
        angle = 0.6 + 1e-3 * frame
        return [directional_light((np.cos(angle), np.sin(angle), 1.2))]
    random = np.random.default_rng(5)
    places = random.uniform(0.2, 0.8, (count, 2)) * side + 0.05 * frame
    return [replace(point_light((x, y, 50.0)), range=reach) for x, y in places]


def _time_frames(
    device: Device,
    scene: Scene,
    camera: Camera,
    lights: int,
    samples: int,
    repeat: int,
    reach: float = np.inf,
    detail: float = 0.0,
) -> FrameRow:
    """Time frames by the clock, and then as many pass by pass."""
    make = partial(_make_lights, lights, float(camera.target[0]) * 2, reach)
    calls, frames, passes = [], [], []
    choices = VolumeOptions(detail=detail)
    with SceneRenderer(scene, 0.0, device=device, choices=choices) as renderer:
        timers = Timers(device)
        for number in range(2 + 2 * repeat):
            renderer.timers = timers if number >= 2 + repeat else None
            given = make(number)
            begun = time.perf_counter()
            renderer.draw(camera, given, samples=samples)
            asked = time.perf_counter()
            device.gl.Finish()
            if number >= 2 + repeat:
                passes.append(timers.collect())
            elif number >= 2:
                calls.append(asked - begun)
                frames.append(time.perf_counter() - begun)
        renderer.timers = None
        timers.release()
        volumes = sum(s.sides + s.dark_caps + s.light_caps + s.coarse for s in renderer.statistics)
    cols, rows = camera.size
    return FrameRow(
        triangles=sum(part.triangles for part in scene.parts),
        lights=lights,
        samples=samples,
        pixels=cols * rows,
        depth_bounds=device.has_depth_bounds,
        detail=detail,
        volumes=volumes,
        calls=Timing.of(calls),
        frame=Timing.of(frames),
        passes={
            name: float(np.median([each.get(name, 0.0) for each in passes])) for name in passes[-1]
        },
    )


def _compare_counts(device: Device, boxes: int, size: int) -> Iterator[CountRow]:
    """Count by the device and by the CPU: a town, and plates of which more lie over a point."""
    side = find_side(boxes)
    scenes = {
        "town": (make_town_scene(boxes), side),
        "300 plates": (make_stack(300), 20.0),
    }
    for name, (scene, width) in scenes.items():
        camera = look_down(width, size)
        lights = {
            "sun": directional_light((0.5, 0.3, 1.2)),
            "lamp": point_light((0.45 * width, 0.55 * width, 60.0)),
            "lamp of limited range": replace(
                point_light((0.45 * width, 0.55 * width, 14.0)), range=0.9 * width
            ),
        }
        cpu = FrameCounter(scene, ground=0.0)
        right, frame = cpu.see(camera)
        with GlFrameCounter(scene, ground=0.0, device=device) as ours:
            view, _ = ours.see(camera)
            same = right.face == view.face
            for kind, light in lights.items():
                found, expected = ours.count(view, camera, light), cpu.count(right, camera, light)
                reached = same & light.is_within(frame.position)
                assert ours.plan is not None
                statistics = ours.plan.statistics
                yield CountRow(
                    name, kind, statistics.counts_in, int(expected[reached].max(initial=0)),
                    int(reached.sum()), int((found != expected)[reached].sum()),
                )  # fmt: skip
