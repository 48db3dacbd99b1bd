"""A kept renderer draws, after any edits, what a fresh one draws."""

from dataclasses import fields, replace

import numpy as np
import pytest
from support.edits import Edits, compare
from support.shapes import HOUSE, box

from umbra.gl.geometry import Geometry
from umbra.gl.planner import Planner
from umbra.gl.request import FrameRequest, LightShape, find_request_key
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.selection import VolumeOptions
from umbra.scene import Camera, make_scene, spot_light

FARS = (0.0, 0.0, 0.0), (85_000.0, 447_000.0, 12.0)


@pytest.mark.parametrize("far", FARS, ids=["near", "far"])
@pytest.mark.parametrize("seed", range(6))
def test_after_random_edits_no_pixel_differs(device, seed, far):
    for done, options, differ in compare(device, seed, 12, far):
        assert differ == 0, (done, options)


@pytest.mark.parametrize("seed", [3, 8])
def test_a_still_eye_sees_faces_that_a_light_grazes(device, seed):
    """Of 24 lights one grazes a face: rounded to half a float, its normal turned from the light."""
    edits = Edits(seed)
    edits.camera = replace(edits.camera, size=(128, 96))
    renderers = [SceneRenderer(edits.scene, edits.ground, device=device) for _ in range(2)]
    with renderers[0] as kept, renderers[1] as fresh:
        for number in range(24):
            if number % 8 == 0:
                edits.edit_camera()
            edits.edit_sun()
            kept.draw(edits.camera, edits.lights, samples=4)
            anew = fresh.render(edits.camera, edits.lights, samples=4)
            assert np.abs(kept.read().astype(int) - anew).max() <= 1, number


SPOT = spot_light((10, 10, 50), (20, 20, 0), 25)
VIEW = Camera((-30, -40, 45), (15, 15, 3), size=(64, 48))
SCENE = make_scene(*box((12, 12, 0), (22, 24, 8)))


@pytest.mark.parametrize(
    "options", [{}, {"method": "z-fail"}, {"mask_scale": 2}, {"mask_scale": 4}, {"samples": 4}]
)
def test_a_spot_is_not_cut_by_the_last_pictures_size(device, options):
    with SceneRenderer(SCENE, 0.0, device=device) as kept:
        for size in ((64, 48), (256, 192), (128, 96)):
            camera = replace(VIEW, size=size)
            kept.draw(camera, [SPOT, SPOT], **options)
            np.testing.assert_array_equal(kept.read(), anew(device, camera, options))


def anew(device, camera, options):
    with SceneRenderer(SCENE, 0.0, device=device) as renderer:
        renderer.draw(camera, [SPOT, SPOT], **options)
        return renderer.read()


def change(value):
    """Return another value of the same type."""
    if value is None:
        return 1.5
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        return f"{value}!"
    if isinstance(value, np.ndarray):
        return value + 1.0
    if isinstance(value, tuple):
        return tuple(change(each) for each in value)
    return 500.0 if value == np.inf else value + 1


@pytest.fixture
def request_and_planner(device):
    scene = make_scene(*HOUSE)
    geometry = Geometry(device, scene)
    planner = Planner(device, scene, geometry, ground=0.0)
    lights = (LightShape.of(SPOT),)
    yield (
        FrameRequest(planner.casting, planner.project(VIEW), lights, "auto", VolumeOptions()),
        planner,
    )
    planner.release()
    geometry.release()


def test_every_field_of_what_a_plan_reads_is_in_its_key(request_and_planner):
    request, planner = request_and_planner
    assert request.key == replace(request, method="auto").key
    assert replace(request, method="z-fail").key != request.key
    planner.move(planner.scene)
    assert replace(request, casting=planner.casting).key != request.key
    for record in (
        request.projection.asked,
        request.projection,
        request.lights[0],
        request.choices,
    ):
        for field in fields(record):
            value = getattr(record, field.name)
            if isinstance(value, Camera):
                other = replace(value, near=value.near / 2)
            elif field.name == "offset":
                other = 0.25, 0.25
            elif field.name == "axis":
                other = -value
            else:
                other = change(value)
            assert find_request_key(replace(record, **{field.name: other})) != find_request_key(
                record
            ), field.name
