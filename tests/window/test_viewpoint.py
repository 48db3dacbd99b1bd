"""Where one looks from."""

import numpy as np
import pytest

from umbra.window.handles import project
from umbra.window.view_state import STEEPEST, Viewpoint, frame_bounds

BOX = np.array([[10.0, 20, 0], [30, 26, 12]])
SIZE = (800, 600)


def test_heading_and_tilt_by_hand():
    north = Viewpoint((0, 0, 0), heading=0, tilt=0, distance=10)
    assert north.eye == pytest.approx([0, -10, 0])
    east = Viewpoint((0, 0, 0), heading=90, tilt=0, distance=10)
    assert east.eye == pytest.approx([-10, 0, 0])
    down = Viewpoint((0, 0, 0), heading=0, tilt=-45, distance=2**0.5)
    assert down.eye == pytest.approx([0, -1, 1])
    assert down.axes() @ down.axes().T == pytest.approx(np.eye(3))


def test_axes_are_the_cameras():
    viewpoint = Viewpoint((1, 2, 3), heading=33, tilt=-20, distance=7)
    assert viewpoint.camera(SIZE).axes() == pytest.approx(viewpoint.axes())


def test_an_orbit_keeps_the_target_and_a_walk_keeps_the_eye():
    start = Viewpoint((1, 2, 3), distance=7)
    turned = start.turn(30, 10)
    assert turned.target == start.target
    assert (turned.heading, turned.tilt) == (50, -18)
    walker = Viewpoint((1, 2, 3), distance=7, walks=True)
    assert walker.turn(30, 10).eye == pytest.approx(walker.eye)
    assert start.turn(0, 500).tilt == STEEPEST
    assert start.turn(350, 0).heading == 10


def test_panning_takes_along_what_is_as_far_as_the_target():
    start = Viewpoint((1, 2, 3), distance=7)
    moved = start.pan(40, -25, SIZE[1])
    (before,), (after,) = (
        project(each.camera(SIZE), np.array([start.target])) for each in (start, moved)
    )
    assert after - before == pytest.approx([40, -25])


def test_the_wheel_goes_a_tenth_nearer_and_back():
    start = Viewpoint((0, 0, 0), distance=10)
    assert start.dolly(1).distance == pytest.approx(9)
    assert start.dolly(3).dolly(-3).distance == pytest.approx(10)
    assert start.dolly(1000).distance == 2 * start.near
    walker = Viewpoint((0, 0, 0), heading=0, tilt=0, distance=10, walks=True)
    assert walker.dolly(1).eye == pytest.approx([0, -9, 0])
    assert walker.dolly(1).distance == 10


def test_a_walk_stays_level():
    walker = Viewpoint((0, 0, 0), heading=90, tilt=-60, distance=10, walks=True)
    assert walker.walk(2, 0, 0).eye - walker.eye == pytest.approx([2, 0, 0])
    assert walker.walk(0, 3, 0).eye - walker.eye == pytest.approx([0, -3, 0])
    assert walker.walk(0, 0, 1).eye - walker.eye == pytest.approx([0, 0, 1])


@pytest.mark.parametrize("size", [(800, 600), (300, 900), (1600, 200)])
@pytest.mark.parametrize("heading", [0, 20, 200])
def test_a_framed_box_fills_the_picture(size, heading):
    viewpoint = frame_bounds(BOX, size, Viewpoint((0, 0, 0), heading=heading))
    corners = np.stack(np.meshgrid(*BOX.T), -1).reshape(-1, 3)
    pixels = project(viewpoint.camera(size), corners)
    assert (pixels > 0).all()
    assert (pixels < size).all()
    share = np.abs(pixels / size - 0.5).max()
    assert 0.35 < share < 0.5


def test_small_and_flat_models_are_framed():
    tiny = frame_bounds(np.array([[0, 0, 0], [0.01, 0.01, 0.02]]), SIZE)
    assert tiny.near < 1e-3
    frame_bounds(np.zeros((2, 3)), SIZE).camera(SIZE)
    # A model of 10 micrometres, as files in the wrong unit are, lies behind the near plane, too.
    speck = frame_bounds(BOX * 1e-6, SIZE)
    assert speck.near < speck.distance / 100
    assert speck.distance == pytest.approx(1e-6 * frame_bounds(BOX, SIZE).distance)
