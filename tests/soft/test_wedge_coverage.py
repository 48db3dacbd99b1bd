"""The closed forms against areas that anyone can work out, and against many points."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.sweeps import reduce_count

from umbra.soft.light_edges import make_coverage_planes
from umbra.soft.parts import find_disc_part, find_square_part

ROOM = np.zeros((8, 2)), np.zeros((8, 2))
FAR = 1e6


def square(ax, ay, bx, by):
    return find_square_part(ax, ay, bx, by, *ROOM)


def test_a_long_edge_cuts_off_a_segment_of_the_disc():
    # Beyond x = 1/2 lies a segment of the angle 2 pi / 3: its share is 1/3 - sqrt(3) / (4 pi).
    expected = 1 / 3 - math.sqrt(3) / (4 * math.pi)
    assert find_disc_part(0.5, -FAR, 0.5, FAR) == pytest.approx(expected)
    assert find_disc_part(0.5, FAR, 0.5, -FAR) == pytest.approx(expected)  # whichever way
    assert find_disc_part(0.0, -FAR, 0.0, FAR) == pytest.approx(0.5)
    assert find_disc_part(1.0, -FAR, 1.0, FAR) == 0


def test_a_short_edge_takes_only_its_own_angle():
    # From (1/2, 0) upward: half of that segment. Within 45 degrees of a chord at 0: nothing more.
    expected = 1 / 3 - math.sqrt(3) / (4 * math.pi)
    assert find_disc_part(0.5, 0, 0.5, FAR) == pytest.approx(expected / 2)
    # A right angle whose edge is the chord x + y = 1: quarter disc less its triangle.
    assert find_disc_part(1, 0, 0, 1) == pytest.approx((math.pi / 4 - 0.5) / math.pi)


def test_edges_over_the_square():
    assert square(0.5, -FAR, 0.5, FAR) == pytest.approx(0.25)
    assert square(0.5, 0.0, 0.5, FAR) == pytest.approx(0.125)
    assert square(-FAR, -0.5, FAR, -0.5) == pytest.approx(0.25)
    # The quadrant x, y > 0 beyond x + y = 1: 1 - 1/2 of an area of 4.
    assert square(1, 0, 0, 1) == pytest.approx(0.125)
    assert square(2, 0, 0, 2) == pytest.approx(0, abs=1e-15)
    assert square(1, 1, 3, 3) == 0  # its line passes the middle: no angle


coordinate = st.floats(-2, 2).map(lambda x: round(x, 3))


@given(coordinate, coordinate, coordinate, coordinate)
@settings(max_examples=reduce_count(200, 2), deadline=None)
def test_parts_are_the_share_of_points_in_the_angle_and_beyond_the_edge(ax, ay, bx, by):
    grid = (np.arange(400) + 0.5) / 200 - 1
    x, y = np.meshgrid(grid, grid)
    side = np.sign(ax * by - ay * bx)
    inside = (side * (ax * y - ay * x) >= 0) & (side * (x * by - y * bx) >= 0)
    inside &= side * ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) <= 0
    inside &= side != 0
    assert square(ax, ay, bx, by) == pytest.approx(inside.mean(), abs=0.006)
    disc = x * x + y * y <= 1
    found = find_disc_part(ax, ay, bx, by)
    if side:
        assert found == pytest.approx(inside[disc].mean(), abs=0.008)
    assert -1e-12 <= found <= 0.5 + 1e-12


def test_wedge_planes_hold_every_ray_from_the_light_past_the_edge():
    rng = np.random.default_rng(5)
    lamp, sky = np.array([0.3, -0.2, 9, 1]), np.array([0.0, 0.6, 0.8, 0])
    for light, radius in ((lamp, 1.5), (sky, 0.2)):
        ends = rng.normal(size=(50, 6))
        planes = np.zeros((50, 4, 4))
        make_coverage_planes(ends, light, radius, planes)
        np.testing.assert_allclose(np.linalg.norm(planes[..., :3], axis=-1), 1)
        ways = rng.normal(size=(400, 3))
        ways *= radius / np.linalg.norm(ways, axis=1, keepdims=True)
        if light[3] == 0:
            ways -= np.outer(ways @ light[:3], light[:3])
        tightest = np.full((50, 4), -np.inf)
        for share, far in zip(rng.random(400).round(1), rng.exponential(2, 400)):
            on = ends[:, :3] + share * (ends[:, 3:] - ends[:, :3])
            for way in ways[:40]:
                behind = on + far * ((on if light[3] else 0) - light[:3] - way)
                heights = np.einsum("ijk,ik->ij", planes[..., :3], behind) + planes[..., 3]
                assert heights.max() < 1e-9
                tightest = np.maximum(tightest, heights / max(far, 1e-9))
        # They touch the light: nothing much tighter would do.
        assert np.median(tightest) > -0.5 * radius


def test_an_edge_whose_line_meets_the_light_is_not_bounded():
    planes = np.ones((2, 4, 4))
    ends, light = [(0, 0, 1, 0, 0, 3), (1, 1, 1, 1, 1, 1)], [0, 0, 9.0, 1]
    make_coverage_planes(np.array(ends, float), np.array(light),
                0.5, planes)  # fmt: skip
    assert not planes.any()
