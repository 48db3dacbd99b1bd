"""Trees of boxes: the answers of every box by itself, wherever the boxes have moved."""

import numpy as np
import pytest

from umbra.scene import Camera
from umbra.volume.bounds import find_box_points, find_far_plane, find_visible_parts, is_outside
from umbra.volume.box_tree import BoxTree
from umbra.volume.regions import find_view_planes
from umbra.volume.scissor import find_cone_planes

CAMERAS = (
    Camera((-30, -40, 45), (25, 25, 0), size=(64, 48)),
    Camera((20, 20, 2), (60, 30, 4), size=(64, 48), far=25.0),
    Camera((20, -20, 30), (30, 30, 0), size=(64, 48), height=30.0),
)


def scatter(n, seed=4, size=60.0):
    rng = np.random.default_rng(seed)
    low = rng.uniform(0, size, (n, 3)) * (1, 1, 0.2)
    return np.stack([low, low + rng.uniform(0.1, 6, (n, 3))], 1)


def see(tree, light, camera, reach=np.inf, cone=None, floor=None):
    """Ask a tree for one light in the whole picture."""
    planes = find_view_planes(camera)
    view = np.concatenate([planes, find_far_plane(camera, planes)[None]])[None]
    lights, reaches = np.asarray(light)[None], np.array([reach])
    (found,) = tree.find_seen(lights, view, floor=floor, reaches=reaches, cones=[cone])
    return found


def hold(tree, place, margin=0.0):
    rows, boxes = tree.find_holding(np.asarray(place)[None], margin)
    assert not rows.any()
    return boxes.tolist()


@pytest.mark.parametrize("n", [0, 1, 8, 9, 65, 700])
@pytest.mark.parametrize("reach", [np.inf, 12.0, 1.0])
def test_a_tree_sees_what_each_box_shows_by_itself(n, reach):
    bounds, rng = scatter(n), np.random.default_rng(7)
    tree = BoxTree(bounds)
    seen = 0
    for number in range(12):
        light = np.append(rng.uniform(0, 60, 3) * (1, 1, 0.5), 1.0)
        if number % 3 == 2:
            light = np.array([*rng.normal(size=2), 0.7, 0.0])
        floor = None if number % 2 else -0.5
        for camera in CAMERAS:
            found = see(tree, light, camera, reach, floor=floor)
            alone = find_visible_parts(bounds, light, camera, floor=floor, reach=reach).volume
            # A node is judged by a larger box, which can only let more of its own be asked.
            assert (found == alone).all()
            seen += found.sum()
    assert n < 8 or seen > 0


def test_only_boxes_in_the_cone_are_seen():
    bounds = scatter(400)
    place, axis = np.array([30.0, 30.0, 50.0]), np.array([0.0, 0.0, -1.0])
    cone = find_cone_planes(place, axis, 10.0)
    light = np.append(place, 1.0)
    camera = CAMERAS[0]
    every = see(BoxTree(bounds), light, camera)
    found = see(BoxTree(bounds), light, camera, cone=cone)
    assert (found == every & ~is_outside(cone, find_box_points(bounds))).all()
    assert 0 < found.sum() < every.sum() / 3


def test_a_lamp_reaches_a_box_just_within_its_range():
    bounds = scatter(100)
    box = bounds[17]
    place = np.array([(box[0, 0] + box[1, 0]) / 2, box[0, 1] - 3.0, (box[0, 2] + box[1, 2]) / 2])
    camera = Camera(place + (0, -20, 0), place, size=(64, 48))
    tree, light = BoxTree(bounds), np.append(place, 1.0)
    assert see(tree, light, camera, 3.0 + 1e-9)[17]
    assert not see(tree, light, camera, 3.0 - 1e-9)[17]
    assert 17 in hold(tree, place, 3.0 + 1e-9)
    assert 17 not in hold(tree, place, 3.0 - 1e-9)


def test_many_lights_see_and_hold_what_each_does_alone():
    bounds, rng = scatter(300), np.random.default_rng(11)
    tree, camera = BoxTree(bounds), CAMERAS[0]
    lights = np.column_stack([rng.uniform(0, 60, (9, 3)) * (1, 1, 0.2), np.ones(9)])
    lights[4] = 0.3, 0.2, 1.0, 0.0
    reaches = rng.uniform(9, 30, 9)
    reaches[4] = np.inf
    cone = find_cone_planes(lights[2, :3], np.array([1.0, 0.0, 0.0]), 40.0)
    cones = [cone if k == 2 else None for k in range(9)]
    views = np.repeat(find_view_planes(camera)[None], 9, 0)
    views[7] = 0.0  # its light changes no pixel
    found = tree.find_seen(lights, views, reaches=reaches, cones=cones)
    for k in range(9):
        alone = see(tree, lights[k], camera, reaches[k], cones[k])
        assert (found[k] == (alone if k != 7 else False)).all()
    assert (found.any(1) == (np.arange(9) != 7)).all()
    rows, boxes = tree.find_holding(lights[:, :3], 2.0)
    assert [boxes[rows == k].tolist() for k in range(9)] == [
        hold(tree, light[:3], 2.0) for light in lights
    ]
    assert len(np.unique(rows)) > 2


def test_boxes_that_move_are_found_where_they_are():
    bounds, rng = scatter(300), np.random.default_rng(3)
    tree = BoxTree(bounds)
    order = tree._order
    near = bounds + rng.normal(size=(300, 1, 3)) * 0.1
    tree = tree.fit(near)
    assert tree._order is order  # fitted, not made anew
    far = bounds[rng.permutation(300)]
    for moved in (near, far):
        tree = tree.fit(moved)
        light = np.array([20.0, 25.0, 9.0, 1.0])
        found = see(tree, light, CAMERAS[0], 9.0)
        alone = find_visible_parts(moved, light, CAMERAS[0], reach=9.0).volume
        assert (found == alone).all()
        assert found.any()
        for box in moved[:40]:
            low, high = moved[:, 0], moved[:, 1]
            holding = ((box.mean(0) >= low) & (box.mean(0) <= high)).all(1)
            assert hold(tree, box.mean(0)) == np.flatnonzero(holding).tolist()
    assert tree._order is not order
