"""Lights: how far, how wide and how bright."""

import numpy as np
import pytest

from umbra.errors import InputError
from umbra.scene import Light, directional_light, make_image, point_light, spot_light


def test_a_plain_light_is_as_bright_everywhere():
    for light in (
        point_light((0, 0, 5), (1, 0.5, 0.25)),
        directional_light((0, 0, 5), (1, 0.5, 0.25)),
    ):
        np.testing.assert_array_equal(
            light.find_intensity(np.array([[0, 0, 5.0], [9e9, 0, 0]])), [[1, 0.5, 0.25]] * 2
        )
    halved = point_light((0, 0, 5), attenuation=(2, 0, 0))
    np.testing.assert_array_equal(halved.find_intensity(np.zeros((1, 3))), [[0.5, 0.5, 0.5]])


def test_attenuation_divides_by_its_polynomial():
    # At 2 m: 0.5 + 3 * 2 + 0.25 * 4 = 7.5; at 4 m: 0.5 + 12 + 4 = 16.5.
    light = point_light((1, 0, 0), (3, 0, 6), attenuation=(0.5, 3, 0.25))
    found = light.find_intensity(np.array([[1, 2, 0], [1, 0, -4.0]]))
    np.testing.assert_allclose(found, [[3 / 7.5, 0, 6 / 7.5], [3 / 16.5, 0, 6 / 16.5]])


def test_a_lamp_that_is_touched_is_bright_but_finite():
    light = point_light((1, 2, 3), attenuation=(0, 0, 1))
    assert np.isfinite(light.find_intensity(np.array([1.0, 2, 3]))).all()


def test_range_fades_and_ends():
    light = point_light((0, 0, 0), range=2.0)
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1.9999, 0], [0, 0, 2.0], [0, 0, 5]])
    assert light.is_within(points).tolist() == [True, True, True, False, False]
    # Half way 1 - 1/16.
    np.testing.assert_allclose(
        light.find_intensity(points)[:, 0], [1, 15 / 16, 2e-4, 0, 0], atol=1e-7
    )


def test_a_cone_fades_from_the_inner_angle_to_its_rim():
    straight = np.array([0, 0, -1.0])
    light = spot_light((0, 0, 10), (0, 0, 0), 60, inner_angle=0)
    # cos 60 is 0.5: where the cosine is 0.75 the light is (0.25 / 0.5)^2.
    side = np.array([np.sqrt(1 - 0.75**2), 0, -0.75])
    rim = np.array([np.sin(np.pi / 3), 0, -0.5])
    points = np.array([0, 0, 10]) + 4 * np.stack([straight, side, 1.0001 * rim - [1e-3, 0, 0]])
    np.testing.assert_allclose(light.find_intensity(points)[:, 0], [1, 0.25, 0], atol=1e-6)
    sharp = spot_light((0, 0, 10), (0, 0, 0), 60)
    assert sharp.is_within(points).all()
    np.testing.assert_array_equal(sharp.find_intensity(points)[:, 0], 1)
    wider = np.array([[4.0, 0, 8]])  # 63.4 degrees off
    assert not sharp.is_within(wider).any()
    assert not sharp.find_intensity(wider).any()


def test_a_projected_picture_stands_upright():
    # From 1 m before a wall in the south: looking north, east is right and z is up.
    pixels = np.zeros((2, 2, 3), np.uint8)
    pixels[0, 0] = 255, 0, 0  # upper left
    pixels[1, 1] = 0, 0, 255  # lower right
    light = spot_light((0, 0, 0), (0, 5, 0), 45, (1, 1, 0.5), image=make_image(pixels))
    np.testing.assert_allclose(light.axes(), [[1, 0, 0], [0, 0, 1], [0, 1, 0]], atol=1e-15)
    # The square is 2 m wide at 1 m: texel centres half a metre from the axis.
    wall = np.array([[-0.5, 1, 0.5], [0.5, 1, 0.5], [0.5, 1, -0.5], [-1, 2, 1], [0, 1, 0]])
    found = light.find_intensity(wall)
    red, blue, mixed = (1, 0, 0), (0, 0, 0.5), (0.25, 0, 0.125)
    np.testing.assert_allclose(found, [red, (0, 0, 0), blue, red, mixed], atol=1e-12)
    down = spot_light((0, 0, 5), (0, 0, 0), 45, image=make_image(pixels))
    np.testing.assert_allclose(down.axes(), [[1, 0, 0], [0, 1, 0], [0, 0, -1]], atol=1e-15)


def test_an_axis_is_made_a_unit_vector():
    light = Light((0, 0, 0, 1), axis=(0, 3, 4), half_angle=30)
    np.testing.assert_allclose(light.axis, (0, 0.6, 0.8))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"color": (1, 1)}, "color is three finite numbers"),
        ({"color": (1, 1, -0.1)}, "color is three finite numbers"),
        ({"color": (1, np.nan, 0)}, "color is three finite numbers"),
        ({"attenuation": (1, 0)}, "attenuation is three finite numbers"),
        ({"attenuation": (0, 0, 0)}, "infinitely bright"),
        ({"attenuation": (1, -1, 0)}, "attenuation is three finite numbers"),
        ({"range": 0}, "range must be above 0"),
        ({"range": np.nan}, "range must be above 0"),
        ({"axis": (0, 0, 0)}, "axis needs three finite numbers, not all 0"),
        ({"axis": (0, 1)}, "axis needs three finite numbers"),
        ({"axis": (0, 0, 1), "half_angle": 0}, "half angle"),
        ({"axis": (0, 0, 1), "half_angle": 30, "inner_angle": 31}, "inner angle from 0 to it"),
        ({"up": (0, 0, np.inf)}, "up needs three finite numbers"),
        ({"position": (0, 0, 1, 0), "range": 5}, "neither range nor cone"),
        ({"position": (0, 0, 1, 0), "axis": (0, 0, 1)}, "neither range nor cone"),
    ],
)
def test_lights_that_make_no_sense_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Light(**{"position": (0, 0, 0, 1)} | wrong)


def test_only_a_cone_projects_a_picture():
    image = make_image(np.zeros((1, 1, 3), np.uint8), "slide")
    with pytest.raises(InputError, match=r"'slide' is projected by a spot light .* no axis"):
        Light((0, 0, 0, 1), image=image)
    with pytest.raises(InputError, match="half angle below 90; this one has 90"):
        spot_light((0, 0, 0), (1, 0, 0), 90, image=image)
