"""The land far away as a part of the exact sky."""

import math

import numpy as np
import pandas as pd
import pytest
from support.shapes import box

import umbra
from umbra.sun import find_sun

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna", true_north=25.0)
TURN = math.radians(30)


@pytest.fixture(scope="module")
def scene():
    return umbra.make_scene(*box((-5, -5, 0), (5, 5, 10)), name="house")


@pytest.fixture(scope="module")
def ring():
    return pd.Series(30.0, index=np.arange(0.0, 360.0, 45.0))


@pytest.fixture(scope="module")
def rough():
    """Land of 2 to 14 degrees with a step, every 4 degrees."""
    high = 8 + 6 * np.sin(np.radians(np.arange(90) * 23.0))
    high[20:30] = 2.0
    return pd.Series(high, index=np.arange(90) * 4.0)


def test_a_ring_in_closed_form(scene, ring):
    """Of a level plane and a wall in a ring of 30 degrees."""
    sky = umbra.sky_view(scene, (0, -900, 0), site=SITE, horizon=ring)
    assert sky.sky_view_factor == pytest.approx(math.cos(TURN) ** 2, abs=2e-5)
    level = (math.cos(TURN) ** 2 / 3 + 4 / 9 * (1 - math.sin(TURN) ** 3)) / (7 / 9)
    assert sky.sky_component == pytest.approx(100 * level, abs=2e-3)
    assert sky.blocked_by["land"] + sky.blocked_by["house"] == pytest.approx(1 - level, abs=2e-5)
    wall = umbra.sky_view(scene, (0, 900, 0), (0, 1, 0), SITE, horizon=ring).sky_view_factor
    free = (math.pi / 2 - TURN - math.sin(TURN) * math.cos(TURN)) / math.pi
    assert wall == pytest.approx(free, abs=2e-5)


def test_its_edge_is_the_horizon(scene, rough):
    sky = umbra.sky_view(scene, (0, -300, 0), site=SITE, horizon=rough)
    azimuth, elevation = sky.horizon(1.0)
    bare = umbra.sky_view(scene, (0, -300, 0), site=SITE).horizon(1.0)[1]
    land = np.interp(azimuth, rough.index, rough.values, period=360)
    assert np.abs(elevation - np.maximum(land, bare)).max() < 6e-3
    # The free sky's outlines say what is behind each edge.
    assert {part for one in sky.outlines for part in one.part} == {"land"}


def test_the_sun_comes_out_of_it(scene, rough):
    sky = umbra.sky_view(scene, (0, -300, 0), site=SITE, horizon=rough)
    spells = sky.sun("2026-03-21")
    assert {spells[0].out_of, spells[-1].behind} == {"land"}
    times = pd.DatetimeIndex([spells[0].start, spells[-1].end])
    sun = find_sun(SITE, times.tz_convert("UTC").tz_localize(None).to_numpy())
    land = np.interp(sun.azimuth, rough.index, rough.values, period=360)
    assert np.allclose(sun.altitude, land, atol=0.005)


def test_power_behind_the_land(scene, rough):
    times = pd.date_range("2026-03-21", periods=48, freq="30min", tz="UTC")
    points = [(0, -300, 0), (0, -8, 0)]
    plain = umbra.sun_access(scene, points, times, SITE)
    land = umbra.sun_access(scene, points, times, SITE, horizon=rough)
    edge = np.interp(land.azimuth, rough.index, rough.values, period=360)
    up = land.apparent_elevation > 0
    behind = up & (land.apparent_elevation < edge)
    assert behind.any()
    assert (land.shaded_fraction == np.maximum(plain.shaded_fraction, behind)).all()
    assert np.allclose(land.horizon_elevation, np.maximum(plain.horizon_elevation, edge), atol=6e-3)
    sky = umbra.sky_view(scene, points[1], site=SITE, horizon=rough)
    found = land.xs(1, level="point").sky_diffuse_fraction
    assert np.allclose(found, sky.sky_view_factor, atol=1e-9)
    assert (found < plain.xs(1, level="point").sky_diffuse_fraction - 0.01).all()


def test_parts_of_its_name(ring):
    scene = umbra.make_scene(*box((-5, -5, 0), (5, 5, 10)), name="land")
    blocked = umbra.sky_view(scene, (0, -12, 0), site=SITE, horizon=ring).blocked_by
    assert len(blocked) == 2
    assert "horizon/land" in blocked
