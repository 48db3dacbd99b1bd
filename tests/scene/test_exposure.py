"""Lights in candela and lux, brought to what a picture can show."""

import numpy as np
import pytest
from support.shapes import box

from umbra.scene import directional_light, make_scene, point_light
from umbra.scene.exposure import expose_lights

# A cube of 2 m about (0, 0, 1): its diagonal is 3.46 m.
CUBE = box((-1, -1, 0), (1, 1, 2))
SQUARE = (0.0, 0.0, 1.0)


def test_the_brightest_light_becomes_1_and_the_others_keep_their_share():
    lamp = point_light((0, 0, 11), (800, 400, 0), attenuation=SQUARE, range=99.0)
    sun = directional_light((0, 0, 1), (2, 2, 2))
    scene = make_scene(*CUBE, lights=(lamp, sun))
    # 10 m off the lamp gives 8 lux, four times what the sun gives.
    first, second = expose_lights(scene)
    middle = np.array([0.0, 0, 1])
    fade = 1 - (10 / 99) ** 4
    np.testing.assert_allclose(first.find_intensity(middle), [fade, 0.5 * fade, 0])
    np.testing.assert_allclose(second.color, [0.25] * 3)
    assert first.range == 99


def test_a_lamp_in_the_midst_is_not_blinding():
    scene = make_scene(*CUBE, lights=(point_light((0, 0, 1), (5, 5, 5), attenuation=SQUARE),))
    (lamp,) = expose_lights(scene)
    assert lamp.color[0] == pytest.approx(12 / 16)  # at sqrt(12) / 4 m


def test_dark_lights_and_none_are_left_alone():
    dark = (point_light((0, 0, 5), (0, 0, 0)),)
    assert expose_lights(make_scene(*CUBE, lights=dark)) == dark
    assert expose_lights(make_scene(*CUBE)) == ()
