"""Frames on OpenGL by McGuire's method, Lengyel's, z-fail and z-pass, over scenes and views."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.gl.context import open_device
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.selection import VolumeOptions
from umbra.scene import Camera, Light, Mesh, Part, Scene, make_scene, point_light
from umbra_benchmarks.cases import CAMERAS, LAMP
from umbra_benchmarks.measure import Timing, run_in_turn, timed
from umbra_benchmarks.ours_gl import make_part_scene
from umbra_benchmarks.report import BenchmarkRun
from umbra_benchmarks.scenes import make_boulder, make_boxes, make_spheres

__all__ = ["CONTENDERS", "Viewed", "draw_views"]

_FRAMES = 4  # a turn, with the lamps elsewhere in each
_PUBLISHED = VolumeOptions(cut=False)
_EARLIER = VolumeOptions(cull=False, cut=False, fans=False)

CONTENDERS: dict[str, tuple[str, VolumeOptions]] = {
    "mcguire": ("mcguire", _PUBLISHED),
    "lengyel": ("lengyel", _EARLIER),
    "z-fail": ("z-fail", VolumeOptions(cull=False, cut=False, fans=False, narrow=False)),
    "z-pass": ("z-pass", VolumeOptions(cull=False, cut=False, fans=False, narrow=False)),
    "mcguire, cut": ("mcguire", VolumeOptions()),
    "lengyel, cut": ("lengyel", VolumeOptions()),
}
"""
As published: McGuire's choice with his culling, Lengyel's choice within a light's scissor, all
volumes by z-fail (Everitt and Kilgard), sides alone by z-pass (Heidmann). Cut: with all that
umbra leaves out, for both alike.
"""


@dataclass(frozen=True)
class Viewed:
    """
    One view of a scene.

    Parameters
    ----------
    scene, view : str
    faces, points : int
        Triangles that cast; points of all casters, instances apart.
    cases : (int, int, int)
        Casters in view of case 1, 2 and 3, over all lights.
    times : dict of Timing
        By contender: of a frame; ``processor`` of the one that kept processors busy least.
    triangles : dict of int
        By contender: of the last frame's volumes.
    n_bytes : dict of int
        By contender: of their indices.
    """

    scene: str
    view: str
    faces: int
    points: int
    cases: tuple[int, int, int]
    times: dict[str, Timing]
    triangles: dict[str, int]
    n_bytes: dict[str, int]

    def ratio(self, other: str, ours: str = "mcguire") -> float:
        """How many times as long another contender's fastest frame takes."""
        return self.times[other].least / self.times[ours].least

    def processor_ratio(self, other: str, ours: str = "mcguire") -> float:
        """How many times as long it keeps processors busy; tells nothing of a GPU."""
        return (self.times[other].processor or np.nan) / (self.times[ours].processor or np.nan)


View = tuple[str, Camera, list[list[Light]]]
"""What it shows, from where, and the lights of each frame."""


def draw_views(run: BenchmarkRun) -> tuple[str, bool, list[Viewed]]:
    """
    Draw each view by all contenders in turn.

    Returns
    -------
    driver : str
        What drew.
    is_software : bool
    viewed : list of Viewed

    Raises
    ------
    UmbraError
        If there is no OpenGL.
    """
    device = open_device()
    size = 64 if run.quick else 512
    try:
        viewed = []
        for name, scene, casters, views in (
            _make_hall(2 if run.quick else 4),
            _make_balls(3 if run.quick else 10),
            _make_boulder(3 if run.quick else 5),
        ):
            run.say(f"{name}, {size}²")
            ground = 0.0 if casters is None else None  # the spheres bring their own
            with SceneRenderer(scene, ground, casters=casters, device=device) as renderer:
                for view in views:
                    viewed.append(_measure(renderer, name, view, size, run.repeat))
        return device.renderer, device.is_software, viewed
    finally:
        device.release()


def _measure(renderer: SceneRenderer, name: str, view: View, size: int, repeat: int) -> Viewed:
    what, camera, lights = view
    camera = Camera(camera.eye, camera.target, size=(size, size), fov=camera.fov, near=camera.near)
    triangles, n_bytes = {}, {}
    busy: dict[str, list[float]] = {each: [] for each in CONTENDERS}

    def draw(contender: str) -> None:
        method, renderer.choices = CONTENDERS[contender]
        begun = time.process_time()
        for some in lights:
            renderer.draw(camera, some, method)
            renderer.device.gl.Finish()
        busy[contender].append(time.process_time() - begun)
        found = renderer.statistics
        triangles[contender] = sum(s.sides + s.dark_caps + s.light_caps for s in found)
        n_bytes[contender] = sum(s.index_bytes for s in found)

    contenders = {each: timed(partial(draw, each)) for each in CONTENDERS}
    n = len(lights)
    times = {
        each: Timing(found.median / n, found.least / n, min(busy[each]) / n)
        for each, found in run_in_turn(contenders, repeat).items()
    }
    draw("mcguire")
    cases = np.sum([statistics.cases for statistics in renderer.statistics], 0)
    bodies = renderer.planner.bodies
    return Viewed(
        scene=name,
        view=what,
        faces=sum(len(body.caster.faces) * len(body.groups) for body in bodies),
        points=renderer.geometry.n_points,
        cases=(int(cases[0]), int(cases[1]), int(cases[2])),
        times=times,
        triangles=triangles,
        n_bytes=n_bytes,
    )


def _make_hall(across: int) -> tuple[str, Scene, Sequence[int] | None, list[View]]:
    """Make the paper's scene: seating in a hall, cubes above it, a sphere and figures."""
    ball = make_spheres(1, 32, 1)
    parts = [
        Part("walls", "hall", _make_boxes([[0, 0, 12, 32, 32, 13]])),
        # Seen from within, so wound inward.
        Part("room", "hall", _make_boxes([[0, 0, 12, 31, 31, 12.5]], inward=True)),
    ]
    steps = [
        [side * (12 + 2 * k), 0, 0.5 + 0.5 * k, 1, 24, 0.5 + 0.5 * k]
        for side in (-1, 1)
        for k in range(8)
    ]
    parts.append(Part("seats", "hall", _make_boxes(steps)))
    cube = _make_boxes([[0, 0, 0, 0.7, 0.7, 0.7]])
    middle = (across - 1) / 2
    for i, j, k in np.ndindex(across, across, 3):
        place = ((i - middle) * 4, (j - middle) * 4, 5 + 3.5 * k)
        parts.append(Part(f"cube {i} {j} {k}", "cube", cube, _place(place)))
    sphere = Mesh(ball.vertices, ball.faces, ball.vertices.astype(np.float32))
    parts.append(Part("sphere", "ball", sphere, _place((0.0, -14.0, 3.0), (2, 2, 2))))
    for number in range(10):
        place = (-9.0 + 2 * number, 12.0 + 3 * (number % 3), 1.0)
        parts.append(Part(f"figure {number}", "figure", sphere, _place(place, (0.4, 0.4, 1))))
    turn = np.arange(_FRAMES)
    lamps = [[point_light((1.3 + 0.1 * t, 1.9, 9.8 + 0.1 * t))] for t in turn]
    dim = [
        [point_light((x, y + 0.1 * t, 4.0), range=8.0) for x, y in ((-8, 9), (0, 13), (8, 9))]
        for t in turn
    ]
    views = [
        ("from above the seats", _look((-26, -22, 20), (0, 0, 4)), lamps),
        ("behind the cubes, toward the lamp", _look((-11, -11.5, 2.5), (1, 1.5, 9)), lamps),
        ("under a cube, away from the lamp", _look((5.0, 5.5, 1.6), (10, 30, 1)), lamps),
        ("three dim lamps", _look((0, -8, 6), (0, 14, 1)), dim),
    ]
    return "hall", make_scene(parts), None, views


def _make_balls(across: int) -> tuple[str, Scene, Sequence[int] | None, list[View]]:
    """Take the hundred spheres of ``umbra bench frame``."""
    balls = make_spheres(across)
    eye, target = np.array(balls.eye), np.array(balls.target)
    lamps = [[point_light(place)] for place in balls.path[:_FRAMES]]
    highest = balls.centres[np.argmax(balls.centres[:, 2])]
    ray = (highest - balls.path[0]) / np.linalg.norm(highest - balls.path[0])
    behind = highest + 3 * ray
    views = [
        ("from above", Camera(eye, target, fov=balls.fov), lamps),
        ("behind a sphere, toward the lamp", _look(behind, behind - ray), lamps),
        ("behind a sphere, away from the lamp", _look(behind, behind + ray), lamps),
    ]
    return f"{across**2} spheres", make_part_scene(balls), range(across**2), views


def _make_boulder(splits: int) -> tuple[str, Scene, Sequence[int] | None, list[View]]:
    """Take the boulder of the cases, and their cameras."""
    model = make_boulder(splits)
    scene = make_scene([Part("boulder", "rock", Mesh(model.vertices, model.faces))])
    turn = np.arange(_FRAMES)[:, None] * [1.0, 1.0, 0.0]
    lamps = [[point_light(place)] for place in LAMP[:3] + turn]
    names = ("beside it", "in its shadow, looking on", "in its shadow, looking back")
    views = [(name, camera, lamps) for name, camera in zip(names, CAMERAS, strict=True)]
    return "boulder", scene, None, views


def _look(eye: ArrayLike, target: ArrayLike) -> Camera:
    return Camera(np.asarray(eye, float), np.asarray(target, float), fov=60)


def _make_boxes(boxes: Sequence[Sequence[float]], *, inward: bool = False) -> Mesh:
    """Make boxes of a middle and half sizes each."""
    middle, half = np.hsplit(np.array(boxes, float), 2)
    vertices, faces = make_boxes(middle, half)
    return Mesh(vertices, faces[:, ::-1].copy() if inward else faces)


def _place(middle: Sequence[float], size: Sequence[float] = (1, 1, 1)) -> NDArray[np.float64]:
    place = np.diag([*size, 1.0])
    place[:3, 3] = middle
    return place
