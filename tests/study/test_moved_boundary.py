"""The boundary of a plot moved across the roads and water beside it: Japan's numbers by hand."""

import numpy as np
import pytest
import shapely

from umbra.receivers.moved_boundary import move_boundary

PLOT = shapely.box(0, 0, 20, 15)
LONG = 200.0


def road(width, gap=0.0):
    """A road along the south side."""
    return shapely.box(-LONG, -gap - width, LONG, -gap)


# RULES.md: roads of 6, 10 and 16 m, and a railway of 20 m.
MOVES = [(4, 2.0), (6, 3.0), (10, 5.0), (16, 11.0), (20, 15.0)]


@pytest.mark.parametrize(("width", "move"), MOVES)
@pytest.mark.parametrize("turn", [0.0, 33.0])
def test_a_road_beside_a_side_moves_it(width, move, turn):
    expected = shapely.box(0, -move, 20, 15)
    shapes = [shapely.affinity.rotate(one, turn, (0, 0)) for one in (PLOT, road(width), expected)]
    moved, ((length, wide, by),) = move_boundary(*shapes[:2])
    assert shapely.symmetric_difference(moved, shapes[2]).area < 1e-6
    assert (length, wide, by) == pytest.approx((20, width, move))


def test_a_road_that_is_as_long_as_the_side_or_shorter():
    for low, high in ((0, 20), (5, 12)):
        moved, _ = move_boundary(PLOT, shapely.box(low, -6, high, 0))
        expected = PLOT.union(shapely.box(low, -3, high, 0))
        assert shapely.symmetric_difference(moved, expected).area < 1e-6


def test_two_roads_at_a_corner_meet_as_their_parallels_do():
    roads = shapely.union(road(6), shapely.box(20, -LONG, 36, LONG))
    moved, frontages = move_boundary(PLOT, roads)
    assert shapely.symmetric_difference(moved, shapely.box(0, -3, 31, 15)).area < 1e-6
    assert sorted(by for _, _, by in frontages) == pytest.approx([3, 11])


def test_roads_and_water_that_touch_are_as_wide_as_both():
    both = shapely.union(road(6), shapely.box(-LONG, -16, LONG, -6))
    assert move_boundary(PLOT, both)[0].bounds[1] == pytest.approx(-11)
    apart = shapely.union(road(6), shapely.box(-LONG, -16, LONG, -7))
    assert move_boundary(PLOT, apart)[0].bounds[1] == pytest.approx(-3)


def test_a_side_street_opposite_moves_nothing_more():
    roads = shapely.union(road(6), shapely.box(8, -100, 12, 0))
    moved, _ = move_boundary(PLOT, roads)
    assert shapely.symmetric_difference(moved, shapely.box(0, -3, 20, 15)).area < 1e-6


def test_a_road_that_widens_moves_each_place_by_its_own_width():
    wedge = shapely.Polygon([(0, 0), (20, 0), (20, -8), (0, -6)])
    moved, _ = move_boundary(PLOT, wedge)
    expected = shapely.Polygon([(0, 15), (0, -3), (20, -4), (20, 15)])
    assert shapely.symmetric_difference(moved, expected).area < 0.01


def test_a_map_may_leave_a_gap_before_a_road_and_a_road_farther_away_moves_nothing():
    moved, _ = move_boundary(PLOT, road(6, gap=0.3))
    assert moved.bounds[1] == pytest.approx(-3.3)
    for none in (road(6, gap=2.0), shapely.Polygon()):
        same, frontages = move_boundary(PLOT, none)
        assert same.equals(PLOT)
        assert frontages == []


def test_another_width_up_to_which_half_counts():
    assert move_boundary(PLOT, road(16), half_up_to=20)[0].bounds[1] == pytest.approx(-8)


def test_a_curved_frontage_has_no_notches():
    turns = np.radians(np.arange(0, 360, 6))
    circle = np.stack([np.cos(turns), np.sin(turns)], 1)
    plot, ring = (shapely.Polygon(radius * circle) for radius in (20, 26))
    moved, _ = move_boundary(plot, ring.difference(plot))
    expected = shapely.Polygon(23 * circle)
    assert shapely.symmetric_difference(moved, expected).area < 0.02 * (expected.area - plot.area)
    assert len(shapely.get_parts(moved)) == 1
    assert not moved.interiors
