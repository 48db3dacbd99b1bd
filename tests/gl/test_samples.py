"""Smooth edges on OpenGL: the same picture as on the CPU."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box, city, merge

import umbra
from umbra.gl.scene_renderer import SceneRenderer
from umbra.methods import Softness
from umbra.scene import make_scene
from umbra.scene.material import find_linear
from umbra.soft import AreaLight, ball_light

SIZE = (160, 120)
LIGHTS = [umbra.directional_light((0.3, -0.6, 0.8)), umbra.point_light((20, 22, 30))]


@pytest.mark.usefixtures("device")
@pytest.mark.parametrize("height", [None, 60.0])
def test_both_devices_draw_one_picture(height):
    town = make_scene(*city(4, seed=5))
    camera = umbra.Camera((-30, -40, 45), (25, 25, 0), size=SIZE, height=height)
    cpu, gl, centres = (
        umbra.render(
            town, camera, LIGHTS, ground=0.0, device=name, samples=samples, style="plain"
        ).astype(int)
        for name, samples in (("cpu", 8), ("gl", 8), ("cpu", 1))
    )
    # A sample within 1/128 pixel of an edge may fall on either side, and is an eighth of a pixel.
    assert (np.abs(cpu - gl).max(-1) > 1).sum() < 40
    assert (np.abs(cpu - centres).max(-1) > 1).sum() > 1000


@pytest.mark.parametrize("n_lights", [1, 2])
@pytest.mark.parametrize("samples", [2, 4, 8])
def test_volumes_are_counted_in_each_sample(device, samples, n_lights):
    town = make_scene(*city(4, seed=5))
    camera = umbra.Camera((-30, -40, 45), (25, 25, 0), size=SIZE)
    lights = LIGHTS[:n_lights]
    truth = umbra.render(town, camera, lights, ground=0.0, samples=16, style="plain").astype(int)
    with SceneRenderer(town, 0.0, device=device) as renderer:
        jagged, smooth = (
            np.abs(renderer.render(camera, lights, samples=n) - truth).max(-1) / 255
            for n in (1, samples)
        )
    assert jagged.max() > 0.25
    assert smooth.mean() < min(0.01, 0.6 * jagged.mean())
    assert (smooth > 0.15).sum() < (80 if samples == 2 else 3)  # a driver may give 4 for 2


@pytest.mark.parametrize("what", ["soft", "mask", "parallel", "many volumes"])
def test_whatever_is_drawn_is_smooth(device, what):
    camera = umbra.Camera((-30, -40, 45), (25, 25, 0), size=SIZE)
    town, light, more = make_scene(*city(4, seed=5)), LIGHTS[0], {}
    if what == "soft":
        light, more = AreaLight(light, 1.0), {"soft": "wedges"}
    elif what == "mask":
        more = {"method": "alpha"}
    elif what == "parallel":
        camera = replace(camera, height=60.0)
    else:  # beyond what the stencil can count
        town = make_scene(
            *merge(*[box((10, 10, 9 - k / 40), (30, 30, 9.01 - k / 40)) for k in range(300)])
        )
    with SceneRenderer(town, 0.0, device=device) as renderer:
        truth = find_linear(renderer.render(larger(camera), [light], **more) / 255.0)
        if what == "many volumes":
            assert renderer.statistics[0].counts_in == "float"
        jagged, smooth = (
            find_linear(renderer.render(camera, [light], samples=n, **more) / 255.0) for n in (1, 8)
        )
    truth = truth.reshape(SIZE[1], 4, SIZE[0], 4, 3).mean((1, 3))
    before, after = (np.abs(picture - truth).max(-1) for picture in (jagged, smooth))
    assert after.mean() < 0.6 * before.mean()
    assert (after > 0.15).sum() < 8 < (before > 0.15).sum()


def test_pictures_of_one_pixel_share_the_lights_samples(device):
    camera = umbra.Camera((-30, -40, 45), (25, 25, 0), size=(80, 60))
    town, light = make_scene(*city(4, seed=5)), ball_light(LIGHTS[1], 3.0)
    with SceneRenderer(town, 0.0, device=device, softness=Softness(samples=64)) as renderer:
        truth = renderer.render(camera, [light], samples=8).astype(int)
        renderer.soft.refine(Softness(samples=8))
        drawn, jagged = (renderer.render(camera, [light], samples=n) for n in (8, 1))
    # With the same 8 points in each picture a penumbra would have the steps of one picture.
    errors = [np.abs(picture - truth)[30:, :, 0].mean() for picture in (drawn, jagged)]
    assert 0 < errors[0] < 0.5 * errors[1]


def larger(camera):
    return replace(camera, size=(4 * SIZE[0], 4 * SIZE[1]))
