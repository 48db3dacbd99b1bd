"""Area lights and the points that stand for them."""

import numpy as np
import pytest

from umbra.errors import InputError
from umbra.scene import directional_light, point_light
from umbra.soft import SUN_RADIUS, ball_light, rectangle_light

LAMP = point_light((1, 2, 7), (1.0, 0.5, 0.25), range=30.0)


def places(light, n=4096):
    return np.array([point.position[:3] for point in light.points(n)])


@pytest.mark.parametrize("way", [(0, 0, 1), (1, 0, 0), (1, -2, 0.5)])
def test_a_ball_looks_like_an_even_disc_from_every_side(way):
    apart = (places(ball_light(LAMP, 2.0)) - (1, 2, 7)) / 2.0
    way = np.array(way) / np.linalg.norm(way)
    across = np.linalg.norm(apart - np.outer(apart @ way, way), axis=1)
    assert across.max() <= 1
    # An even disc has a share s² of its points within the radius s; a full ball fewer.
    for s in (0.3, 0.5, 0.7, 0.9):
        assert (across < s).mean() == pytest.approx(s * s, abs=0.015)
    np.testing.assert_allclose(apart.mean(0), 0, atol=0.01)


def test_the_points_of_a_rectangle_fill_it():
    found = places(rectangle_light(LAMP, (4, 0, 0), (0, 0, 2)))
    np.testing.assert_allclose(found[:, 1], 2.0)
    np.testing.assert_allclose(found.min(0), (-1, 2, 6), atol=0.02)
    np.testing.assert_allclose(found.max(0), (3, 2, 8), atol=0.02)
    for axis, low, length in ((0, -1, 4), (2, 6, 2)):
        shares = np.histogram((found[:, axis] - low) / length, 8, (0, 1))[0] / 4096
        np.testing.assert_allclose(shares, 1 / 8, atol=0.005)


def test_the_sun_is_a_disc_of_half_a_degree():
    sun = ball_light(directional_light((0, -3, 4)), SUN_RADIUS)
    found = sun.points(1024)
    assert not any(point.is_point for point in found)
    ways = np.array([point.position[:3] for point in found])
    cosine = ways @ (0, -0.6, 0.8) / np.linalg.norm(ways, axis=1)
    assert np.degrees(np.arccos(cosine.min())) == pytest.approx(0.2665, rel=0.01)
    assert (cosine > np.cos(np.radians(0.2665 / 2))).mean() == pytest.approx(0.25, abs=0.01)


def test_points_keep_what_the_light_is_and_come_out_alike():
    light = ball_light(LAMP, 0.5)
    one, two = light.points(7), light.points(7)
    assert [p.color for p in one] == [LAMP.color] * 7
    assert {p.range for p in one} == {30.0}
    np.testing.assert_array_equal([p.position for p in one], [p.position for p in two])


def test_a_light_moves_by_its_own_radius():
    moved = ball_light(LAMP, 0.5).moved(np.array([0, 0, 2]))
    np.testing.assert_allclose(moved.light.position, (1, 2, 8, 1))
    assert moved.radius == 0.5
    sun = ball_light(directional_light((0, 0, 9)), 45 / 2).moved(np.array([1, 0, 0]))
    np.testing.assert_allclose(sun.light.position, (np.tan(np.pi / 8), 0, 1, 0))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ball_light(LAMP, 0.0), "above 0; got 0"),
        (lambda: ball_light(LAMP, np.nan), "above 0; got nan"),
        (lambda: ball_light(directional_light((0, 0, 1)), 45.0), "below 45 degrees; got 45"),
        (lambda: rectangle_light(LAMP, (1, 0, 0), (2, 0, 0)), "span an area"),
        (lambda: rectangle_light(LAMP, (1, 0, np.inf), (2, 0, 0)), "finite"),
        (lambda: rectangle_light(directional_light((0, 0, 1)), (1, 0, 0), (0, 1, 0)), "disc"),
        (lambda: ball_light(LAMP, 1.0).points(0), "0 points"),
    ],
)
def test_what_is_no_light_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
