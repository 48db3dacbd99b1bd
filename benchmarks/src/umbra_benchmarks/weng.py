"""
Soft shadows over polygon counts, lengths and gaps, as in Weng's figures 15 to 18.

Errors are those against depth complexity at 1,024 spots of the lamp, which rays confirm to 0.001
(`umbra bench soft`); 1,024 samples are off by 0.003 themselves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from umbra.cpu.frame import FrameCounter
from umbra.methods import Softness
from umbra.rays.depth import GROUND
from umbra.scene import Camera, Mesh, Part, Scene, make_scene, point_light
from umbra.soft import ball_light, complexity, light_samples, wedges, weng
from umbra.volume.silhouette import find_silhouette_edges
from umbra_benchmarks.measure import repeat_work
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
)
from umbra_benchmarks.scenes import make_ball, make_boxes
from umbra_benchmarks.soft_gl import find_device_name, time_frames
from umbra_benchmarks.weng_pictures import draw_figure_16

__all__ = ["PAPER", "Errors", "GridCell", "Soft", "SoftRow", "bench_weng", "find_errors"]

REFERENCE = 1024
"""Samples of the light that are timed, and spots of it that the methods are measured against."""
LENGTHS, GAPS = (1.0, 2.0, 3.0, 4.0, 5.0), (0.1, 0.3, 0.5, 1.0)
"""Of figure 15's cube, in tenths of the silhouette's radius."""
LENGTH, GAP = 3.0, 0.3
"""With which the paper timed its figures 17 and 18."""
PAPER = {
    12: "60 fps; wedges a 6th (fig. 16)",
    216: "10, 640, 60 fps (fig. 17; the 2nd at 200)",
    500: "3, 50 to 60, 15 fps (fig. 17)",
    1800: "15 fps on the 3rd system (fig. 17)",
}
"""What the text says of its figures; the curves themselves are not tabulated."""
_LIGHT = ball_light(point_light((3.0, 2.0, 8.0)), 0.5)
_MIDDLE = (0.0, 0.0, 1.6)
_BALLS = {48: (8, 4), 216: (12, 10), 500: (25, 11), 1800: (36, 26), 10_000: (100, 51)}


@dataclass(frozen=True)
class Errors:
    """
    How far a visibility is from the reference, where either is neither 0 nor 1.

    Parameters
    ----------
    pixels : int
    l1, bias, rms, most : float
        Mean of the absolute and of the signed differences, root of the mean square, and
        largest; positive is too bright.
    """

    pixels: int
    l1: float
    bias: float
    rms: float
    most: float


@dataclass(frozen=True)
class SoftRow:
    """
    One caster.

    Parameters
    ----------
    faces, silhouette : int
        Triangles; edges of the silhouette.
    hard : float
        Median time of the hard count [s].
    seconds : dict
        Median time of each method [s]; of the samples' one run.
    floor, everywhere : dict
        `Errors` of each method on the floor, and with the caster's own surface.
    gl : dict
        Median time of frames on OpenGL by their shadows [s]; empty without it.
    """

    faces: int
    silhouette: int
    hard: float
    seconds: dict[str, float]
    floor: dict[str, Errors]
    everywhere: dict[str, Errors]
    gl: dict[str, float]


@dataclass(frozen=True)
class GridCell:
    """
    The cube's shadow by scaled layers of one length and gap.

    Parameters
    ----------
    length, gap : float
    layers : int
    triangles : int
        Of the volumes of all layers and the hard one.
    seconds : float
        Median time on the CPU [s].
    floor : Errors
    """

    length: float
    gap: float
    layers: int
    triangles: int
    seconds: float
    floor: Errors


@dataclass(frozen=True)
class Soft(BenchmarkReport):
    """
    Four methods over polygon counts, and one over lengths and gaps.

    Parameters
    ----------
    rows : list of SoftRow
    grid : list of GridCell
        Figure 15: length by length, each with all gaps.
    size : (int, int)
    gl_device : str, optional
        What draws with OpenGL, if there is any.
    """

    rows: list[SoftRow]
    grid: list[GridCell]
    size: tuple[int, int]
    gl_device: str | None

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        return self.head("weng", threads=self.run.threads) | {
            "size": self.size,
            "samples": REFERENCE,
            "length": LENGTH,
            "gap": GAP,
            "gl_device": self.gl_device,
            "rows": [
                {
                    "faces": row.faces,
                    "silhouette_edges": row.silhouette,
                    "hard_ms": 1e3 * row.hard,
                    **{f"{name}_ms": 1e3 * taken for name, taken in row.seconds.items()},
                    "wedges_to_weng": row.seconds["wedges"] / row.seconds["weng"],
                    "gl_ms": {name: 1e3 * taken for name, taken in row.gl.items()},
                    "floor": {name: vars(found) for name, found in row.floor.items()},
                    "everywhere": {name: vars(found) for name, found in row.everywhere.items()},
                    "paper": PAPER.get(row.faces),
                }
                for row in self.rows
            ],
            "figure_15": [{**vars(cell), "floor": vars(cell.floor)} for cell in self.grid],
        }

    def to_table(self) -> str:
        """Return a Markdown table that can be read as it stands."""
        head = [
            "faces", "silhouette", "hard ms", "samples ms", "wedges ms", "complexity ms", "Weng ms",
            "wedges / Weng", "wedges L1, bias, RMS, max", "Weng L1, bias, RMS, max",
            "hard L1, bias, RMS, max", "with the caster itself: wedges L1, Weng L1",
            "gl frames ms: hard, samples, wedges, complexity, Weng",
            "gl: wedges / Weng, Weng / hard",
            "Weng's paper",
        ]  # fmt: skip
        lines = [
            [
                f"{row.faces:,}",
                f"{row.silhouette:,}",
                f"{1e3 * row.hard:.3g}",
                f"{1e3 * row.seconds['samples']:,.0f}",
                f"{1e3 * row.seconds['wedges']:.3g}",
                f"{1e3 * row.seconds['complexity']:.3g}",
                f"{1e3 * row.seconds['weng']:.3g}",
                f"{row.seconds['wedges'] / row.seconds['weng']:.2f}",
                *(_show(row.floor[name]) for name in ("wedges", "weng", "hard")),
                f"{row.everywhere['wedges'].l1:.3f}, {row.everywhere['weng'].l1:.3f}",
                ", ".join(f"{1e3 * row.gl[name]:,.1f}" for name in row.gl),
                _compare(row.gl) if row.gl else "",
                PAPER.get(row.faces, ""),
            ]
            for row in self.rows
        ]
        cols, rows = self.size
        grid = [
            [
                f"{length:g}",
                *(
                    f"{cell.layers}, {cell.triangles:,}, {1e3 * cell.seconds:.3g}, "
                    f"{cell.floor.l1:.3f}, {cell.floor.most:.2f}"
                    for cell in self.grid
                    if cell.length == length
                ),
            ]
            for length in LENGTHS
        ]
        return (
            f"umbra bench weng: {self.machine}. {cols}x{rows} pixels, "
            f"{self.run.threads} threads, medians of {self.run.repeat} runs. Errors of visibility "
            f"on the floor against {REFERENCE:,} spots, where either is in penumbra; "
            f"length {LENGTH:g}, gap {GAP:g} ({round(LENGTH / GAP)} layers). "
            f"gl: {self.gl_device or 'there is no OpenGL'}.{self.small}"
            f"\n\n{lay_out_table(head, lines)}\n\n"
            "Figure 15, the cube by length (down) and gap (across): layers, triangles of all "
            "volumes, ms, L1, max.\n\n"
            + lay_out_table(["length", *(f"gap {gap:g}" for gap in GAPS)], grid)
        )


def bench_weng(run: BenchmarkRun) -> Soft:
    """Time all methods and measure their errors, for a cube and balls."""
    size = (96, 72) if run.quick else (800, 600)
    eye, target = np.array([-4.5, -6.0, 5.0]), np.array([-0.6, -0.4, 0.6])
    camera = Camera(eye, target, size=size, fov=45.0)
    rows, gl_device = [], find_device_name()
    for faces in (12, 48) if run.quick else (12, *_BALLS):
        run.say(f"{faces:,} triangles")
        rows.append(_measure(faces, camera, run.threads, run.repeat, has_gl=gl_device is not None))
    run.say("lengths and gaps")
    return Soft(run, rows, _measure_grid(camera, run), size, gl_device)


def find_errors(found: NDArray, truth: NDArray, where: NDArray[np.bool_]) -> Errors:
    """
    Compare two visibilities where either is in penumbra, see `Errors`.

    Parameters
    ----------
    found, truth : (rows, cols) float32
    where : (rows, cols) bool
        Only here.
    """
    in_penumbra = where & (((found > 0) & (found < 1)) | ((truth > 0) & (truth < 1)))
    error = (found.astype(np.float64) - truth)[in_penumbra]
    if not len(error):
        return Errors(0, 0.0, 0.0, 0.0, 0.0)
    size = np.abs(error)
    return Errors(
        len(error),
        float(size.mean()),
        float(error.mean()),
        float(np.sqrt((error**2).mean())),
        float(size.max()),
    )


def _measure_grid(camera: Camera, run: BenchmarkRun) -> list[GridCell]:
    """Draw the cube's shadow by all lengths and gaps."""
    counter = FrameCounter(_make_scene(12), ground=0.0, threads=run.threads)
    view, frame = counter.see(camera)
    seen = counter, view, frame, camera
    truth = complexity.find_visibility_by_complexity(*seen, _LIGHT, spots=REFERENCE)
    place = _LIGHT.light.local(counter.scene.origin)
    sides = 2 * len(find_silhouette_edges(counter.caster, place)[0])
    caps = 2 * int((counter.caster.planes[:, :-1].T @ place > 0).sum())
    cells, pictures = [], []
    for length in LENGTHS:
        for gap in GAPS:
            draw = partial(weng.find_visibility_by_layers, *seen, _LIGHT, length=length, gap=gap)
            found, took = repeat_work(draw, run.repeat)
            layers = Softness(length=length, gap=gap).layers
            floor = find_errors(found, truth, frame.part == GROUND)
            pictures.append(found)
            cells.append(
                GridCell(length, gap, layers, (layers + 1) * (sides + caps), took.median, floor)
            )
    if run.pictures is not None:
        run.pictures.mkdir(parents=True, exist_ok=True)
        _draw_figure_15(pictures).save(run.pictures / "weng_figure_15.png")
        size = (96, 72) if run.quick else (360, 300)
        draw_figure_16(size).save(run.pictures / "weng_figure_16.png")
    return cells


def _draw_figure_15(pictures: list[NDArray[np.float32]]) -> Image.Image:
    """Put what is seen of the lamp on one sheet, lengths down and gaps across."""
    rows, cols = pictures[0].shape
    sheet = Image.new("L", (len(GAPS) * cols, len(LENGTHS) * rows))
    pen = ImageDraw.Draw(sheet)
    for number, picture in enumerate(pictures):
        down, across = divmod(number, len(GAPS))
        corner = across * cols, down * rows
        sheet.paste(Image.fromarray(np.rint(255 * picture).astype(np.uint8)), corner)
        name = f"length {LENGTHS[down]:g}, gap {GAPS[across]:g}"
        pen.text((corner[0] + 6, corner[1] + 6), name, fill=0)
    return sheet


def _make_scene(faces: int) -> Scene:
    """Make a cube of 12 faces, or a ball."""
    vertices, triangles = (
        make_boxes([[0, 0, 0]], [[0.8] * 3]) if faces == 12 else make_ball(*_BALLS[faces])
    )
    return make_scene([Part("caster", "", Mesh(vertices + _MIDDLE, triangles))])


def _measure(faces: int, camera: Camera, threads: int, repeat: int, *, has_gl: bool) -> SoftRow:
    scene = _make_scene(faces)
    counter = FrameCounter(scene, ground=0.0, threads=threads)
    view, frame = counter.see(camera)
    seen = counter, view, frame, camera
    seconds, found = {}, {}
    works: dict[str, Callable[[], NDArray]] = {
        "hard": lambda: (counter.count(view, camera, _LIGHT.light) == 0).astype(np.float32),
        "wedges": lambda: wedges.find_visibility_by_wedges(*seen, _LIGHT),
        "complexity": lambda: complexity.find_visibility_by_complexity(*seen, _LIGHT),
        "weng": lambda: weng.find_visibility_by_layers(*seen, _LIGHT, length=LENGTH, gap=GAP),
        "samples": lambda: light_samples.find_visibility_by_samples(
            *seen, _LIGHT, samples=REFERENCE
        ),
    }
    for name, work in works.items():
        if name != "samples":
            work()  # compiles, and fills the caches
        found[name], took = repeat_work(work, 1 if name == "samples" else repeat)
        seconds[name] = took.median
    place = _LIGHT.light.local(counter.scene.origin)
    truth = complexity.find_visibility_by_complexity(*seen, _LIGHT, spots=REFERENCE)
    errors = [
        {
            name: find_errors(found[name], truth, where)
            for name in ("hard", "samples", "wedges", "complexity", "weng")
        }
        for where in (frame.part == GROUND, np.ones(frame.part.shape, np.bool_))
    ]
    frames = {}
    if has_gl:
        frames = time_frames(
            scene, camera, _LIGHT, samples=REFERENCE, length=LENGTH, gap=GAP, repeat=repeat
        )
    return SoftRow(
        faces=faces,
        silhouette=len(find_silhouette_edges(counter.caster, place)[0]),
        hard=seconds.pop("hard"),
        seconds=seconds,
        floor=errors[0],
        everywhere=errors[1],
        gl=frames,
    )


def _compare(gl: dict[str, float]) -> str:
    return f"{gl['wedges'] / gl['weng']:.2f}, {gl['weng'] / gl['hard']:.1f}"


def _show(errors: Errors) -> str:
    return f"{errors.l1:.3f}, {errors.bias:+.3f}, {errors.rms:.3f}, {errors.most:.2f}"
