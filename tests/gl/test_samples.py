"""Smooth edges on OpenGL: the same picture as on the CPU."""

import numpy as np
import pytest
from support.shapes import city

import umbra
from umbra.scene import make_scene

SIZE = (160, 120)
LIGHTS = [umbra.directional_light((0.3, -0.6, 0.8)), umbra.point_light((20, 22, 30))]


@pytest.mark.usefixtures("device")
@pytest.mark.parametrize("height", [None, 60.0])
def test_both_devices_draw_one_picture(height):
    town = make_scene(*city(4, seed=5))
    camera = umbra.Camera((-30, -40, 45), (25, 25, 0), size=SIZE, height=height)
    cpu, gl, centres = (
        umbra.render(town, camera, LIGHTS, ground=0.0, device=name, samples=samples).astype(int)
        for name, samples in (("cpu", 8), ("gl", 8), ("cpu", 1))
    )
    # A sample within 1/128 pixel of an edge may fall on either side, and is an eighth of a pixel.
    assert (np.abs(cpu - gl).max(-1) > 1).sum() < 40
    assert (np.abs(cpu - centres).max(-1) > 1).sum() > 1000
