"""Animations in a view: poses, lights that go with them, playing."""

from dataclasses import replace
from time import monotonic, sleep

import numpy as np
import pytest
from support.desk import Desk
from support.gltf_files import Document
from support.shapes import box

import umbra
from umbra.calls.first_view import begin_view
from umbra.calls.picture_options import ViewOptions
from umbra.errors import InputError
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import pose
from umbra.scene.exposure import choose_sky, expose_lights
from umbra.window.controls import Controls
from umbra.window.motion import Motion
from umbra.window.view_file import from_json, to_json
from umbra.window.view_painter import ViewPainter
from umbra.window.view_state import make_view

PANEL = 290

SIZE = (160, 120)


@pytest.fixture
def path(tmp_path):
    """A cube of 1 m that rises by 4 m in 2 s, and a lamp that slides 3 m east in 1 s."""
    document = Document()
    vertices, faces = box((-0.5, -0.5, 0), (0.5, 0.5, 1))
    places = (vertices[:, [0, 2, 1]] * (1, 1, -1)).astype("f4")
    primitive = {
        "attributes": {"POSITION": document.accessor(places)},
        "indices": document.accessor(np.asarray(faces, "u2").ravel()),
    }
    cube = document.node(mesh=document.mesh(primitive), name="cube")
    lamp = {"type": "point", "intensity": 5000, "range": 100}
    document.tree["extensions"] = {"KHR_lights_punctual": {"lights": [lamp]}}
    light = document.node(translation=[2, 9, 0], extensions={"KHR_lights_punctual": {"light": 0}})
    document.tree["animations"] = [
        {
            "name": name,
            "samplers": [{"input": document.accessor(np.array([0, end], "f4")),
                          "output": document.accessor(np.array(way, "f4"))}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": "translation"}}],
        }
        for name, node, end, way in (
            ("rise", cube, 2, [[0, 0, 0], [0, 4, 0]]), ("slide", light, 1, [[2, 9, 0], [5, 9, 0]])
        )
    ]  # fmt: skip
    file = tmp_path / "model.glb"
    file.write_bytes(document.glb())
    return file


@pytest.fixture
def scene(path):
    return umbra.read(path)


def test_a_page_shows_the_pose_of_a_time_and_plays_nothing(scene, tmp_path):
    pages = []
    for given, options in ((scene, {}), (scene, {"time": 2.0}), (pose(scene, 2.0), {})):
        umbra.show(given, out=tmp_path / "page.html", **options)
        pages.append((tmp_path / "page.html").read_bytes())
    assert pages[1] == pages[2] != pages[0]
    with pytest.raises(InputError, match="a page plays no animation"):
        umbra.show(scene, out=tmp_path / "page.html", animation=0)


def test_a_view_shows_its_pose_on_both_devices(device, scene):
    painter = ViewPainter(device, scene, 0.0)
    view = replace(make_view(scene, SIZE), animation=0)
    pictures = []
    for time in (0.0, 1.5, 0.5):
        posed = pose(scene, time, 0)
        moved = replace(view, time=time)
        painter.draw(moved.toggle("volumes").toggle("cases"), SIZE)
        painter.draw(moved, SIZE)
        pictures.append(painter.read().astype(int))
        with SceneRenderer(posed, 0.0) as renderer:
            shining = [*view.shining().values()]
            renderer.draw(view.viewpoint.camera(SIZE), shining, sky=choose_sky(shining))
            expected = renderer.read()
        assert np.abs(pictures[-1] - expected).max() <= 1  # the second picture of the view
        painter.draw(moved.next_device(), SIZE)
        assert (np.abs(painter.read() - pictures[-1]).max(2) > 3).mean() < 0.01
        painter.draw(moved, SIZE)
    assert (np.abs(pictures[1] - pictures[0]).max(2) > 10).mean() > 0.01
    painter.draw(replace(moved, animation=None), SIZE)
    assert np.abs(painter.read() - pictures[0]).max() <= 1
    painter.release()


def test_lights_of_the_file_go_with_it_and_others_stay(scene):
    motion = Motion(scene)
    assert [*motion.choices.values()] == [None, 0, 1, "all"]
    (lamp,) = expose_lights(scene)
    view = make_view(scene, SIZE).add_light(umbra.point_light((7, 7, 7)))
    moved = motion.follow(replace(view, animation="all", time=0.5))
    np.testing.assert_allclose(moved.lights[0].position, [3.5, 0, 9, 1], atol=1e-6)
    np.testing.assert_array_equal(moved.lights[1].position, [7, 7, 7, 1])
    assert moved.lights[0].color == lamp.color
    assert motion.follow(moved) is moved
    held = moved.move_light(0, np.array([0.0, 0, 5]))  # by hand, while nothing moves
    assert motion.follow(held) is held
    risen = replace(held, animation=0, time=1.0)  # which does not move the lamp: it stood at 2
    np.testing.assert_allclose(motion.follow(risen).lights[0].position, [2, 0, 9, 1], atol=1e-6)
    assert motion.find_duration(risen) == 2
    assert motion.find_duration(view) == 0


def test_a_key_plays_it_round_and_round(scene, tower):
    motion = Motion(scene)
    controls = Controls(scene.bounds(), SIZE, motion=motion)
    view = controls.press_key(make_view(scene, SIZE), "t")
    assert controls.needs_time
    for seconds, time in ((0.75, 0.75), (1.0, 1.75), (0.5, 0.25)):
        view = controls.advance(view, seconds)
        assert (view.animation, view.time) == (0, pytest.approx(time))
    saved = from_json(to_json(view))
    assert (saved.animation, saved.time) == (view.animation, view.time)
    controls.press_key(view, "t")
    assert controls.advance(view, 1.0) is view
    still = Controls(tower.bounds(), SIZE, motion=Motion(tower))
    still.press_key(view, "t")
    assert not still.needs_time


def test_what_is_no_animation_is_told(scene, tower):
    with pytest.raises(InputError, match="no animation 'jump'; the scene has 'rise', 'slide'"):
        begin_view(ViewOptions(animation="jump"), scene, None, SIZE)
    with pytest.raises(InputError, match="the scene has no animation"):
        Motion(tower).find_duration(replace(make_view(tower, SIZE), animation=0))


def watch(desk, *, is_moving):
    """Watch the window until its picture moves, or rests."""
    until, before = monotonic() + 30, desk.look()[:, PANEL:]
    while monotonic() < until:
        sleep(0.8)
        now = desk.look()[:, PANEL:]
        # The cube rises before the ground by a part of its height; statistics and light blink.
        if ((np.abs(now.astype(int) - before).max(2) > 20).sum() > 500) == is_moving:
            return True
        before = now
    return False


def test_the_window_plays(display, path):
    with Desk(display, path.parent, path.name, "--animation", "rise") as desk:
        times = [desk.view().time, desk.view().time]
        assert times[0] != times[1]
        assert watch(desk, is_moving=True)
        desk.press("t")
        held = desk.view()
        assert (held.animation, held.time) == (0, desk.view().time)
        assert watch(desk, is_moving=False)
        assert desk.close() == (0, "", "")
    with Desk(display, path.parent, path.name, "--time", "0.5") as desk:
        assert (desk.view().animation, desk.view().time) == (0, 0.5)
        desk.press("ctrl+q")
        assert desk.finish() == (0, "", "")
