"""The terminator of smooth normals on OpenGL: as on the CPU, without teeth."""

import numpy as np
import pytest
from support.spheres import make_sphere

import umbra
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Material, Part, make_scene
from umbra.soft import size_lights

SUN = umbra.directional_light((1, -0.35, 0.7))
LAMP = umbra.point_light((6, -5, 6))
CAMERA = umbra.Camera((0, -14, 6), (0, 0, 2), size=(200, 90), fov=28)


@pytest.fixture(scope="module")
def balls():
    parts = [
        Part(
            f"{level}",
            "",
            make_sphere(level, 2.0, (5 * level - 10, 0, 2.2)),
            material=Material((0.8,) * 3),
        )
        for level in (1, 2, 3)
    ]
    return make_scene(parts)


@pytest.mark.parametrize("lights", [[SUN], [LAMP], [SUN, LAMP]], ids=["sun", "lamp", "both"])
def test_hard_pictures_are_the_cpus(device, balls, lights):
    truth = umbra.render(balls, CAMERA, lights, ground=0.0, samples=1, style="plain").astype(int)
    with SceneRenderer(balls, 0.0, device=device) as renderer:
        image = renderer.render(CAMERA, lights)
        smooth = renderer.render(CAMERA, lights, samples=4)
    assert (np.abs(image - truth).max(-1) > 2).sum() < 12
    truth = umbra.render(balls, CAMERA, lights, ground=0.0, samples=16, style="plain").astype(int)
    assert (np.abs(smooth - truth).max(-1) > 40).sum() < 6


@pytest.mark.parametrize("method", ["wedges", "samples"])
def test_soft_pictures_are_the_cpus(device, balls, method):
    truth = umbra.render(
        balls,
        CAMERA,
        SUN,
        ground=0.0,
        samples=1,
        soft="wedges",
        light_size=3.0,
        style="plain",
    ).astype(int)
    with SceneRenderer(balls, 0.0, device=device) as renderer:
        image = renderer.render(CAMERA, size_lights([SUN], (3.0,)), soft=method)
    seen = np.abs(image - truth).max(-1)
    assert (seen > 8).sum() < 40
