"""Every pixel of the wgpu device's frames, judged by float64 rays as the gl device's are."""

import numpy as np
import pytest
from support.gl_judge import Judge
from support.judge import Verdicts
from support.shapes import SCENES, staircase

from umbra.errors import InputError, UmbraError
from umbra.methods import Softness
from umbra.scene import Camera, Material, Mesh, Part, directional_light, make_scene, point_light
from umbra.soft import ball_light

SIZE = (48, 40)
FEW = Softness(samples=12)
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


@pytest.mark.parametrize("name", ["nested boxes", "cavity"])
def test_penumbrae_are_shares_of_right_counts(make, name):
    camera, light, n = CAMERAS[0], ball_light(point_light((8, -3.3, 20)), 1.5), FEW.samples
    with Judge(None, SCENES[name](), make=make) as scene:
        verdicts, dark = Verdicts(), 0
        for point in light.points(n):
            found, counts = scene.judge(camera, point)
            verdicts, dark = verdicts + found, dark + (counts != 0)
        view = scene.counter.look(camera)
        (share,) = scene.counter.find_visibility(view, camera, [light], "samples", FEW)
    verdicts.check(most_on_edges=0.02)
    assert np.array_equal(share, (1 - dark / n).astype(np.float32))
    assert ((share > 0) & (share < 1)).any()


def test_penumbrae_below_300_steps_are_summed_from_floats(make):
    camera = Camera((-0.3, 1, 30), (-0.3, 1, 0), up=(0, 1, 0), size=(21, 13), height=4.0)
    light = ball_light(directional_light((0.5, 0, 0.25)), 0.5)
    with make(make_scene(*staircase()), ground=0.0) as counter:
        view = counter.look(camera)
        counts = [counter.count(view, camera, point) for point in light.points(FEW.samples)]
        (share,) = counter.find_visibility(view, camera, [light], "samples", FEW)
    dark = (np.array(counts) != 0).mean(0)
    assert np.max(counts) > 255
    assert np.array_equal(share, (1 - dark).astype(np.float32))
    assert ((share > 0) & (share < 1)).any()
