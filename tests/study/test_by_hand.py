"""Shadows that can be solved by hand."""

import numpy as np
import pytest
from pyproj import Proj
from support.days import EQUINOX, around, find_noon, parts, pole, wall
from support.model_files import save_city_sequence
from support.shapes import box

import umbra
from umbra.scene import make_scene
from umbra.study import make_preview, run_study
from umbra.study import preview as preview_module
from umbra.sun import find_sun

EQUATOR = umbra.Site(0.0, 0.0, "UTC")


def footprint(result, what="shadow_hours"):
    """Give the bounds of the cells in shadow: xmin, ymin, xmax, ymax of their outer edges."""
    shadow = result[what].values > 0
    dx, dy = np.diff(result.x.values[:2])[0] / 2, np.diff(result.y.values[:2])[0] / 2
    x, y = result.x.values[shadow.any(0)], result.y.values[shadow.any(1)]
    return np.array([x[0] - dx, y[0] - dy, x[-1] + dx, y[-1] + dy])


def area(result):
    cell = np.diff(result.x.values[:2])[0] * np.diff(result.y.values[:2])[0]
    return float((result.shadow_hours.values > 0).sum() * cell)


def test_solar_noon_is_the_almanac_s(noon):
    # Almanac: on 20 March 2026 the equation of time is -7 min 27 s at noon.
    assert abs(noon - np.datetime64("2026-03-20T12:07:27")) <= np.timedelta64(5, "s")


def test_pole_of_10_m_at_45_degrees_casts_10_m_due_north_at_solar_noon(noon, at_45):
    result = umbra.shadow_study(
        pole(10.0, 0.2), at_45, **around(noon), refraction="none",
        extent=(-1, -1, 1, 12), size=(100, 1300),
    )  # fmt: skip
    assert float(result.sun_altitude[0]) == pytest.approx(45, abs=1e-4)
    # From the pole's south face to the shadow of its north edge, 10 m beyond that edge.
    np.testing.assert_allclose(footprint(result), [-0.1, -0.1, 0.1, 10.1], atol=0.0101)
    assert area(result) == pytest.approx(0.2 * 10.2, abs=0.01)


def test_refraction_lifts_the_sun_and_shortens_the_shadow(noon, at_45):
    # Air at 45 degrees lifts the sun by 1 minute of arc: 10 m / sin^2(45) * 0.0164 degrees.
    ends = [
        footprint(
            umbra.shadow_study(
                pole(10.0, 0.2), at_45, **around(noon), refraction=refraction,
                extent=(-0.2, 10, 0.2, 10.2), size=(40, 2000),
            )
        )[3]
        for refraction in ("none", "standard")
    ]  # fmt: skip
    assert ends[0] - ends[1] == pytest.approx(20 * np.radians(0.0164), abs=4e-4)


@pytest.mark.parametrize(
    ("true_north", "bounds"),
    [
        (90.0, [-0.1, -0.1, 10.1, 0.1]),
        (180.0, [-0.1, -10.1, 0.1, 0.1]),
        (-90.0, [-10.1, -0.1, 0.1, 0.1]),
    ],
)
def test_true_north_turns_the_shadow(noon, at_45, true_north, bounds):
    site = umbra.Site(at_45.latitude, 0.0, "UTC", true_north=true_north)
    result = umbra.shadow_study(
        pole(), site, **around(noon), refraction="none", extent=(-12, -12, 12, 12), cell=0.02
    )
    np.testing.assert_allclose(footprint(result), bounds, atol=0.0201)


def test_true_north_turns_clockwise(noon, at_45):
    # North at 30 degrees from +y: the shadow's tip lies at (sin 30, cos 30) x 10 m.
    site = umbra.Site(at_45.latitude, 0.0, "UTC", true_north=30.0)
    result = umbra.shadow_study(
        pole(10.0, 0.02), site, **around(noon), refraction="none",
        extent=(-1, -1, 12, 12), cell=0.01,
    )  # fmt: skip
    np.testing.assert_allclose(footprint(result)[2:], [5.0, 8.66], atol=0.04)


def test_south_of_the_tropic_noon_shadows_fall_south(noon):
    site = umbra.Site(-45.0, 0.0, "UTC")
    result = umbra.shadow_study(
        pole(), site, **around(noon), refraction="none", extent=(-1, -12, 1, 1), size=(100, 1300)
    )
    # The sun stands about 0.1 degrees nearer to the equator than 45 degrees.
    np.testing.assert_allclose(footprint(result), [-0.1, -10.1, 0.1, 0.1], atol=0.05)


@pytest.mark.parametrize("hour", [8, 10, 15])
def test_box_s_shadow_area(hour):
    # Footprint, and height / tan(altitude) times the box's width across the light.
    site = umbra.Site(48.2, 16.37, "UTC")
    instant = np.datetime64(f"2026-05-01T{hour:02}:00:00")
    sun = find_sun(site, instant)
    width, depth, height = 6.0, 4.0, 9.0
    turn = np.radians(sun.azimuth[0])
    across = width * abs(np.cos(turn)) + depth * abs(np.sin(turn))
    length = height / np.tan(np.radians(sun.altitude[0]))
    scene = make_scene(*box((-3, -2, 0), (3, 2, height)))
    result = umbra.shadow_study(
        scene, site, **around(instant), extent=(-22, -22, 22, 22), cell=0.0237
    )
    assert area(result) == pytest.approx(width * depth + length * across, rel=2e-3)


@pytest.mark.parametrize(
    ("distance", "hours"), [(10.0, 3.0), (10 * np.sqrt(1 / 3), 2.0), (10 * np.sqrt(3), 4.0)]
)
def test_minute_at_which_a_place_by_a_wall_comes_into_shadow_and_sun(distance, hours):
    # At the equinox on the equator the sun climbs 15 degrees an hour straight through the
    # zenith: a wall of 10 m along the meridian shades 10 m east of it 3 hours after noon.
    result = umbra.shadow_study(
        wall(10.0), EQUATOR, date=EQUINOX, start="06:30", end="17:45", every="1min",
        refraction="none", extent=(-20, -0.5, 20, 0.5), size=(4000, 2), masks=True,
    )  # fmt: skip
    east = result.in_shadow.sel(x=distance, method="nearest").isel(y=0)
    west = result.in_shadow.sel(x=-0.2 - distance, method="nearest").isel(y=0)
    noon = find_noon()
    away = np.timedelta64(round(hours * 3600), "s")
    a_minute = np.timedelta64(70, "s")  # and half a cell
    first_shadow = result.time.values[np.flatnonzero(east.values)[0]]
    assert abs(first_shadow - (noon + away)) <= a_minute
    assert east.values[np.flatnonzero(east.values)[0] :].all()
    first_sun = result.time.values[np.flatnonzero(west.values == 0)[0]]
    assert abs(first_sun - (noon - away)) <= a_minute
    # And the hours say the same: in shadow from then to the end of the period.
    left = (np.datetime64(f"{EQUINOX}T17:45:00") - (noon + away)) / np.timedelta64(1, "h")
    assert float(result.shadow_hours.sel(x=distance, method="nearest")[0]) == pytest.approx(
        left, abs=1.1 / 60
    )


def test_place_by_a_wall_counts_whole_hours():
    # Every cell's hours of shadow by the formula above, from three hours before to after noon.
    noon = find_noon()
    start, end = (str((noon + np.timedelta64(s, "s")).item().time()) for s in (-10_800, 10_800))
    result = umbra.shadow_study(
        wall(10.0), EQUATOR, date=EQUINOX, start=start, end=end, every="30s",
        refraction="none", extent=(0.5, -0.5, 9.5, 0.5), cell=1.0,
    )  # fmt: skip
    expected = 3 - np.degrees(np.arctan(result.x.values / 10)) / 15
    np.testing.assert_allclose(result.shadow_hours.values[0], expected, atol=0.02)


@pytest.mark.parametrize("faces", [[(0, 1, 3), (0, 3, 2)], [(0, 3, 1), (0, 2, 3)]])
def test_lean_to_roof_comes_out_of_its_own_shadow(faces):
    # A roof that rises 30 degrees to the west, so faces east: the afternoon sun, which
    # falls 15 degrees an hour, leaves it 4 hours after noon. No other thing shades it. What is
    # seen from above decides, whichever way the file winds it.
    vertices = np.array([(0, -5, 1), (0, 5, 1), (-6, -5, 1 + 6 * np.tan(np.pi / 6)),
                         (-6, 5, 1 + 6 * np.tan(np.pi / 6))])  # fmt: skip
    roof = make_scene(vertices, np.array(faces))
    result = umbra.shadow_study(
        roof, EQUATOR, date=EQUINOX, start="06:30", end="17:30", every="1min",
        refraction="none", receivers="top", extent=(-5.5, -4, -0.5, 4), cell=0.5, masks=True,
    )  # fmt: skip
    shaded = result.in_shadow.values.reshape(len(result.time), -1)
    assert (shaded.min(1) == shaded.max(1)).all()
    last_sun = result.time.values[np.flatnonzero(shaded[:, 0] == 0)[-1]]
    assert abs(last_sun - (find_noon() + np.timedelta64(4, "h"))) <= np.timedelta64(1, "m")
    assert shaded[0, 0] == 0  # in the morning it faces the sun


def test_ground_under_and_around_buildings():
    # A block on the ground, and a slab of 4 x 4 m whose top is at 8 m and its underside at 7.
    scene = parts(block=box((0, 0, 0), (4, 4, 6)), slab=box((20, 0, 7), (24, 4, 8)))
    noon = find_noon()
    site = umbra.Site(45.0, 0.0, "UTC")
    sun = find_sun(site, noon, refraction="none")
    reach = 1 / np.tan(np.radians(sun.altitude[0]))
    result = umbra.shadow_study(
        scene, site, **around(noon), refraction="none", extent=(-2, -2, 28, 18), cell=0.05
    )
    x, y = np.meshgrid(result.x, result.y)
    block = (x > 0) & (x < 4) & (y > 0) & (y < 4 + 6 * reach)
    slab = (x > 20) & (x < 24) & (y > 7 * reach) & (y < 4 + 8 * reach)
    np.testing.assert_array_equal(result.shadow_hours.values > 0, block | slab)
    assert (result.receiver_z.values == 0).all()


def test_ground_above_the_feet_of_buildings(noon, at_45):
    result = umbra.shadow_study(
        pole(10.0, 0.2), at_45, **around(noon), refraction="none", ground=4.0,
        extent=(-1, -1, 1, 12), size=(100, 1300),
    )  # fmt: skip
    np.testing.assert_allclose(footprint(result), [-0.1, -0.1, 0.1, 6.1], atol=0.0101)
    assert (result.receiver_z.values == 4.0).all()
    assert result.attrs["ground_z"] == 4.0


def test_ground_below_the_feet_of_buildings(noon, at_45):
    # A pole that floats 5 m up: its shadow starts 5 m north of its south face.
    result = umbra.shadow_study(
        pole(10.0, 0.2), at_45, **around(noon), refraction="none", ground=-5.0,
        extent=(-1, -1, 1, 17), size=(100, 1800),
    )  # fmt: skip
    np.testing.assert_allclose(footprint(result), [-0.1, 4.9, 0.1, 15.1], atol=0.0101)


def test_what_lies_below_the_ground_neither_casts_nor_receives(noon, at_45):
    scene = parts(cellar=box((4, 0, -8), (8, 4, -1)), tower=box((-0.1, -0.1, -3), (0.1, 0.1, 10)))
    for receivers in ("ground", "top"):
        result = umbra.shadow_study(
            scene, at_45, **around(noon), refraction="none", ground=0.0, receivers=receivers,
            extent=(-1, -1, 9, 12), size=(500, 1300),
        )  # fmt: skip
        np.testing.assert_allclose(footprint(result)[[0, 2, 3]], [-0.1, 0.1, 10.1], atol=0.0201)
        assert float(result.receiver_z.min()) == 0.0
    assert float(result.receiver_z.sel(x=0.01, y=0.005, method="nearest")) == 10.0
    assert float(result.receiver_z.sel(x=6, y=2, method="nearest")) == 0.0


def test_top_receives_on_roofs(noon, at_45):
    # North of a tower of 10 m stands a roof of 4 m: the shadow ends there 4 m sooner.
    scene = parts(tower=box((0, -1, 0), (2, 0, 10)), roof=box((0, 3, 0), (2, 20, 4)))
    result = umbra.shadow_study(
        scene, at_45, **around(noon), refraction="none", receivers="top",
        extent=(0.5, -1, 1.5, 26), size=(10, 2700),
    )  # fmt: skip
    shadow = (result.shadow_hours.values > 0).all(1)
    y = result.y.values
    # In shadow: the street to the roof, the roof to 10 - 4 = 6 m, the ground 4 m behind it.
    expected = ((y > 0) & (y < 6)) | ((y > 20) & (y < 24))
    assert (shadow != expected).sum() <= 3
    np.testing.assert_array_equal((result.shadow_hours.values > 0).any(1), shadow)
    heights = result.receiver_z.values[:, 0]
    np.testing.assert_array_equal(heights[(y > 3) & (y < 20)], 4.0)
    np.testing.assert_array_equal(heights[(y > 0) & (y < 3)], 0.0)


def test_profile_is_drawn_at_from_and_every_step_to_the_end():
    # The wall's shadow reaches 10 tan(15 degrees x hours after noon) east, at the stamps
    # themselves and not at the midpoints: 1, 2, 3 hours after noon.
    noon = find_noon()
    start, end = (str((noon + np.timedelta64(s, "s")).item().time()) for s in (3600, 10_800))
    study = run_study(
        wall(10.0), EQUATOR, date=EQUINOX, start=start, end=end, every="1h",
        refraction="none", extent=(-1, -0.5, 15, 0.5), cell=0.01,
    )  # fmt: skip
    preview = make_preview(study)
    assert preview.shadows.shape == (3, 100, 1600)
    for hours, shadow in zip((1, 2, 3), preview.shadows):
        reach = preview.x[shadow.all(0)].max()
        assert reach == pytest.approx(10 * np.tan(np.radians(15 * hours)), abs=0.02)
    assert study.steps.labels()[0] == start
    assert study.steps.labels()[-1] == end
    middle = 10 * np.tan(np.radians([22.5, 37.5]))
    hours = study.shadow_hours[50]
    assert study.x[hours > 1.5].max() == pytest.approx(middle[0], abs=0.02)
    assert study.x[hours > 0.5].max() == pytest.approx(middle[1], abs=0.02)


def test_profile_of_a_large_plan_is_counted_with_fewer_cells(noon, at_45):
    study = run_study(
        pole(10.0, 1.0), at_45, **around(noon, 600), refraction="none",
        extent=(-10, -10, 10, 14), cell=0.02,
    )  # fmt: skip
    preview = make_preview(study, longest=120)
    assert preview.shadows.shape == (2, 120, 100)
    np.testing.assert_allclose(np.diff(preview.x), 0.2)
    assert preview.x[0] == pytest.approx(-9.9)
    assert preview.y[-1] == pytest.approx(13.9)
    assert preview.shadows[0].sum() * 0.04 == pytest.approx(11.0, rel=0.05)


def test_profile_lies_in_the_model_s_own_coordinates(noon, at_45):
    vertices, faces = box((-0.5, -0.5, 0), (0.5, 0.5, 10))
    place = np.array([601_000.0, 5_340_000.0, 4160.0])
    study = run_study(
        make_scene(vertices + place, faces), at_45, **around(noon), refraction="none",
        extent=(*(place[:2] - 2), *(place[:2] + 12)), cell=0.1,
    )  # fmt: skip
    preview = make_preview(study)
    np.testing.assert_allclose(preview.x, study.x, rtol=0, atol=1e-8)
    np.testing.assert_allclose(preview.y, study.y, rtol=0, atol=1e-8)
    rows, cols = np.nonzero(preview.shadows[0])
    assert preview.x[cols].mean() == pytest.approx(place[0], abs=0.01)
    assert preview.y[rows].max() == pytest.approx(place[1] + 10.45, abs=0.06)
    assert preview.heights.max() == 10


def test_profile_of_very_many_stamps_stays_small(monkeypatch):
    monkeypatch.setattr(preview_module, "MOST", 100_000)
    study = run_study(
        wall(10.0), EQUATOR, date=EQUINOX, start="14:00", end="14:10", every="10s",
        extent=(-1, -0.5, 15, 15.5), cell=0.1,
    )  # fmt: skip
    shadows = make_preview(study).shadows
    assert len(shadows) == 61
    assert shadows.size <= 100_000
    assert shadows[0].shape == (40, 40)


def test_true_north_of_a_crs(tmp_path):
    # 3 degrees west of the meridian of UTM zone 33, true north leans east by
    # 3 sin(48) = 2.23 degrees: 100 m of shadow end 3.89 m east of the grid's north.
    east, north = Proj("EPSG:32633")(12.0, 48.0)
    vertices, faces = box((-0.5, -0.5, 0), (0.5, 0.5, 100))
    mesh = vertices + [east, north, 0]
    path = tmp_path / "mast.city.jsonl"
    save_city_sequence(path, {"mast": (mesh, faces)}, crs=32633)
    scene = umbra.read(path)
    site = umbra.Site(scene.latitude, scene.longitude, "UTC", true_north=scene.true_north)
    assert site.true_north == pytest.approx(2.229, abs=0.003)
    noon = find_noon(12.0)
    result = umbra.shadow_study(
        scene, site, **around(noon), refraction="none",
        extent=(east - 20, north - 20, east + 20, north + 130), cell=0.1,
    )  # fmt: skip
    length = 100 / np.tan(np.radians(float(result.sun_altitude[0])))
    bounds = footprint(result) - [east, north, east, north]
    assert bounds[2] - 0.5 == pytest.approx(length * np.sin(np.radians(2.229)), abs=0.12)
    assert bounds[3] - 0.5 == pytest.approx(length * np.cos(np.radians(2.229)), abs=0.12)
