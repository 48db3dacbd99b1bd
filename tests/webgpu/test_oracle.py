"""Every pixel of the wgpu device's frames, judged by float64 rays as the gl device's are."""

import numpy as np
import pytest
from support.gl_judge import Judge
from support.judge import Verdicts
from support.shapes import SCENES, staircase

from umbra.errors import InputError, UmbraError
from umbra.scene import Camera, Material, Mesh, Part, directional_light, make_scene, point_light

SIZE = (48, 40)
CAMERAS = [
    Camera((20, -25, 14), (0, 0, 3), size=SIZE),
    Camera((20, -25, 14), (0, 0, 3), size=SIZE, height=30.0),
    Camera((0.3, 0.2, 3), (10, 3, 0), size=SIZE),
    Camera((20, -25, -9), (0, 0, 3), size=SIZE),
    Camera((20, -25, 14), (0, 0, 3), size=SIZE, near=30.0),
]
LIGHTS = [
    point_light((8, -3.3, 20)),
    point_light((0.13, 0.31, 3.3)),
    directional_light((0.4, 0.3, 0.7)),
    directional_light((0.4, 0.35, -0.7)),
    directional_light((0.41, 0.29, 0)),
]


@pytest.fixture(scope="module")
def make():
    pytest.importorskip("wgpu", reason="no WebGPU: wgpu is not installed")
    from umbra.webgpu.adapter import open_adapter  # noqa: PLC0415
    from umbra.webgpu.wgpu_frames import WgpuFrameCounter  # noqa: PLC0415

    try:
        open_adapter()
    except UmbraError as error:
        pytest.skip(f"no WebGPU: {error}")
    return WgpuFrameCounter


@pytest.mark.parametrize("name", ["nested boxes", "cavity", "sheets", "coplanar walls"])
def test_every_pixel_is_right(make, name):
    verdicts = Verdicts()
    with Judge(None, SCENES[name](), make=make) as scene:
        for camera in CAMERAS:
            for light in LIGHTS:
                verdicts += scene.judge(camera, light, "auto", "z-fail")[0]
    verdicts.check(most_on_edges=0.002)


def test_300_steps_are_counted_in_floats(make):
    camera = Camera((-0.3, 1, 30), (-0.3, 1, 0), up=(0, 1, 0), size=(21, 13), height=0.71)
    with Judge(None, staircase(), make=make) as scene:
        verdicts, counts = scene.judge(camera, directional_light((0.5, 0, 0.25)), "auto", "z-fail")
    assert verdicts.check(0.01).deepest == counts.max() == 300


def test_what_transmits_is_refused_by_name(make):
    pane = Mesh(np.array([(0, 0, 0), (1, 0, 0), (0, 0, 1.0)]), np.array([[0, 1, 2]], np.int32))
    scene = make_scene([Part("pane", "", pane, material=Material(opacity=0.3))])
    with pytest.raises(InputError, match="'pane'") as caught:
        make(scene)
    assert caught.value.option == "device"
