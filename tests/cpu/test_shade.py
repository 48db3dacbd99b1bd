"""Shades by hand: cosines, ranges, cones, what glows and what is unlit."""

import numpy as np
import pytest
from support.shapes import sheet

from umbra.cpu.frame import FrameCounter
from umbra.cpu.shade import shade
from umbra.scene import Camera, Material, Mesh, Part, make_scene, point_light, spot_light
from umbra.scene.exposure import FROM_SKY

# A floor of 20 x 20 m from 10 m above, in 20 x 20 pixels of 1 m.
FLOOR = sheet([(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0)])
CAMERA = Camera((0, 0, 10), (0, 0, 0), up=(0, 1, 0), size=(20, 20), height=20.0)


def draw(light, **material):
    scene = make_scene([Part("floor", "", Mesh(*FLOOR), None, Material(**material))])
    counter = FrameCounter(scene)
    view, frame = counter.see(CAMERA)
    lit = frame.lit(counter.count(view, CAMERA, light), light)
    return frame, lit, shade(scene, frame, [light], [lit])


def encode(linear):
    value = np.clip(linear, 0, 1)
    return np.round(
        255 * np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    )


def test_a_lamp_with_attenuation_and_range():
    light = point_light((0, 0, 4), (1, 0.5, 0), attenuation=(1, 0, 0.1), range=6.0)
    frame, lit, picture = draw(light, color=(0.5, 0.5, 0.5))
    distance = np.linalg.norm(frame.position - (0, 0, 4), axis=-1)
    np.testing.assert_array_equal(lit, distance < 6)
    assert 0 < lit.sum() < lit.size
    amount = 0.8 * (4 / distance) * (1 - (distance / 6) ** 4) / (1 + 0.1 * distance**2)
    energy = FROM_SKY + np.where(lit, amount, 0)[..., None] * (1, 0.5, 0)
    np.testing.assert_allclose(picture, encode(0.5 * energy), atol=1)


def test_a_cone_ends_in_darkness():
    light = spot_light((0, 0, 4), (0, 0, 0), 45, range=100.0)
    frame, lit, _ = draw(light)
    np.testing.assert_array_equal(lit, np.hypot(*np.moveaxis(frame.position, -1, 0)[:2]) <= 4)


def test_what_glows_adds_its_own_light():
    dark = point_light((0, 0, -4))  # below the floor
    _, lit, picture = draw(dark, color=(0.5, 0.5, 0.5), emission=(0.25, 0, 0.5))
    assert not lit.any()
    expected = encode(0.5 * FROM_SKY + np.array([0.25, 0, 0.5]))
    np.testing.assert_allclose(picture, np.broadcast_to(expected, picture.shape), atol=1)


@pytest.mark.parametrize("height", [4, -4])
def test_what_is_unlit_shows_its_colour_in_light_and_in_shadow(height):
    _, _, picture = draw(point_light((0, 0, height)), color=(0.5, 0.25, 1), is_unlit=True)
    expected = encode(np.array([0.5, 0.25, 1]))
    np.testing.assert_allclose(picture, np.broadcast_to(expected, picture.shape), atol=1)
