"""Homogeneous polygons over a picture: named pixels, signs, and the test against a surface."""

import numpy as np
import pytest
from support.judge import PLAN

from umbra.cpu.polygons import VolumePolygons, count_polygons
from umbra.rays.depth import bound

SQUARE = np.array([(1, 1, 5, 1), (4, 1, 5, 1), (4, 4, 5, 1), (1, 4, 5, 1)], float)


def count(corners, surface=np.inf, multiplicity=1, nearer=False):
    polygons = VolumePolygons(np.array([corners], float), np.array([multiplicity]))
    return count_polygons(polygons, PLAN, surface, (6, 6), nearer=nearer)


def test_a_square_on_pixel_centres_takes_its_first_row_and_column():
    expected = np.zeros((6, 6), int)
    expected[1:4, 1:4] = 1
    # Seen in the plan its winding is counter-clockwise, with rows going up: it faces away.
    np.testing.assert_array_equal(count(SQUARE), -expected)
    np.testing.assert_array_equal(count(SQUARE[::-1]), expected)
    np.testing.assert_array_equal(count(SQUARE[::-1], multiplicity=7), 7 * expected)


def test_squares_that_share_level_and_upright_edges_cover_each_pixel_once():
    total = sum(
        count(SQUARE + (dx, dy, 0, 0)) for dx in (-3, 0, 3) for dy in (-3, 0, 3)
    )  # fmt: skip
    np.testing.assert_array_equal(total, -np.ones((6, 6), int))


@pytest.mark.parametrize(("surface", "is_nearer"), [(4.0, True), (5.0, False), (6.0, False)])
def test_equal_keys_are_not_nearer(surface, is_nearer):
    assert count(SQUARE, surface, nearer=True).any() == is_nearer
    assert count(SQUARE, surface, nearer=False).any() != is_nearer


def test_a_triangle_that_reaches_to_infinity():
    # From (1, 1) and (1, 4) without end toward +x: three rows from column 1 on.
    expected = np.zeros((6, 6), int)
    expected[1:4, 1:] = 1
    found = count([(1, 1, 5, 1), (1, 4, 5, 1), (1, 0, 0, 0)])
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("factor", [1.0, -2.5])
def test_half_planes_become_bounds(sign, factor):
    def place(a, b, c):
        left, right, rows = np.array([-9.0, 0]), np.array([9.0, 0]), np.array([0.0, 8.0])
        bound(a * factor, b * factor, c * factor, sign, left, right, rows)
        return left.tolist(), right.tolist(), rows.tolist()

    is_positive = sign * factor > 0
    # 2 x - 3 y + 4 = 0 is x = -2 + 1.5 y.
    left, right, rows = place(2.0, -3.0, 4.0)
    assert (left, right)[not is_positive] == [-2.0, 1.5]
    assert (left, right)[is_positive] == ([9.0, 0] if is_positive else [-9.0, 0])
    assert rows == [0.0, 8.0]
    # Level lines: y >= 2.5 leaves rows from 3 on, y < 2.5 those before; y = 3 belongs to the first.
    assert place(0.0, 1.0, -2.5)[2] == ([3.0, 8.0] if is_positive else [0.0, 3.0])
    assert place(0.0, 1.0, -3.0)[2] == ([3.0, 8.0] if is_positive else [0.0, 3.0])
    # No line at all: everything, or nothing.
    first, end = place(0.0, 0.0, 1.0)[2]
    assert (first < end) == is_positive
