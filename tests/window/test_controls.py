"""Mouse and keys without a window."""

from dataclasses import replace

import numpy as np
import pytest

from umbra.scene import directional_light
from umbra.sun import Site
from umbra.window.controls import Controls
from umbra.window.handles import drag, find_dome, find_handles, find_path, pick, project
from umbra.window.overlays import PALETTE, find_count_colors, find_scale_ticks
from umbra.window.pacing import Pacing
from umbra.window.view_state import SUN, make_view

SIZE = (800, 600)
VIENNA = Site(48.2, 16.37, "Europe/Vienna")


@pytest.fixture
def controls(tower):
    return Controls(tower.bounds(), SIZE)


@pytest.fixture
def view(tower):
    return make_view(tower, SIZE)


def find_handle(view, number):
    return next(handle for handle in find_handles(view, SIZE) if handle.number == number)


def test_a_drag_turns_and_ends_with_its_button(controls, view):
    held = controls.press(view, "left", (10, 590))
    assert held == view
    assert controls.is_moving
    turned = controls.move(view, (20, 580))
    assert turned.viewpoint.heading == pytest.approx(view.viewpoint.heading + 3)
    assert turned.viewpoint.tilt == pytest.approx(view.viewpoint.tilt + 3)
    controls.release("right")
    assert controls.is_moving
    controls.release("left")
    assert not controls.is_moving
    assert controls.move(turned, (300, 300)) == turned


def test_right_middle_and_shifted_drags_pan(controls, view):
    for button, shift in (("right", False), ("middle", False), ("left", True)):
        controls.press(view, button, (10, 590), shift=shift)
        panned = controls.move(view, (30, 560), shift=shift)
        assert panned.viewpoint == view.viewpoint.pan(20, -30, SIZE[1])
        controls.release(button)


def test_keys(controls, view):
    assert controls.press_key(view, "1").overlays == {"volumes"}
    assert controls.press_key(controls.press_key(view, "4"), "4").overlays == frozenset()
    assert controls.press_key(view, "g").device == "cpu"
    assert controls.press_key(view, "m").method == "z-pass"
    assert controls.press_key(view, "h").soft == "samples"
    assert len(controls.press_key(view, "l").lights) == 1
    assert controls.press_key(view, "delete").shining() == {}
    away = replace(view, viewpoint=replace(view.viewpoint, target=(99, 0, 0)))
    assert controls.press_key(away, "f").viewpoint == view.viewpoint
    for key, control in (("p", False), ("tab", False), ("s", True), ("o", True), ("q", True)):
        assert controls.press_key(view, key, control=control) == view
    assert controls.commands == ["screenshot", "panel", "save", "load", "quit"]
    assert controls.press_key(view, "x") == view


def test_letters_walk_only_in_a_walk(controls, view):
    controls.press_key(view, "w")
    assert not controls.needs_time
    walks = controls.press_key(view, "c")
    controls.press_key(walks, "w")
    controls.press_key(walks, "d")
    assert controls.needs_time
    gone = controls.advance(walks, 0.5).viewpoint.eye - walks.viewpoint.eye
    right, _, forward = walks.viewpoint.axes()
    assert gone @ right == pytest.approx(gone @ forward / np.cos(np.radians(28)))
    assert gone[2] == 0
    controls.release_key("w")
    controls.let_go()
    assert controls.advance(walks, 0.5) == walks


def test_playing_lets_time_pass(controls, tower):
    view = make_view(tower, SIZE, site=VIENNA)
    controls.press_key(view, "space")
    assert controls.advance(view, 0.5).sun.minutes == view.sun.minutes + 30
    controls.press_key(view, "space")
    assert controls.advance(view, 0.5) == view


def test_a_lamp_follows_the_mouse_at_its_distance(controls, view):
    lit = controls.press_key(view, "l")
    at = find_handle(lit, 0).at
    lit = controls.press(replace(lit, chosen=SUN), "left", (at[0] + 3, at[1] - 2))
    assert lit.chosen == 0
    moved = controls.move(lit, (at[0] + 53, at[1] + 28))
    assert find_handle(moved, 0).at == pytest.approx((at[0] + 50, at[1] + 30))
    way = moved.lights[0].position[:3] - lit.lights[0].position[:3]
    assert way @ view.viewpoint.axes()[2] == pytest.approx(0, abs=1e-9)
    level = controls.move(lit, (at[0] + 53, at[1] + 28), shift=True)
    assert level.lights[0].position[2] == pytest.approx(lit.lights[0].position[2])
    assert find_handle(level, 0).at == pytest.approx((at[0] + 50, at[1] + 30))


def test_a_lamp_is_not_dragged_beyond_the_horizon(controls, view):
    lit = controls.press_key(view, "l")
    low = replace(lit, viewpoint=replace(lit.viewpoint, tilt=-0.5))
    above = (400.0, 2.0) if low.lights[0].position[2] < low.viewpoint.eye[2] else (400.0, 599.0)
    assert drag(low, 0, above, SIZE, level=True) == low


def test_several_lamps_lie_apart_and_in_the_picture(controls, view):
    for _ in range(3):
        view = controls.press_key(view, "l")
    lamps = [handle.at for handle in find_handles(view, SIZE) if handle.number >= 0]
    assert len(lamps) == 3
    assert min(np.hypot(*np.subtract(a, b)) for a in lamps for b in lamps if a is not b) > 20


def test_the_sun_by_angles_goes_where_it_is_dragged(view):
    for at in ((300.0, 250.0), (420.0, 200.0), (500.0, 300.0)):
        moved = drag(view, SUN, at, SIZE, level=False)
        assert find_handle(moved, SUN).at == pytest.approx(at, abs=0.5)
        assert moved.sun.altitude >= 1
    outside = drag(view, SUN, (-500.0, 100.0), SIZE, level=False)
    assert find_handle(outside, SUN).at[0] > 0


def test_a_light_without_a_place_hangs_on_the_dome(view):
    lit = view.add_light(directional_light((1, -1, 1)))
    at = find_handle(lit, 0).at
    moved = drag(lit, 0, (at[0] - 20, at[1] + 10), SIZE, level=False)
    assert find_handle(moved, 0).at == pytest.approx((at[0] - 20, at[1] + 10), abs=0.5)
    assert not moved.lights[0].is_point


def test_the_sun_by_clock_stays_on_its_path(tower):
    view = make_view(tower, SIZE, site=VIENNA)
    minutes, places = find_path(view)
    pixels = project(view.viewpoint.camera(SIZE), places)
    number = len(minutes) // 3
    moved = drag(view, SUN, tuple(pixels[number] + 2), SIZE, level=False)
    assert moved.sun.minutes == pytest.approx(minutes[number], abs=10)
    middle, radius = find_dome(view.viewpoint)
    assert np.linalg.norm(places - middle, axis=1) == pytest.approx(radius)


def test_the_nearest_handle_is_picked(controls, view):
    lit = controls.press_key(view, "l")
    handles = find_handles(lit, SIZE)
    for handle in handles:
        assert pick(handles, (handle.at[0] + 5, handle.at[1])).number == handle.number
    assert pick(handles, (2.0, 2.0)) is None
    assert pick([], (2.0, 2.0)) is None


def test_slow_frames_are_halved_while_things_move():
    pacing = Pacing(slow=80)
    assert pacing.choose_step(True) == 1
    pacing.note(1, 200.0)
    assert pacing.choose_step(True) == 2
    assert pacing.choose_step(False) == 1
    pacing.note(2, 60.0)
    assert pacing.choose_step(True) == 2
    for _ in range(4):
        pacing.note(2, 15.0)
    assert pacing.choose_step(True) == 1


def test_the_scale_of_counts():
    assert find_count_colors(np.array([0, 8, 99]), 8) == pytest.approx(PALETTE[[0, -1, -1]])
    assert find_scale_ticks(4) == [0, 1, 2, 3, 4]
    assert find_scale_ticks(300) == [0, 75, 150, 225, 300]
    assert all(np.diff(PALETTE.sum(1)) < 0)  # darker with every step


def test_edges_are_smooth_on_a_gpu_and_at_rest():
    card = Pacing(is_software=False)
    assert card.choose_samples(0.0) == 4
    pacing = Pacing()
    pacing.note(1, 1300.0)  # with all that a first frame makes
    assert [pacing.choose_samples(rested) for rested in (0.0, 0.2, 0.5)] == [1, 1, 4]
    pacing.note(1, 1500.0, 4)  # too long to hold up a hand
    assert pacing.choose_samples(9.0) == 1
    pacing.note(1, 100.0)
    assert pacing.choose_samples(9.0) == 4
    assert pacing.choose_step(True) == 2
