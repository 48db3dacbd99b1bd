"""Cameras along a way."""

from dataclasses import replace

import numpy as np
import pytest

from umbra.errors import InputError
from umbra.scene import Camera
from umbra.scene.camera_path import follow_cameras, hold_in_turn, turn_camera

CAMERA = Camera((10.0, -40.0, 25.0), (2.0, 3.0, 5.0), (0.0, 0.0, 1.0), (64, 48), 40.0)


def eyes(cameras):
    return np.array([one.eye for one in cameras])


def test_a_turn_closes_in_even_steps_clockwise():
    cameras = turn_camera(CAMERA, 8)
    back = eyes(cameras) - CAMERA.target
    assert np.allclose(back[0], np.subtract(CAMERA.eye, CAMERA.target))
    assert np.allclose(np.linalg.norm(back, axis=1), np.linalg.norm(back[0]))
    assert np.allclose(back[:, 2], back[0, 2])
    bearing = np.degrees(np.arctan2(back[:, 0], back[:, 1]))
    assert np.allclose(np.diff(np.append(bearing, bearing[0])) % 360, 45)


def test_a_turn_of_a_plan_turns_its_top():
    plan = replace(CAMERA, eye=(0.0, 0.0, 50.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    quarter = turn_camera(plan, 4)[1]
    assert np.allclose(quarter.eye, plan.eye)
    assert np.allclose(quarter.up, (1, 0, 0))


@pytest.mark.parametrize(("height", "shift"), [(None, (0, 0)), (30.0, (0, 0)), (None, (0, -20))])
def test_all_pictures_of_a_turn_hold_the_model_and_one_is_filled(height, shift):
    low = np.random.default_rng(3).uniform((-30, -10, 0), (30, 10, 8), (200, 3))
    points = np.vstack([low, [[28.0, 9.0, 60.0]]])  # a tower at a corner
    given = replace(CAMERA, height=height, shift=shift)
    if any(shift):
        given = replace(given, target=(2.0, 3.0, 25.0))  # level, as a bird's view is
    camera = hold_in_turn(given, points, 12, margin=0.05)
    assert np.allclose(camera.axes(), given.axes())
    most = []
    for one in turn_camera(camera, 12):
        assert ((points - one.eye) @ one.axes()[2] > one.near).all()
        x, y, w, _ = one.matrix() @ np.column_stack([points, np.ones(len(points))]).T
        places = np.column_stack([x / w + 0.5, y / w + 0.5]) / one.size
        most.append(2 * np.abs(places - 0.5).max())
    assert max(most) == pytest.approx(0.9)


def test_a_path_meets_its_views_and_never_overshoots():
    views = [
        CAMERA,
        replace(CAMERA, eye=(60.0, 3.0, 25.0), fov=60.0),
        replace(CAMERA, eye=(2.0, 90.0, 25.0), target=(2.0, 30.0, 5.0)),
    ]
    cameras = follow_cameras(views, 21)
    for view, camera in zip(views, (cameras[0], cameras[10], cameras[20]), strict=True):
        assert np.allclose(camera.eye, view.eye)
        assert np.allclose(camera.target, view.target)
        assert camera.fov == pytest.approx(view.fov)
    targets = np.array([one.target for one in cameras])
    assert np.allclose(targets[:11], CAMERA.target)  # which stays
    assert (np.diff(targets[10:, 1]) > 0).all()
    assert np.allclose(targets[:, 2], 5)


def test_a_path_takes_the_shorter_way_round():
    def stand(degrees):
        angle = np.radians(degrees)
        return replace(CAMERA, target=(0, 0, 0), eye=(9 * np.cos(angle), 9 * np.sin(angle), 3))

    middle = follow_cameras([stand(170), stand(-170)], 3)[1]
    assert np.allclose(middle.eye, stand(180).eye)


def test_what_is_no_path_is_refused():
    with pytest.raises(InputError, match="1"):
        follow_cameras([CAMERA], 5)
    with pytest.raises(InputError, match="view 2"):
        follow_cameras([CAMERA, replace(CAMERA, height=9.0)], 5)
