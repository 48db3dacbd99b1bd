"""Lights with a size: spread evenly, the same each time, as bright as one."""

import numpy as np
import pytest

from umbra.errors import InputError
from umbra.scene import area_light, sphere_light, volume_light


def places(lights):
    return np.array([light.position[:3] for light in lights])


def count_cells(shares, per_side):
    """Give the number of points in each cell of a square or a cube."""
    cells = np.floor(shares * per_side).astype(int)
    return np.bincount(
        np.ravel_multi_index(cells.T, [per_side] * shares.shape[1]),
        minlength=per_side ** shares.shape[1],
    )


def test_an_area_light_fills_its_parallelogram():
    lights = area_light((10, 20, 30), (2, 0, 0), (1, 4, 0), 256, (3, 2, 1), range=50.0)
    assert len(lights) == 256
    offsets = places(lights) - (10, 20, 30)
    assert not offsets[:, 2].any()
    shares = np.stack([(offsets[:, 0] - offsets[:, 1] / 4) / 2, offsets[:, 1] / 4], 1) + 0.5
    assert (shares >= 0).all()
    assert (shares < 1).all()
    # 16 points a cell on the average; by chance alone some cell would have under 7.
    counts = count_cells(shares, 4)
    assert counts.min() >= 12
    assert counts.max() <= 20
    np.testing.assert_allclose(sum(np.array(light.color) for light in lights), (3, 2, 1))
    assert {light.range for light in lights} == {50.0}


def test_lights_stand_in_no_rows_and_in_the_same_places_each_time():
    first, again = (places(area_light((0, 0, 0), (1, 0, 0), (0, 1, 0), 64)) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    for axis in (0, 1):
        assert len(np.unique(np.round(first[:, axis], 4))) == 64


def test_a_volume_light_fills_its_box():
    lights = volume_light((1, 1, 1), (2, 0, 0), (0, 2, 0), (0, 0, 2), 512)
    counts = count_cells(places(lights) / 2, 2)
    assert counts.sum() == 512
    assert counts.min() >= 56
    assert counts.max() <= 72


def test_a_sphere_light_fills_its_ball_evenly():
    offsets = places(sphere_light((5, 0, 0), 2.0, 2000)) - (5, 0, 0)
    away = np.linalg.norm(offsets, axis=1)
    assert away.max() <= 2
    # The inner ball of half the radius has an eighth of the volume.
    assert (away < 1).sum() == pytest.approx(250, abs=20)
    octants = np.bincount(((offsets > 0) * [1, 2, 4]).sum(1), minlength=8)
    assert octants.min() > 230
    assert octants.max() < 270


def test_one_point_stands_in_the_middle():
    (light,) = area_light((1, 2, 3), (1, 0, 0), (0, 1, 0), 1)
    np.testing.assert_array_equal(light.position, (1, 2, 3, 1))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: area_light((0, 0), (1, 0, 0), (0, 1, 0)), "area light's middle needs three"),
        (lambda: area_light((0, 0, 0), (1, 0, np.nan), (0, 1, 0)), "three finite numbers"),
        (lambda: area_light((0, 0, 0), (1, 0, 0), (0, 1, 0), 0), "a light of 0 points"),
        (lambda: sphere_light((0, 0, 0), 0), "radius must be above 0"),
        (lambda: sphere_light((0, 0, 0), 1, 1 << 21), "not possible"),
    ],
)
def test_lights_of_no_size_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
