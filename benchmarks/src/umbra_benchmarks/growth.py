"""
How the cost of a gl frame grows: with triangles, lights, pixels and volumes over one another.

Along each axis one number grows and all others stay. The exponent is the slope of a line
through the costs on logarithmic axes: 1 where twice as much costs twice as much.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from umbra.gl.context import Device, open_device
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Camera, Light, Mesh, Part, Scene, directional_light, make_scene, point_light
from umbra_benchmarks.measure import Timing
from umbra_benchmarks.ours_gl import drawing_nothing
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
    show_timing,
)
from umbra_benchmarks.scenes import make_boxes, make_town

__all__ = [
    "Growth",
    "GrowthReport",
    "bench_growth",
    "fit_exponent",
    "make_stack",
    "make_town_scene",
]

_BOXES, _SIZE = 900, 512
_PLOT = 25.0  # of a town's box [m]


@dataclass(frozen=True)
class Step:
    """One point of an axis: its number, a scene, a view, and the lights of a frame."""

    number: int
    scene: Callable[[], Scene]
    camera: Camera
    lights: Callable[[int], list[Light]]


@dataclass(frozen=True)
class Growth:
    """
    What was measured along one axis.

    Parameters
    ----------
    axis : str
    numbers : tuple of int
    calls, frames : tuple of Timing
        Processor time of a frame before anything is drawn, and of all of it [s].
    """

    axis: str
    numbers: tuple[int, ...]
    calls: tuple[Timing, ...]
    frames: tuple[Timing, ...]

    def exponents(self) -> tuple[float, float]:
        """Return the exponents of the calls and of the frames."""
        calls, frames = (
            fit_exponent(self.numbers, [timing.least for timing in timings])
            for timings in (self.calls, self.frames)
        )
        return calls, frames


@dataclass(frozen=True)
class GrowthReport(BenchmarkReport):
    """The benchmark's result."""

    driver: str
    axes: Sequence[Growth]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        axes = []
        for axis in self.axes:
            calls, frames = axis.exponents()
            axes.append(
                {
                    "axis": axis.axis,
                    "numbers": axis.numbers,
                    "calls_min_ms": [1e3 * timing.least for timing in axis.calls],
                    "frames_min_ms": [1e3 * timing.least for timing in axis.frames],
                    "calls_exponent": calls,
                    "frames_exponent": frames,
                }
            )
        return self.head("growth", driver=self.driver, axes=axes)

    def to_table(self) -> str:
        """Return a Markdown table that can be read as it stands."""
        head = ["with", "from", "to", "calls ms (min)", "exponent", "frame ms (min)", "exponent"]
        lines = []
        for axis in self.axes:
            calls, frames = axis.exponents()
            lines.append(
                [
                    axis.axis, f"{axis.numbers[0]:,}", f"{axis.numbers[-1]:,}",
                    " to ".join(show_timing(axis.calls[k]) for k in (0, -1)), f"{calls:.2f}",
                    " to ".join(show_timing(axis.frames[k]) for k in (0, -1)), f"{frames:.2f}",
                ]
            )  # fmt: skip
        return (
            f"umbra bench growth: {self.machine}; {self.driver}. Processor time of a frame, "
            f"medians of {self.run.repeat}; exponents of the minima.{self.small}\n\n"
            f"{lay_out_table(head, lines)}"
        )


def fit_exponent(numbers: Sequence[int], costs: Sequence[float]) -> float:
    """Return the slope of costs over numbers on logarithmic axes."""
    return float(np.polyfit(np.log(numbers), np.log(costs), 1)[0])


def bench_growth(run: BenchmarkRun) -> GrowthReport:
    """
    Measure how the cost of a frame grows.

    Raises
    ------
    UmbraError
        If there is no OpenGL.
    """
    axes = []
    with open_device() as device:
        for axis, steps in list_axes(quick=run.quick).items():
            run.say(axis)
            timings = [_measure(device, step, run.repeat) for step in steps]
            calls, frames = zip(*timings, strict=True)
            axes.append(Growth(axis, tuple(step.number for step in steps), calls, frames))
        return GrowthReport(run, device.renderer, axes)


def list_axes(*, quick: bool = False) -> dict[str, list[Step]]:
    """List the axes and what is measured along each; short ones if ``quick``."""
    towns = (25, 100) if quick else (100, 400, 1_600, 6_400, 25_600)
    lamps = (1, 3) if quick else (1, 2, 4, 8, 16, 32)
    sizes = (32, 64) if quick else (128, 256, 512, 1024)
    plates = (1, 4) if quick else (1, 4, 16, 64)
    boxes = 25 if quick else _BOXES
    size = 64 if quick else _SIZE
    town, side = partial(make_town_scene, boxes), find_side(boxes)
    return {
        "triangles": [
            Step(12 * n, partial(make_town_scene, n), look_down(find_side(n), size), _turn_sun)
            for n in towns
        ],
        "lights": [
            Step(n, town, look_down(side, size), partial(_move_lamps, n, side)) for n in lamps
        ],
        "pixels": [Step(n * n, town, look_down(side, n), _turn_sun) for n in sizes],
        "stacked volumes": [
            Step(n, partial(make_stack, n), look_down(20.0, size), _turn_sun) for n in plates
        ],
    }


def find_side(boxes: int) -> float:
    """Return the side of a town of so many boxes [m]."""
    return _PLOT * float(np.sqrt(boxes))


def make_town_scene(boxes: int) -> Scene:
    """Make a town of boxes, all in one part."""
    model = make_town(boxes, find_side(boxes), 1)
    return make_scene([Part("town", "", Mesh(model.vertices, model.faces))])


def make_stack(plates: int) -> Scene:
    """Make plates one above the other: the ground below lies in the volumes of all of them."""
    heights = 2.0 + 8.0 * np.arange(plates) / plates
    centres = np.column_stack([np.full((plates, 2), 10.0), heights])
    half = np.tile([5.0, 5.0, 0.02], (plates, 1))
    return make_scene([Part("plates", "", Mesh(*make_boxes(centres, half)))])


def look_down(side: float, size: int) -> Camera:
    """Make a view of a square from above one of its sides."""
    middle = side / 2
    eye, target = np.array([middle, -0.3 * side, 0.5 * side]), np.array([middle, middle, 0.0])
    return Camera(eye, target, size=(size, size))


def _turn_sun(frame: int) -> list[Light]:
    angle = 0.6 + 1e-3 * frame
    return [directional_light((np.cos(angle), np.sin(angle), 1.2))]


def _move_lamps(count: int, side: float, frame: int) -> list[Light]:
    random = np.random.default_rng(5)
    places = random.uniform(0.2, 0.8, (count, 2)) * side + 0.05 * frame
    heights = random.uniform(42.0, 60.0, count)
    return [point_light((x, y, z)) for (x, y), z in zip(places, heights, strict=True)]


def _measure(device: Device, step: Step, repeat: int) -> tuple[Timing, Timing]:
    """Measure calls and frames of one step, after frames that do not count."""
    with SceneRenderer(step.scene(), 0.0, device=device) as renderer:

        def draw(numbers: Iterator[int]) -> float:
            begun = time.process_time()
            renderer.draw(step.camera, step.lights(next(numbers)))
            device.gl.Finish()
            return time.process_time() - begun

        numbers = iter(range(10_000))
        draw(numbers)
        with drawing_nothing(device):
            draw(numbers)
            calls = [draw(numbers) for _ in range(repeat)]
        frames = [draw(numbers) for _ in range(repeat)]
    return Timing.of(calls), Timing.of(frames)
