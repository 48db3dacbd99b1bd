"""Our side of the frames on the gl device: what a peer does, in this process."""

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

from umbra.gl.context import Device, open_device
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Camera, Scene, point_light
from umbra.scene.mesh import Mesh, Part
from umbra_benchmarks.measure import Spent
from umbra_benchmarks.scenes import Spheres

__all__ = ["OursGl", "drawing_nothing", "make_part_scene"]

_FILLS = ("BlitFramebuffer", "Clear", "ClearBufferfv", "ClearBufferiv")
_STEP = 0.01
"""How far the eye moves from frame to frame where it does [m]."""
Place = Sequence[float]


def make_part_scene(scene: Spheres) -> Scene:
    """Make parts of the spheres, all of one mesh, and of the ground, which is the last."""
    normals = (scene.vertices / scene.radius).astype(np.float32)
    ball = Mesh(scene.vertices, scene.faces, normals)
    parts = []
    for number, centre in enumerate(scene.centres):
        transform = np.eye(4)
        transform[:3, 3] = centre
        parts.append(Part(f"sphere {number}", "ball", ball, transform))
    half = scene.half
    corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
    plane = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    parts.append(Part("ground", "plane", plane))
    return Scene(tuple(parts), np.zeros(3))


class OursGl:
    """
    The spheres on umbra's gl device.

    Parameters
    ----------
    scene : Spheres
    size : int
        Pixels a side.

    Attributes
    ----------
    driver : str
        What draws.
    is_software : bool

    Raises
    ------
    UmbraError
        If there is no OpenGL here.
    """

    def __init__(self, scene: Spheres, size: int) -> None:
        self._device = open_device()
        self.driver, self.is_software = self._device.renderer, self._device.is_software
        casters = range(len(scene.centres))
        self._renderer = SceneRenderer(make_part_scene(scene), casters=casters, device=self._device)
        eye, target = np.array(scene.eye), np.array(scene.target)
        self._camera = Camera(eye, target, size=(size, size), fov=scene.fov)

    def render(self, light: Place, *, shadows: bool = True, step: float = 0.0) -> None:
        """Ask for a frame with the lamp at a place and the eye a step [m] aside; it may be late."""
        camera = replace(self._camera, eye=self._camera.eye + [step, 0.0, 0.0])
        self._renderer.draw(camera, [point_light(light)], shadows=shadows)

    def finish(self) -> None:
        """Wait until all that was asked for is drawn."""
        self._device.gl.Finish()

    def time(
        self, lights: Sequence[Place], *, shadows: bool = True, moves_eye: bool = False
    ) -> Spent:
        """
        Draw a frame for each place of the lamp, each finished before the next.

        With ``moves_eye`` each frame is seen from another place, so that nothing seen is kept.

        Returns
        -------
        spent : Spent
            On one frame, the mean.
        """
        begun, busy = time.perf_counter(), time.process_time()
        for number, light in enumerate(lights, 1):
            self.render(light, shadows=shadows, step=_STEP * number * moves_eye)
            self.finish()
        wall, busy = time.perf_counter() - begun, time.process_time() - busy
        return Spent(wall / len(lights), busy / len(lights))

    def time_calls(self, lights: Sequence[Place]) -> Spent:
        """
        Do what a frame does but draw: find volumes, upload, set state; no clear, no triangle.

        Returns
        -------
        spent : Spent
            On one frame after the first, the mean.
        """
        with drawing_nothing(self._device):
            self.render(lights[0])
            begun, busy = time.perf_counter(), time.process_time()
            for light in lights[1:]:
                self.render(light)
            wall, busy = time.perf_counter() - begun, time.process_time() - busy
        self.finish()
        return Spent(wall / (len(lights) - 1), busy / (len(lights) - 1))

    def save(self, light: Place, path: Path) -> None:
        """Draw a frame into a PNG file."""
        from matplotlib.image import imsave  # noqa: PLC0415

        self.render(light)
        imsave(path, self._renderer.read())

    def close(self) -> None:
        """Free all that is on the device."""
        self._renderer.release()
        self._device.release()

    def __enter__(self) -> "OursGl":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@contextmanager
def drawing_nothing(device: Device) -> Iterator[None]:
    """Let a device do all that a frame asks for but draw: no triangle, no clear."""
    from moderngl import VertexArray  # noqa: PLC0415

    with ExitStack() as stack:
        stack.enter_context(patch.object(VertexArray, "render", _do_nothing))
        for name in _FILLS:
            stack.enter_context(patch.object(device.gl, name, _do_nothing))
        yield


def _do_nothing(*_: object, **__: object) -> None:
    pass
