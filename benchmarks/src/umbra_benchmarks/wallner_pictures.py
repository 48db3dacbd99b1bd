"""Wallner's figures 5 and 6: shadows, their volumes, and the shadow profile of some hours."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from umbra.cpu.frame import FrameCounter
from umbra.gl.context import open_device
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.state import State
from umbra.rays.depth import NOTHING
from umbra.scene import Camera, Light, Mesh, Part, Scene, directional_light, make_scene
from umbra.sun import Site, find_sun, make_steps
from umbra.window.overlays import Overlays
from umbra_benchmarks.scenes import SquareModel, make_town
from umbra_benchmarks.towers import make_lattice_tower

__all__ = ["draw_figure_5", "draw_figure_6"]

_LIGHTEST, _DARKEST = np.array([250.0, 248.0, 242.0]), np.array([40.0, 44.0, 66.0])


def draw_figure_5(size: tuple[int, int]) -> Image.Image:
    """Draw an area of boxes at 45.2 N from 12:00 to 15:00; ``size`` of each of three pictures."""
    camera = Camera(
        np.array((60.0, -150.0, 260.0)), np.array((250.0, 190.0, 0.0)), size=size, fov=50.0
    )
    suns = _find_suns(45.2, "12:00", "15:00")
    return _draw(make_town(1132, 500.0, 1), camera, suns, frozenset({"volumes"}))


def draw_figure_6(size: tuple[int, int]) -> Image.Image:
    """Draw a tower of beams at 48.8 N from 10:00 to 14:00; ``size`` of each of three pictures."""
    camera = Camera(
        np.array((330.0, -470.0, 330.0)), np.array((130.0, 140.0, 130.0)), size=size, fov=36.0
    )
    suns = _find_suns(48.8, "10:00", "14:00")
    return _draw(make_lattice_tower(), camera, suns, frozenset({"volumes", "edges"}))


def _find_suns(latitude: float, start: str, end: str) -> list[Light]:
    """Find the sun on 18 September every 30 minutes, both ends included, by its mean time."""
    site = Site(latitude=latitude, longitude=0.0, zone="UTC")
    stamps = make_steps("2026-09-18", start, end, "30min", site.zone).stamps
    return [directional_light(way) for way in find_sun(site, stamps).direction]


def _draw(
    model: SquareModel, camera: Camera, suns: list[Light], overlays: frozenset[str]
) -> Image.Image:
    """Draw the last sun's shadows, its volumes over them, and by how many suns none is reached."""
    scene = make_scene([Part("model", "", Mesh(model.vertices, model.faces))])
    with open_device() as device, SceneRenderer(scene, 0.0, device=device) as renderer:
        shadows = renderer.render(camera, suns[-1:], samples=4)
        renderer.draw(camera, suns[-1:])
        drawn = Overlays(renderer)
        assert renderer.targets is not None
        with State(device) as state:
            drawn.draw(state, renderer.targets, renderer.plans[0], overlays)
        volumes = renderer.read()
        drawn.release()
    panels = [shadows, volumes, _draw_profile(scene, camera, suns)]
    return Image.fromarray(np.concatenate(panels, axis=1))


def _draw_profile(scene: Scene, camera: Camera, suns: list[Light]) -> NDArray[np.uint8]:
    """Draw each surface the darker, the more of the suns leave it in shadow."""
    counter = FrameCounter(scene, ground=0.0)
    view, frame = counter.see(camera)
    dark = sum(~frame.lit(counter.count(view, camera, sun), sun) for sun in suns)
    share = np.where(view.face == NOTHING, 0.0, dark / len(suns))[..., None]
    return np.rint(_LIGHTEST + share * (_DARKEST - _LIGHTEST)).astype(np.uint8)
