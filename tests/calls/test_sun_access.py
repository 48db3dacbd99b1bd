"""What shades a place at given times, beside closed forms, the sky's own times and pvlib."""

import numpy as np
import pandas as pd
import pytest
from support.shapes import box

import umbra
from umbra.errors import InputError
from umbra.scene import Mesh, Part, make_scene

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
TIMES = pd.date_range("2026-03-21 00:10", periods=140, freq="10min", tz="Europe/Vienna")
PANEL = (0.0, 0.0, 1.0, 0.0, -0.5, 0.8660254037844386)


@pytest.fixture(scope="module")
def scene():
    """An endless wall in the south, seen at 20 degrees, and a tower in the west."""
    top = 1 + 20 * np.tan(np.radians(20))
    boxes = {"wall": ((-1e5, -22, 0), (1e5, -20, top)), "tower": ((-14, -4, 0), (-10, 4, 30))}
    return make_scene([Part(name, "", Mesh(*box(*corners))) for name, corners in boxes.items()])


def test_one_point(scene):
    frame = umbra.sun_access(scene, PANEL, TIMES, SITE)
    assert frame.index.equals(TIMES)
    assert frame.index.name == "time"
    azimuth, elevation = np.radians(frame.azimuth), np.radians(frame.apparent_elevation)
    south = -np.cos(azimuth)
    skyline = np.degrees(np.arctan(np.tan(np.radians(20)) * np.maximum(south, 0)))
    west = frame.azimuth.between(255, 285)
    away = ~frame.azimuth.between(240, 300)
    assert frame.horizon_elevation[away].to_numpy() == pytest.approx(skyline[away], abs=1e-9)
    assert (frame.horizon_elevation[west] > 60).all()
    is_hidden = frame.apparent_elevation <= frame.horizon_elevation
    ahead = np.cos(elevation) * south * 0.5 + np.sin(elevation) * PANEL[5] > 0
    assert np.array_equal(frame.shaded_fraction, (is_hidden | ~ahead).astype(float))
    assert frame.shaded_fraction.nunique() == 2
    view = umbra.sky_view(scene, PANEL[:3], PANEL[3:], SITE)
    share = view.sky_view_factor / ((1 + PANEL[5]) / 2)
    assert frame.sky_diffuse_fraction.to_numpy() == pytest.approx(share, abs=1e-12)


def test_its_hours_are_the_exact_suns(scene):
    times = pd.date_range("2026-03-21", periods=24 * 60, freq="1min", tz="Europe/Vienna")
    free = umbra.sun_access(scene, PANEL, times, SITE).shaded_fraction == 0
    spells = umbra.sky_view(scene, PANEL[:3], PANEL[3:], SITE).sun("2026-03-21")
    inside = np.zeros(len(times), bool)
    for spell in spells:
        inside |= (times >= spell.start) & (times < spell.end)
    assert (free.to_numpy() != inside).sum() <= 1
    assert free.sum() > 200


def test_several_points(scene):
    points = [PANEL, (0.0, 5.0, 1.0, 0.0, 1.0, 0.0)]
    frame = umbra.sun_access(scene, points, TIMES, SITE)
    assert frame.index.names == ["time", "point"]
    for k, point in enumerate(points):
        alone = umbra.sun_access(scene, point, TIMES, SITE)
        pd.testing.assert_frame_equal(frame.xs(k, level="point"), alone, check_freq=False)
    plain = umbra.sun_access(scene, [point[:3] for point in points], TIMES, SITE)
    assert plain.sky_diffuse_fraction.between(0.3, 1).all()


def test_parts_may_be_left_out(scene):
    frame = umbra.sun_access(scene, PANEL, TIMES, SITE, no_cast=["wall", "tower"][1:])
    with_tower = umbra.sun_access(scene, PANEL, TIMES, SITE)
    assert frame.horizon_elevation.max() < 21
    assert with_tower.horizon_elevation.max() > 60


def test_what_pvlib_makes_of_it(scene):
    pvlib = pytest.importorskip("pvlib")
    place = pvlib.location.Location(48.2, 16.37, "Europe/Vienna")
    sun, sky = place.get_solarposition(TIMES), place.get_clearsky(TIMES, model="haurwitz")
    frame = umbra.sun_access(scene, PANEL, TIMES, SITE)
    assert frame.azimuth.to_numpy() == pytest.approx(sun.azimuth.to_numpy(), abs=1e-2)
    poa = pvlib.irradiance.get_total_irradiance(
        30, 180, sun.apparent_zenith, sun.azimuth, sky.ghi, sky.ghi, sky.ghi * 0.2
    )
    direct = poa.poa_direct * (1 - frame.shaded_fraction)
    assert 0.3 * poa.poa_direct.sum() < direct.sum() < 0.99 * poa.poa_direct.sum()


@pytest.mark.parametrize(
    ("points", "times", "site", "option"),
    [
        (PANEL, TIMES.tz_localize(None), SITE, "times"),
        (PANEL, ["never"], SITE, "times"),
        (PANEL, TIMES[:0], SITE, "times"),
        (PANEL, TIMES, None, "site"),
        ((1.0, 2.0), TIMES, SITE, "points"),
    ],
)
def test_what_cannot_be_read(scene, points, times, site, option):
    with pytest.raises(InputError) as caught:
        umbra.sun_access(scene, points, times, site)
    assert getattr(caught.value, "option", None) == option
