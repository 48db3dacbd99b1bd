"""Frames with hard and with soft shadows on OpenGL, in turn."""

import time

import numpy as np

from umbra.errors import UmbraError
from umbra.scene import Camera, Scene
from umbra.soft import AreaLight

__all__ = ["FRAMES", "find_device_name", "time_frames"]

FRAMES = ("hard", "samples", "wedges", "complexity", "weng")
"""What is timed, by its shadows."""


def find_device_name() -> str | None:
    """Name the device that draws; None if there is no OpenGL here."""
    try:
        from umbra.gl.context import open_device  # noqa: PLC0415

        with open_device() as device:
            return str(device.renderer)
    except (ImportError, UmbraError):
        return None


def time_frames(
    scene: Scene,
    camera: Camera,
    light: AreaLight,
    *,
    samples: int,
    length: float,
    gap: float,
    repeat: int,
) -> dict[str, float]:
    """
    Time whole frames of a scene at rest over the ground z = 0.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    light : AreaLight
    samples : int
        Points that stand for the light.
    length, gap : float
        Of scaled layers.
    repeat : int
        Frames of each kind, but one of samples, in turn.

    Returns
    -------
    seconds : dict of float
        Median time of each of ``FRAMES`` [s].
    """
    from umbra.gl.scene_renderer import SceneRenderer  # noqa: PLC0415
    from umbra.methods import Softness  # noqa: PLC0415

    softness = Softness(samples=samples, length=length, gap=gap)
    taken: dict[str, list[float]] = {name: [] for name in FRAMES}
    with SceneRenderer(scene, 0.0, softness=softness) as renderer:
        for turn in range(repeat + 1):
            for name in FRAMES:
                if name == "samples" and turn > 1:
                    continue
                lights = [light.light if name == "hard" else light]
                begun = time.perf_counter()
                renderer.draw(camera, lights, soft="samples" if name == "hard" else name)
                renderer.device.gl.Finish()
                taken[name].append(time.perf_counter() - begun)
    # The first of each finds silhouettes and compiles.
    return {name: float(np.median(times[1:])) for name, times in taken.items()}
