"""A still eye: what is kept from picture to picture changes none of them."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box, torus_knot

from umbra.gl.request import find_request_key
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import (
    Camera,
    Material,
    Mesh,
    Part,
    directional_light,
    make_scene,
    point_light,
    spot_light,
)

CAMERA = Camera((-30, -40, 45), (15, 15, 3), size=(96, 72))
LIGHTS = {
    "sun": [directional_light((0.3 + 0.1 * k, -0.6, 0.8)) for k in range(3)],
    "lamp": [point_light((20 + k, 4, 30), range=60.0) for k in range(3)],
    "spot": [spot_light((10 + k, 10, 50), (20, 20, 0), 25) for k in range(3)],
}


def make_still(*, moved=0.0, is_plain=False):
    """Make a smooth knot by crates: plain ones, or one that glows, a shiny and an unlit one."""
    vertices, faces = torus_knot(40, 8)
    normals = (vertices / np.linalg.norm(vertices, axis=1)[:, None]).astype(np.float32)
    place = np.eye(4)
    place[:3, 3] = 12 + moved, 12, 7
    looks = (
        Material(emission=(0.4, 0.1, 0.0)),
        Material(color=(0.9, 0.6, 0.2), roughness=0.3, metallic=1.0),
        Material(color=(0.9, 0.9, 0.9), is_unlit=True),
    )
    crates = [
        Part(f"{k}", "", Mesh(*box((9 * k, 20, 0), (9 * k + 6, 26, 8))), material=look)
        for k, look in enumerate([Material()] if is_plain else looks)
    ]
    return make_scene([Part("knot", "", Mesh(vertices, faces, normals), place), *crates])


def draw(renderer, camera, lights, **options):
    renderer.draw(camera, lights, **options)
    return renderer.read()


def draw_anew(device, scene, light, camera=CAMERA, **options):
    with SceneRenderer(scene, 0.0, device=device) as renderer:
        return renderer.render(camera, [light], **options)


def find_worst(one, two):
    return int(np.abs(one.astype(int) - two).max())


@pytest.mark.parametrize("options", [{}, {"samples": 4}, {"shadows": False}, {"method": "alpha"}])
@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.parametrize("is_plain", [True, False])
def test_pictures_of_a_still_eye_are_those_drawn_anew(device, name, options, is_plain):
    scene = make_still(is_plain=is_plain)
    with SceneRenderer(scene, 0.0, device=device) as renderer:
        for number, light in enumerate(LIGHTS[name]):
            shown = draw(renderer, CAMERA, [light], **options)
            assert renderer.still.is_stored == (number > 0)
            assert find_worst(shown, draw_anew(device, scene, light, **options)) <= 1


def test_what_is_kept_goes_with_the_view_the_scene_and_other_lights(device):
    scene, moved = make_still(), make_still(moved=3.0)
    sun, lamp = LIGHTS["sun"][0], LIGHTS["lamp"][0]
    aside = replace(CAMERA, eye=CAMERA.eye + [1.0, 0.0, 0.0])
    with SceneRenderer(scene, 0.0, device=device) as renderer:
        for _ in range(3):
            draw(renderer, CAMERA, [sun])
        assert find_worst(draw(renderer, aside, [lamp]), draw_anew(device, scene, lamp, aside)) <= 1
        for _ in range(2):
            draw(renderer, CAMERA, [sun])
        renderer.move(moved)
        for _ in range(2):
            assert find_worst(draw(renderer, CAMERA, [lamp]), draw_anew(device, moved, lamp)) <= 1
        draw(renderer, CAMERA, [sun, lamp])  # adds both to what is kept
        assert not renderer.still.is_stored
        for _ in range(3):
            assert find_worst(draw(renderer, CAMERA, [sun]), draw_anew(device, moved, sun)) <= 1


def test_a_move_within_bounds_that_stay_is_seen(device):
    """The depth range of the view stays, too, so that nothing but the scene tells of the move."""
    ends = (-24, -37, 38), (60, 60, 0)  # nearer than all else, and farther
    corners = [Part(f"{at}", "", Mesh(*box(at, np.add(at, 0.5)))) for at in ends]
    knot, *crates = make_still(is_plain=True).parts
    place = make_still(moved=3.0).parts[0].transform
    scene, moved = (
        make_scene([part, *crates, *corners]) for part in (knot, replace(knot, transform=place))
    )
    sun = LIGHTS["sun"][0]
    with SceneRenderer(scene, device=device) as renderer:
        for _ in range(3):
            draw(renderer, CAMERA, [sun])
        before = renderer.projection
        renderer.move(moved)
        shown = draw(renderer, CAMERA, [sun])
        assert find_request_key(renderer.projection) == find_request_key(before)
        with SceneRenderer(moved, device=device) as fresh:
            assert find_worst(shown, fresh.render(CAMERA, [sun])) <= 1


def test_marks_of_smooth_surfaces_give_way_to_high_counts(device):
    """Of 8 bits one marks smooth surfaces: 140 sheets above one another need it."""
    sheets = [
        Part(f"{k}", "", Mesh(*box((-9, 0, k / 4), (-3, 6, 0.1 + k / 4)))) for k in range(140)
    ]
    scene = make_scene([*make_still(is_plain=True).parts, *sheets])
    aside, above = point_light((22, 5, 14), range=18.0), directional_light((0.01, 0.01, 1.0))
    marked = []
    with SceneRenderer(scene, 0.0, device=device) as renderer:
        for light in (aside, aside, above, aside, above):
            shown = draw(renderer, CAMERA, [light])
            assert find_worst(shown, draw_anew(device, scene, light)) <= 1
            marked.append((renderer.still.is_marked, renderer.statistics[0].deepest > 127))
    assert marked == [(False, False), (True, False), (False, True), (False, False), (False, True)]
