"""What a level view sees of the inside of the earth has no hours: it is no place for the sun."""

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene

SITE = umbra.Site(48.2, 16.4, "Europe/Vienna")
DATE = {"date": "2026-03-21", "start": "10:00", "end": "14:00", "every": "1h"}
WIDE, RISE = 60.0, 20.0  # of land that rises northward [m]


@pytest.fixture(scope="module")
def slope():
    """Land with a house of 10 m that stands 4 m deep in it at its foot; its roof is at 18 m."""
    corners = np.array([[0, 0, 0], [WIDE, 0, 0], [WIDE, WIDE, RISE], [0, WIDE, RISE]], float)
    land = Part("land", "TINRelief", Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32)))
    house = Part("house", "Building", Mesh(*box((20, 36, 8), (32, 48, 18))))
    tower = Part("tower", "Building", Mesh(*box((40, 20, 5), (44, 24, 30))))
    return make_scene([land, house, tower])


def count(scene, receivers):
    return umbra.shadow_study(scene, SITE, receivers=receivers, cell=0.5, **DATE)


def test_from_the_north_the_land_hides_what_is_below_its_edge(slope):
    study = count(slope, "north")
    has_hours = np.isfinite(study.sun_hours.values)
    z, along = np.meshgrid(study.dataset.z, study.dataset.along, indexing="ij")
    # The tower alone rises above the edge; x is to the left.
    is_tower = (z > RISE) & (z < 30) & (np.abs(-along - 42) < 2)
    np.testing.assert_array_equal(has_hours, is_tower)


def test_from_the_south_all_of_the_land_has_hours(slope):
    study = count(slope, "south")
    z, along = np.meshgrid(study.dataset.z, study.dataset.along, indexing="ij")
    is_land = (z > 0) & (z < RISE) & (along > 0) & (along < WIDE)
    assert np.isfinite(study.sun_hours.values[is_land]).all()


def test_from_the_side_a_cellar_has_no_hours(slope):
    study = count(slope, "east")
    z, along = np.meshgrid(study.dataset.z, study.dataset.along, indexing="ij")
    y = along  # north is to the right
    house = (np.abs(y - 42) < 6) & (np.abs(z - 13) < 5)
    tower = (np.abs(y - 22) < 2) & (np.abs(z - 17.5) < 12.5)
    above = z - y / 3
    is_clear = np.abs(above) > 0.3
    has_hours = np.isfinite(study.sun_hours.values)
    inside = (house | tower) & is_clear
    np.testing.assert_array_equal(has_hours[inside], above[inside] > 0)
    assert (above[inside] < 0).sum() > 200
    assert not has_hours[~(house | tower)].any()


def test_without_land_a_cellar_keeps_its_hours(slope):
    study = count(slope["house"], "east")
    seen = np.isfinite(study.sun_hours.values)
    assert seen.sum() == pytest.approx(12 * 10 / 0.25, rel=0.1)
