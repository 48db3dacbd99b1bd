"""Where volumes begin and end: just above the ground, and close below it."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box, torus_knot
from support.spheres import make_sphere

from umbra.gl.flags import LOW
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.selection import VolumeOptions
from umbra.gl.volume_plan import VolumePlan
from umbra.scene import Camera, Mesh, Part, directional_light, make_scene, point_light

CAMERA = Camera((0, -40, 26), (0, 0, 2), size=(220, 160), fov=40)
SUN = directional_light((0.5, -0.3, 0.8))
LAMP = point_light((7, -6, 15))


def make_ball(x, y, z, radius=1.0):
    return Part(f"{x} {y}", "", make_sphere(2, radius, (x, y, z)))


def make_knot(x, y, z):
    vertices, faces = torus_knot(40, 8)
    return Part("knot", "", Mesh(vertices * 0.3 + [x, y, z], faces))


def make_crate(x, y, z):
    return Part("crate", "", Mesh(*box((x, y, z), (x + 2, y + 2, z + 2))))


def make_field():
    """Make balls as instances of one mesh, some in the shadow of others, a crate and a knot."""
    ball, random = make_sphere(2, 1.0, (0, 0, 0)), np.random.default_rng(5)
    parts = [make_crate(-11, 5, 3), make_knot(11, 5, 5)]
    for k in range(25):
        place = np.eye(4) * random.uniform(0.7, 1.2)
        place[:3, 3] = 4 * (k % 5) - 8, 4 * (k // 5) - 8, random.uniform(1.5, 5.0)
        place[3, 3] = 1.0
        parts.append(Part(f"ball {k}", "", ball, place))
    return make_scene(parts)


@pytest.mark.parametrize("lights", [[SUN], [LAMP], [SUN, LAMP]], ids=["sun", "lamp", "both"])
@pytest.mark.parametrize("is_still", [False, True])
def test_pictures_are_those_of_whole_volumes(device, lights, is_still):
    scene, images, low = make_field(), [], []
    for choices in (None, VolumeOptions()):
        with SceneRenderer(scene, 0.0, device=device, choices=choices) as renderer:
            images.append(renderer.render(CAMERA, lights).astype(int))
            if is_still:
                for _ in range(3):
                    renderer.draw(CAMERA, lights)
                images[-1] = renderer.read().astype(int)
            low.append([(plan.selection.flags & LOW != 0).sum() for plan in renderer.plans])
    assert all(4 <= number < 25 for number in low[0])
    assert not any(low[1])
    differs = np.abs(images[0] - images[1]).max(-1) > 1
    assert differs.sum() <= 2  # pixels at an edge
    assert len(np.unique(images[0].reshape(-1, 3), axis=0)) > 100


APART = make_ball(-5, 0, 3), make_ball(5, 0, 3)
SHADING = make_ball(0, 0, 8), make_ball(-2.5, 1.5, 4)  # toward the sun, and in its shadow
IDLE = make_crate(0, 10, 0.5)


@pytest.mark.parametrize(
    ("casters", "idle", "light", "expected"),
    [
        (APART, [], SUN, 2),
        (APART, [], LAMP, 2),
        (SHADING, [], SUN, 0),
        (SHADING, [], directional_light((0, 0, 1)), 2),
        (SHADING, [], point_light((2.5, -1.5, 12)), 0),  # on the line through both
        ((*APART, make_knot(0, 8, 5)), [], directional_light((0, 0, 1)), 2),  # it is not convex
        ((make_ball(-5, 0, 1), APART[1]), [], SUN, 1),  # one lies on the ground
        (APART, [IDLE], SUN, 0),  # it reaches as high as they hang
        ((*APART, IDLE), [], directional_light((0, 0, 1)), 3),
        (APART, [], directional_light((1, 0, 0.01)), 0),
    ],
)
def test_lone_are_convex_casters_above_what_does_not_cast(device, casters, idle, light, expected):
    scene = make_scene([*casters, *idle])
    with SceneRenderer(scene, 0.0, device=device, casters=range(len(casters))) as renderer:
        renderer.render(CAMERA, [light])
        assert renderer.plans[0].selection.find(LOW).sum() == expected
        assert (renderer.statistics[0].low > 0) == (expected > 0)


def test_only_auto_shortens_and_not_where_nothing_lies_below(device):
    scene = make_scene(APART)
    with SceneRenderer(scene, 0.0, device=device) as renderer:
        renderer.render(CAMERA, [SUN], "mcguire")
        assert renderer.statistics[0].low == 0
    with SceneRenderer(scene, device=device) as renderer:
        renderer.render(CAMERA, [SUN])
        assert renderer.statistics[0].low == 0


def test_a_scaled_ball_is_as_large_as_it_is_drawn(device):
    ball, places = make_sphere(2, 1.0, (0, 0, 0)), []
    for x, size in ((0.0, 1.0), (4.0, 2.5)):
        place = np.diag([size, size, size, 1.0])
        place[:3, 3] = x, 0, 4
        places.append(Part(f"{x}", "", ball, place))
    up = directional_light((0, 0, 1))
    with SceneRenderer(make_scene(places), 0.0, device=device) as renderer:
        renderer.render(CAMERA, [up])
        assert renderer.statistics[0].low > 0
        places[1].transform[0, 3] = 3.0  # now above one another, seen from the light
        renderer.move(make_scene(places))
        renderer.render(CAMERA, [up])
        assert renderer.statistics[0].low == 0


def make_street():
    """Make blocks that stand on a wide lawn, and a ball above it."""
    wide = np.array([[-400, -400, 0], [400, -400, 0], [400, 400, 0], [-400, 400, 0.0]])
    lawn = Part("lawn", "", Mesh(wide, np.array([[0, 1, 2], [0, 2, 3]], np.int32)))
    blocks = [make_crate(5 * x, 5 * y, -0.5 + (x + y) % 3) for x in range(-3, 3) for y in range(5)]
    return make_scene([lawn, *blocks, make_ball(0, -6, 4)])


@pytest.mark.parametrize(
    ("light", "is_near"),
    [
        (SUN, True),
        (directional_light((0.9, 0.4, 0.03)), True),
        (LAMP, True),
        (point_light((7, -6, 4.2)), False),  # lower than what stands highest
        (directional_light((1, 0, -0.1)), False),
    ],
)
def test_volumes_end_close_below_what_they_fall_on(device, monkeypatch, light, is_near):
    views = [CAMERA, replace(CAMERA, eye=(-14, -9, 1.6)), replace(CAMERA, eye=(300, -200, 90))]
    with GlFrameCounter(make_street(), device=device) as counter:
        origin = counter.planner.scene.origin
        lowest, floor = -0.5 - origin[2], counter.planner.casting.floor
        for camera in views:
            view, frame = counter.see(camera)
            counts = counter.count(view, camera, light)
            end = counter.plan.end + counter.plan.projection.eye[2]
            room = (lowest - end) / (lowest - floor)
            assert 0.0 < room < 0.4 if is_near else room == pytest.approx(1.0)
            monkeypatch.setattr(VolumePlan, "find_bottom", lambda plan, _: plan.bottom)
            whole = counter.count(view, camera, light)
            monkeypatch.undo()
            differs = (counts != whole) & np.isfinite(frame.position).all(-1)
            assert differs.sum() <= 3  # pixels at an edge
            assert len(np.unique(counts[np.isfinite(frame.position).all(-1)])) > 1 or not is_near


def test_no_volume_ends_above_an_eye(device):
    below = replace(CAMERA, eye=(0.0, -40.0, -0.9), target=(0.0, 0.0, -0.9))
    with GlFrameCounter(make_street(), device=device) as counter:
        view, _ = counter.see(below)
        counter.count(view, below, SUN)
        assert counter.planner.casting.floor < -0.9 - counter.planner.scene.origin[2]
        assert counter.plan.end == counter.plan.bottom
