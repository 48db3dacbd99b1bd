"""The tables of Roettger, Irion and Ertl (2002): masks in screen, alpha, stencil, and small."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from umbra.gl.context import Device, open_device
from umbra.gl.masks import MASKS, PRINTED, Method
from umbra.gl.masks.mask_frames import MaskPicture
from umbra.scene import Camera, Material, Mesh, Part, Scene, make_scene, point_light
from umbra_benchmarks.measure import Timing, run_in_turn, timed
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
)
from umbra_benchmarks.roettger_pictures import draw_figure_3
from umbra_benchmarks.scenes import make_town

__all__ = ["Roettger", "bench_roettger"]

_SIZES = (256, 512, 1024)
_FRAMES = 4  # of a turn, each with the lamp elsewhere

_HALF = 70.0  # of the square on which the blocks stand [m]
_BRICK, _STONE = (0.7, 0.45, 0.35), (0.5, 0.5, 0.55)
_TURN = 2 * np.pi * np.arange(_FRAMES) / _FRAMES
_LAMPS = np.stack(
    [_HALF * (1 + 0.3 * np.cos(_TURN)), _HALF * (1 + 0.3 * np.sin(_TURN)), 0 * _TURN + 45.0], 1
)

# Frames per second on a GeForce 2 MX (Table 2; the last is from the text).
_PAPER: dict[str, dict[int, float]] = {
    "screen": {256: 40.8, 512: 29.9, 1024: 9.3},
    "alpha": {256: 42.4, 512: 33.6, 1024: 10.2},
    "stencil": {256: 42.4, 512: 29.1, 1024: 8.9},
    "alpha 1/2": {256: 39.1, 512: 30.5, 1024: 15.7},
    "alpha 1/4": {1024: 23.6},
    "none": {256: 90.4, 512: 89.2, 1024: 44.6},
}
# Passes and rectangles (Table 1; in brackets there, by the maximum equation).
_TABLE_1 = {
    "alpha": ((2, 4), (1, 4)),
    "alpha by maximum": ((2, 4), (1, 2)),
    "screen": ((3, 3), (2, 3)),
    "screen by maximum": ((3, 3), (2, 1)),
}
_OF_TABLE_1: dict[str, Method] = {
    "alpha": PRINTED,
    "alpha by maximum": MASKS["max"],
    "screen": replace(PRINTED, name="screen, fronts first", write="rgb"),
    "screen by maximum": replace(MASKS["max"], name="screen, max", write="rgb"),
}
_OURS: dict[str, tuple[Method | str, int, str | None]] = {
    "screen": (_OF_TABLE_1["screen"], 1, "attenuated"),
    "alpha": (PRINTED, 1, "attenuated"),
    "alpha, backs first": ("alpha", 1, "attenuated"),
    "max": ("max", 1, "attenuated"),
    "half float": ("half", 1, "attenuated"),
    "stencil": ("stencil", 1, "attenuated"),
    "alpha 1/2": (PRINTED, 2, "attenuated"),
    "alpha 1/4": (PRINTED, 4, "attenuated"),
    "none": ("stencil", 1, None),
}


@dataclass(frozen=True)
class Roettger(BenchmarkReport):
    """
    Both tables as measured.

    Parameters
    ----------
    driver : str
        What drew.
    scene : str
    issued : dict
        By column of Table 1: passes and rectangles with an ambient term, and attenuated.
    times : dict
        By pixels a side and column of Table 2: of one frame.
    """

    driver: str
    scene: str
    issued: Mapping[str, tuple[tuple[int, int], tuple[int, int]]]
    times: Mapping[int, Mapping[str, Timing]]

    def ratio(self, size: int, column: str) -> float:
        """How many times as many frames as by the stencil."""
        return self.times[size]["stencil"].median / self.times[size][column].median

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        return self.head("roettger", driver=self.driver, scene=self.scene) | {
            "table_1": [
                {
                    "mask": name,
                    "ambient": list(ambient),
                    "attenuated": list(attenuated),
                    "paper_ambient": list(_TABLE_1[name][0]),
                    "paper_attenuated": list(_TABLE_1[name][1]),
                }
                for name, (ambient, attenuated) in self.issued.items()
            ],
            "table_2": [
                {
                    "size": size,
                    "mask": name,
                    "frames_per_second": 1 / timing.median,
                    **timing.to_ms(),
                    "to_stencil": self.ratio(size, name),
                    "paper_frames_per_second": _find_paper(size, name),
                    "paper_to_stencil": _find_paper_ratio(size, name),
                }
                for size, row in self.times.items()
                for name, timing in row.items()
            ],
        }

    def to_table(self) -> str:
        """Return Markdown tables that can be read as they stand."""
        first = lay_out_table(
            ["mask", "ambient", "paper", "attenuated", "paper"],
            [
                [name, *(f"{a}/{b}" for a, b in _weave(issued, _TABLE_1[name]))]
                for name, issued in self.issued.items()
            ],
        )
        second = lay_out_table(
            ["window", "mask", "frames/s", "to stencil", "paper's frames/s", "paper's to stencil"],
            [
                [
                    f"{size}²",
                    name,
                    f"{1 / timing.median:.1f}",
                    f"{self.ratio(size, name):.2f}",
                    _show(_find_paper(size, name), 1),
                    _show(_find_paper_ratio(size, name), 2),
                ]
                for size, row in self.times.items()
                for name, timing in row.items()
            ],
        )
        return (
            f"umbra bench roettger: {self.machine}, {self.driver}. {self.scene}; medians of "
            f"{self.run.repeat} turns of {_FRAMES} frames.{self.small}\n\n"
            f"Passes / rectangles issued (Table 1):\n\n{first}\n\n"
            f"Frames per second (Table 2), shadows attenuated:\n\n{second}"
        )


def bench_roettger(run: BenchmarkRun) -> Roettger:
    """
    Measure masks in turn, and count what they issue.

    A lamp goes around among blocks, so that shadow volumes fill the window many times over,
    and the viewer may be inside one.

    Raises
    ------
    UmbraError
        If there is no OpenGL.
    """
    blocks = 9 if run.quick else 49
    scene = _make_scene(blocks)
    sizes = (64,) if run.quick else _SIZES
    device = open_device()
    try:
        run.say("Table 1")
        issued = {name: _issue(device, scene, name) for name in _OF_TABLE_1}
        times = {}
        for size in sizes:
            run.say(f"Table 2, {size}²")
            times[size] = _measure(device, scene, size, run.repeat)
        if run.pictures is not None:
            run.pictures.mkdir(parents=True, exist_ok=True)
            draw_figure_3((240, 180)).save(run.pictures / "roettger_figure_3.png")
        shape = f"{blocks} blocks and a lamp among them"
        return Roettger(run, device.renderer, shape, issued, times)
    finally:
        device.release()


def _issue(device: Device, scene: Scene, name: str) -> tuple[tuple[int, int], tuple[int, int]]:
    """Draw two small pictures and give what they took."""
    found = []
    with _open(device, scene, _OF_TABLE_1[name], 1) as picture:
        for shadows in ("ambient", "attenuated"):
            picture.draw(_look(32), point_light(_LAMPS[0]), shadows)
            found.append(picture.tally.table)
    return found[0], found[1]


def _measure(device: Device, scene: Scene, size: int, repeat: int) -> dict[str, Timing]:
    """Time one frame by each mask, in turn."""
    camera = _look(size)
    with ExitStack() as stack:
        contenders = {}
        for name, (method, scale, shadows) in _OURS.items():
            picture = stack.enter_context(_open(device, scene, method, scale))
            contenders[name] = timed(_make_turn(device, picture, camera, shadows))
        return {
            name: timing.divide(_FRAMES) for name, timing in run_in_turn(contenders, repeat).items()
        }


def _make_turn(
    device: Device,
    picture: MaskPicture,
    camera: Camera,
    shadows: str | None,
) -> Callable[[], None]:
    def run() -> None:
        for lamp in _LAMPS:
            picture.draw(camera, point_light(lamp), shadows)
            device.gl.Finish()

    return run


def _open(device: Device, scene: Scene, method: Method | str, scale: int) -> MaskPicture:
    return MaskPicture(scene, method, casters=[0], scale=scale, device=device)


def _make_scene(blocks: int) -> Scene:
    """Make a town of blocks on a floor, all within the same square."""
    town = make_town(blocks, 2 * _HALF, 4)
    corners = _HALF * np.array([[-1, -1, 0], [3, -1, 0], [3, 3, 0], [-1, 3, 0]], float)
    floor = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    return make_scene(
        [
            Part("town", "block", Mesh(town.vertices, town.faces), material=Material(_BRICK)),
            Part("floor", "floor", floor, material=Material(_STONE)),
        ]
    )


def _look(size: int) -> Camera:
    eye, target = np.array([-0.5, -0.7, 0.7]), np.array([1.0, 1.0, 0.0])
    return Camera(_HALF * eye, _HALF * target, size=(size, size))


def _find_paper(size: int, name: str) -> float | None:
    return _PAPER.get(name, {}).get(size)


def _find_paper_ratio(size: int, name: str) -> float | None:
    found = _find_paper(size, name)
    return None if found is None else found / _PAPER["stencil"][size]


def _weave(ours: Sequence[tuple[int, int]], paper: Sequence[tuple[int, int]]) -> list:
    return [pair for both in zip(ours, paper, strict=True) for pair in both]


def _show(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
