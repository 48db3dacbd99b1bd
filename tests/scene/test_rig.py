"""Tracks between their times, and nodes that hang on one another."""

import numpy as np
import pytest

from umbra.scene.rig import Animation, Rig, Track, make_matrices

HALF = float(np.sqrt(0.5))
EYE = np.eye(4)


def track(what, times, values, way="linear"):
    return Track(0, what, np.array(times, float), np.array(values, float), way)


def test_steps_hold_and_lines_are_straight():
    times, values = [1, 2, 4], [[0, 0, 0], [10, 0, 4], [0, 6, 4]]
    step, line = (track("translation", times, values, way) for way in ("step", "linear"))
    for time, held, between in (
        (0.0, [0, 0, 0], [0, 0, 0]),
        (1.0, [0, 0, 0], [0, 0, 0]),
        (1.75, [0, 0, 0], [7.5, 0, 3]),
        (2.0, [10, 0, 4], [10, 0, 4]),
        (2.5, [10, 0, 4], [7.5, 1.5, 4]),
        (4.0, [0, 6, 4], [0, 6, 4]),
        (99.0, [0, 6, 4], [0, 6, 4]),
    ):
        np.testing.assert_allclose(step.find_value(time), held)
        np.testing.assert_allclose(line.find_value(time), between)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_rotation_takes_the_short_way_on_the_sphere(sign):
    # From none to 90 degrees about y; the same turn may be written with the other sign.
    turn = track("rotation", [0, 3], [[0, 0, 0, 1], [0, sign * HALF, 0, sign * HALF]])
    for share in (0.0, 1 / 3, 0.5, 1.0):
        angle = share * np.pi / 4  # quaternions hold half the angle
        found = turn.find_value(3 * share)
        np.testing.assert_allclose(
            found * np.sign(found[3]), [0, np.sin(angle), 0, np.cos(angle)], atol=1e-15
        )


def test_rotations_that_hardly_differ_and_long_quaternions_stay_of_length_1():
    turn = track("rotation", [0, 1], [[0, 0, 0, 2], [1e-9, 0, 0, 2]])
    np.testing.assert_allclose(turn.find_value(0.5), [2.5e-10, 0, 0, 1], rtol=1e-9)


def test_a_spline_leaves_and_arrives_along_its_tangents():
    # By hand at the middle of 2 s: (v0 + v1) / 2 + 2 (b0 - a1) / 8.
    values = [[[9, 9, 9], [1, 0, 0], [4, 0, 2]], [[0, 8, 2], [3, 0, 0], [9, 9, 9]]]
    spline = track("scale", [1, 3], values, "cubic")
    np.testing.assert_allclose(spline.find_value(2.0), [3, -2, 0])
    np.testing.assert_allclose(spline.find_value(1.0), [1, 0, 0])
    np.testing.assert_allclose(spline.find_value(0.0), [1, 0, 0])
    np.testing.assert_allclose(spline.find_value(3.0), [3, 0, 0])
    # At a quarter: h00 27/32, h10 9/64, h01 5/32, h11 -3/64.
    np.testing.assert_allclose(
        spline.find_value(1.5), [27 / 32 + 2 * 4 * 9 / 64 + 15 / 32, -0.75, 2 * 2 * 6 / 64]
    )
    steep = (spline.find_value(1 + 1e-7) - spline.find_value(1)) / 1e-7
    np.testing.assert_allclose(steep, [4, 0, 2], atol=1e-5)


def test_a_spline_of_rotations_is_brought_back_to_length_1():
    values = np.zeros((2, 3, 4))
    values[:, 1] = [0, 0, 0, 1], [0, 1, 0, 0]
    found = track("rotation", [0, 1], values, "cubic").find_value(0.5)
    np.testing.assert_allclose(found, [0, HALF, 0, HALF])


def test_two_values_at_one_time_jump():
    jump = track("translation", [0, 1, 1, 2], [[0, 0, 0], [1, 0, 0], [5, 0, 0], [6, 0, 0]])
    assert jump.find_value(1.0)[0] == 5
    assert jump.find_value(0.5)[0] == 0.5
    assert jump.find_value(1.5)[0] == 5.5


def test_matrices_scale_then_turn_then_move():
    (matrix,) = make_matrices(
        np.array([[5.0, 6, 7]]), np.array([[0, 0, HALF, HALF]]), np.array([[2.0, 3, 4]])
    )
    # x, doubled, turns to y; y, trebled, turns to -x.
    np.testing.assert_allclose(matrix @ [1, 0, 0, 1], [5, 8, 7, 1], atol=1e-15)
    np.testing.assert_allclose(matrix @ [0, 1, 0, 1], [2, 6, 7, 1], atol=1e-15)
    np.testing.assert_allclose(matrix @ [0, 0, 1, 1], [5, 6, 11, 1], atol=1e-15)
    (still,) = make_matrices(np.zeros((1, 3)), np.zeros((1, 4)), np.ones((1, 3)))
    np.testing.assert_array_equal(still, EYE)


def test_nodes_hang_on_their_parents():
    # A chain of three, each a metre up its parent; the first turns 90 degrees about z.
    rig = Rig(
        np.array([-1, 0, 1]),
        np.tile([0.0, 1, 0], (3, 1)),
        np.tile([0.0, 0, 0, 1], (3, 1)),
        np.ones((3, 3)),
        {},
        EYE,
    )
    places, weights = rig.place()
    np.testing.assert_array_equal(places[:, :3, 3], [[0, 1, 0], [0, 2, 0], [0, 3, 0]])
    assert weights == {}
    turn = Track(0, "rotation", np.array([0.0]), np.array([[0, 0, HALF, HALF]]))
    raise_ = Track(2, "weights", np.array([0.0]), np.array([[0.25, 1.0]]))
    places, weights = rig.place((turn, raise_), 0.0)
    np.testing.assert_allclose(places[:, :3, 3], [[0, 1, 0], [-1, 1, 0], [-2, 1, 0]], atol=1e-15)
    assert weights[2].tolist() == [0.25, 1.0]
    assert Animation("", (turn, raise_)).duration == 0
    # What was moved is not moved for good.
    np.testing.assert_array_equal(rig.place()[0][:, :3, 3], [[0, 1, 0], [0, 2, 0], [0, 3, 0]])
