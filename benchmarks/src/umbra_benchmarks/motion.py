"""
What a frame costs while things move: many casters, many lamps, instances, a mesh that bends.

Each row is a scene in which something moves at every frame. *Calls* are the work of a frame
on the processor before anything is drawn (volumes, uploads, state), measured with all drawing
left out; *move* is what it takes to give the renderer the scene's next pose; *frame* is all
of it, drawn and finished.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device, open_device
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Camera, Light, Scene, directional_light, make_scene, point_light
from umbra.scene.lights import spot_light
from umbra.scene.mesh import Mesh, Part
from umbra_benchmarks.growth import find_side, look_down
from umbra_benchmarks.measure import Timing
from umbra_benchmarks.ours_gl import drawing_nothing
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
    show_timing,
)
from umbra_benchmarks.scenes import make_boulder, make_town

__all__ = ["Motion", "MotionReport", "MotionRow", "bench_motion", "list_motions", "make_rocks"]

_SIZE = (512, 512)
_look_from_air = partial(look_down, size=_SIZE[0])


@dataclass(frozen=True)
class Motion:
    """
    A scene and what moves in it.

    Parameters
    ----------
    work : str
    make : callable
        Makes the scene.
    camera : Camera
    light : callable
        Gives the lights of a frame from its number.
    pose : callable, optional
        Gives the scene of a frame from the first scene and the frame's number.
    calls_mark, move_mark : float, optional
        What calls, and moves, should take at most [s].
    """

    work: str
    make: Callable[[], Scene]
    camera: Camera
    light: Callable[[int], list[Light]]
    pose: Callable[[Scene, int], Scene] | None = None
    calls_mark: float | None = None
    move_mark: float | None = None


@dataclass(frozen=True)
class MotionRow:
    """
    What one motion took.

    Parameters
    ----------
    motion : Motion
    triangles : int
    move, calls, frame : Timing
        Processor time of each frame [s].
    volumes : int
        Shells of which volumes were drawn, of all lights.
    """

    motion: Motion
    triangles: int
    move: Timing | None
    calls: Timing
    frame: Timing
    volumes: int

    def to_dict(self) -> dict[str, Any]:
        """Return numbers for programs; times in ms."""
        found: dict[str, Any] = {
            "work": self.motion.work,
            "triangles": self.triangles,
            "volumes": self.volumes,
            "calls_mark_ms": _in_ms(self.motion.calls_mark),
            "move_mark_ms": _in_ms(self.motion.move_mark),
        }
        for name, timing in (("move", self.move), ("calls", self.calls), ("frame", self.frame)):
            found[f"{name}_ms"] = None if timing is None else 1e3 * timing.median
            found[f"{name}_min_ms"] = None if timing is None else 1e3 * timing.least
        return found


@dataclass(frozen=True)
class MotionReport(BenchmarkReport):
    """The benchmark's result."""

    driver: str
    rows: Sequence[MotionRow]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        rows = [row.to_dict() for row in self.rows]
        return self.head("motion", driver=self.driver, rows=rows)

    def to_table(self) -> str:
        """Return a Markdown table that can be read as it stands."""
        head = ["work", "triangles", "volumes", "move ms (min)", "mark", "calls ms (min)", "mark",
                "frame ms (min)"]  # fmt: skip
        lines = [
            [
                row.motion.work,
                f"{row.triangles:,}",
                f"{row.volumes:,}",
                "" if row.move is None else show_timing(row.move),
                _show_mark(row.motion.move_mark),
                show_timing(row.calls),
                _show_mark(row.motion.calls_mark),
                show_timing(row.frame),
            ]
            for row in self.rows
        ]
        return (
            f"umbra bench motion: {self.machine}; {self.driver}. Processor time of a frame, "
            f"medians of {self.run.repeat}.{self.small}\n\n{lay_out_table(head, lines)}"
        )


def _in_ms(seconds: float | None) -> float | None:
    return None if seconds is None else 1e3 * seconds


def _show_mark(seconds: float | None) -> str:
    return "" if seconds is None else f"{1e3 * seconds:g}"


def bench_motion(run: BenchmarkRun) -> MotionReport:
    """
    Measure frames in which something moves.

    Raises
    ------
    UmbraError
        If there is no OpenGL.
    """
    rows = []
    with open_device() as device:
        for motion in list_motions(quick=run.quick):
            run.say(motion.work)
            rows.append(measure(device, motion, run.repeat))
        return MotionReport(run, device.renderer, rows)


def list_motions(*, quick: bool = False) -> list[Motion]:
    """List what is measured; with few casters if ``quick``."""
    small, large = (100, 400) if quick else (8_333, 83_333)
    side, wide = find_side(small), find_side(large)
    air, street = _look_from_air(side), _look_along_street(wide)
    lamps = 4 if quick else 64
    town, city = partial(_make_town, small), partial(_make_town, large)
    rocks, houses = (20, 25) if quick else (1000, 900)
    block, block_side = partial(_make_town, houses), find_side(houses)
    over_block = _look_from_air(block_side)
    splits = 2 if quick else 6
    return [
        Motion(f"town of {small:,} boxes, sun", town, air, _turn_sun, calls_mark=6e-3),
        Motion(f"town of {large:,} boxes from the street, sun", city, street, _turn_sun,
               calls_mark=40e-3),
        Motion(f"town of {large:,} boxes from the air, sun", city, _look_from_air(wide), _turn_sun,
               calls_mark=40e-3),
        Motion(f"town of {large:,} boxes, lamp of 1 m", city, _look_from_air(wide),
               partial(_move_lamps, 1, wide, 1.0), calls_mark=2e-3),
        Motion(f"town of {houses} boxes, 5 degree spot", block, over_block,
               partial(_swing_spot, block_side)),
        Motion(f"town of {houses} boxes, {lamps} lamps", block, over_block,
               partial(_move_lamps, lamps, block_side, np.inf), calls_mark=30e-3),
        Motion(f"town of {houses} boxes, {lamps} lamps of 5 m", block, over_block,
               partial(_move_lamps, lamps, block_side, 5.0), calls_mark=10e-3),
        Motion(f"town of {small:,} boxes, {lamps} lamps", town, air,
               partial(_move_lamps, lamps, side, np.inf)),
        Motion(f"town of {small:,} boxes, {lamps} lamps of 5 m", town, air,
               partial(_move_lamps, lamps, side, 5.0)),
        Motion(f"{rocks:,} instances that turn, sun", partial(make_rocks, rocks),
               _look_from_air(10.0 * np.sqrt(rocks)), _fix_sun, pose=_turn_instances,
               calls_mark=40e-3),
        Motion("mesh that bends, sun", partial(_make_rock, splits),
               _look_from_air(500.0), _fix_sun,
               pose=_bend, calls_mark=15e-3, move_mark=10e-3),
    ]  # fmt: skip


def _look_along_street(side: float) -> Camera:
    middle = side / 2
    eye, target = np.array([middle, middle - 1.0, 1.7]), np.array([middle, side, 10.0])
    return Camera(eye, target, size=_SIZE)


def _turn_sun(frame: int) -> list[Light]:
    angle = 0.6 + 1e-3 * frame
    return [directional_light((np.cos(angle), np.sin(angle), 0.8))]


def _fix_sun(_frame: int) -> list[Light]:
    return _turn_sun(0)


def _move_lamps(count: int, side: float, reach: float, frame: int) -> list[Light]:
    """Let lamps at the height of lanterns wander over the town."""
    random = np.random.default_rng(5)
    places = random.uniform(0.2, 0.8, (count, 2)) * side
    ways = random.normal(size=(count, 2))
    heights = random.uniform(2.0, 50.0, count)
    at = places + 0.05 * frame * ways
    return [
        replace(point_light((x, y, z)), range=reach) for (x, y), z in zip(at, heights, strict=True)
    ]


def _swing_spot(side: float, frame: int) -> list[Light]:
    middle = side / 2
    target = middle + 5.0 * np.cos(0.05 * frame), middle + 5.0 * np.sin(0.05 * frame), 0.0
    return [spot_light((middle, middle, 120.0), target, half_angle=5.0)]


def _make_town(boxes: int) -> Scene:
    side = find_side(boxes)
    model = make_town(boxes, side, 1)
    return make_scene([Part("town", "", Mesh(model.vertices, model.faces)), _make_ground(side)])


def _make_ground(side: float) -> Part:
    low, high = -side, 2 * side
    corners = [[low, low, -1.5], [high, low, -1.5], [high, high, -1.5], [low, high, -1.5]]
    return Part("ground", "plane", Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]])))


def _make_ball() -> Mesh:
    """Make a small rock of 1,280 triangles about the origin."""
    model = make_boulder(3, side=10.0)
    return Mesh(model.vertices - model.vertices.mean(0), model.faces)


def make_rocks(count: int) -> Scene:
    """Make instances of a rock of 1,280 triangles, 10 m apart, and the ground below."""
    ball = _make_ball()
    parts = [Part(f"rock {k}", "", ball, _place(count, k, 0)) for k in range(count)]
    return make_scene([*parts, _make_ground(10.0 * np.sqrt(count))])


def _place(count: int, number: int, frame: int) -> NDArray[np.float64]:
    across = int(np.ceil(np.sqrt(count)))
    angle = 0.02 * frame + number
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = 10.0 * (number % across), 10.0 * (number // across), 3.0 + np.sin(angle)
    return matrix


def _turn_instances(scene: Scene, frame: int) -> Scene:
    count = len(scene.parts) - 1
    moved = [replace(p, transform=_place(count, k, frame)) for k, p in enumerate(scene.parts[:-1])]
    return replace(scene, parts=(*moved, scene.parts[-1]))


def _make_rock(splits: int) -> Scene:
    model = make_boulder(splits)
    normals = (model.vertices - model.vertices.mean(0)).astype(np.float32)
    rock = Part("rock", "", Mesh(model.vertices, model.faces, normals))
    return make_scene([rock, _make_ground(model.side)])


def _bend(scene: Scene, frame: int) -> Scene:
    rock = scene.parts[0]
    vertices = rock.mesh.vertices.copy()
    vertices[:, 0] += 10.0 * np.sin(0.02 * vertices[:, 2] + 0.1 * frame)
    bent = replace(rock, mesh=replace(rock.mesh, vertices=vertices))
    return replace(scene, parts=(bent, *scene.parts[1:]))


def measure(device: Device, motion: Motion, repeat: int) -> MotionRow:
    """Measure the frames of one motion, after some that do not count."""
    scene = motion.make()
    casters = range(len(scene.parts) - 1)
    moves: list[float] = []
    calls: list[float] = []
    frames: list[float] = []
    with SceneRenderer(scene, casters=casters, device=device) as renderer:

        def show(number: int) -> tuple[float, float]:
            """Draw a frame; return the processor time of its move and of the rest [s]."""
            posed = scene if motion.pose is None else motion.pose(scene, number)
            lights = motion.light(number)
            begun = time.process_time()
            if motion.pose is not None:
                renderer.move(posed)
            moved = time.process_time()
            renderer.draw(motion.camera, lights)
            return moved - begun, time.process_time() - moved

        warm = 2
        show(0)
        device.gl.Finish()
        with drawing_nothing(device):
            for number in range(1, 1 + warm + repeat):
                move, rest = show(number)
                if number > warm:
                    moves.append(move)
                    calls.append(rest)
        device.gl.Finish()
        for number in range(1 + warm + repeat, 1 + warm + 2 * repeat):
            begun = time.process_time()
            show(number)
            device.gl.Finish()
            frames.append(time.process_time() - begun)
        volumes = sum(s.shells - s.culled for s in renderer.statistics)
    return MotionRow(
        motion,
        scene.triangles().faces.shape[0],
        Timing.of(moves) if motion.pose is not None else None,
        Timing.of(calls),
        Timing.of(frames),
        volumes,
    )
