"""Hours add up, at day and at night, however the work is cut."""

import numpy as np
import pytest
from support.days import EQUINOX, parts, pole
from support.shapes import box, city, moved

import umbra
from umbra.machine import count_cores
from umbra.receivers import plan as study_module
from umbra.scene import make_scene
from umbra.study import make_preview, run_study

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-09-18", "start": "09:00", "end": "17:00", "every": "30min"}


@pytest.fixture(scope="module")
def town():
    """Make some boxes and a gabled roof, far from the origin in x, y and z."""
    gable = (
        np.array([(0, 0, 3), (6, 0, 3), (6, 9, 3), (0, 9, 3), (3, 0, 6), (3, 9, 6.5)], float),
        np.array([[0, 4, 5], [0, 5, 3], [1, 2, 5], [1, 5, 4], [0, 1, 4], [2, 3, 5],
                  [0, 2, 1], [0, 3, 2]], np.int32),
    )  # fmt: skip
    vertices, faces = city(4, seed=3)
    shift = [601_000, 5_340_000, 4160]  # as high as La Paz
    return parts(
        town=(vertices + shift, faces),
        gable=moved(gable, np.add(shift, [30, -10, -1])),
        house=moved(box((0, 0, 0), (6, 9, 3)), np.add(shift, [30, -10, -1])),
    )


def total(result):
    return result.shadow_hours.values.astype(float) + result.sun_hours.values


@pytest.mark.parametrize(
    ("start", "end", "every", "hours"),
    [
        ("09:00", "17:00", "15min", 8.0),
        ("09:00", "10:10", "15min", 70 / 60),  # the last step has 10 minutes
        ("09:00", "09:10", "7min", 10 / 60),
        ("12:34:56", "13:00", "11s", (25 * 60 + 4) / 3600),
        ("10:00", "11:00", "1h", 1.0),
    ],
)
@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_shadow_and_sun_add_up_to_the_period(start, end, every, hours, receivers):
    result = umbra.shadow_study(
        pole(10, 2.0), VIENNA, date="2026-06-21", start=start, end=end, every=every,
        receivers=receivers, extent=(-5, -5, 5, 10), cell=0.5,
    )  # fmt: skip
    np.testing.assert_allclose(total(result), hours, rtol=3e-7)
    assert float(result.shadow_hours.max()) > 0
    assert float(result.shadow_hours.min()) == 0


def test_a_last_shorter_step_counts_for_its_own_length():
    # Ground under the pole is in shadow always: 1 h + 1 h + 0.25 h.
    result = umbra.shadow_study(
        pole(10, 2.0), VIENNA, date="2026-06-21", start="10:00", end="12:15", every="1h",
        extent=(-0.5, -0.5, 0.5, 0.5), cell=0.5, masks=True,
    )  # fmt: skip
    np.testing.assert_array_equal(result.shadow_hours.values, np.float32(2.25))
    expected = ["2026-06-21T08:30", "2026-06-21T09:30", "2026-06-21T10:07:30"]
    assert (result.time.values == np.array(expected, "datetime64[ns]")).all()


def test_evening_counts_the_hours_until_sunset():
    # Almanac: on 18 September 2026 the sun sets in Vienna at 19:03 local time.
    result = umbra.shadow_study(
        pole(10, 2.0), VIENNA, date="2026-09-18", start="17:00", end="22:00", every="2min",
        extent=(-5, -5, 20, 5), cell=1.0, masks=True,
    )  # fmt: skip
    np.testing.assert_allclose(total(result), 2 + 3 / 60, atol=3 / 60)
    night = result.sun_altitude.values <= 0
    assert night.sum() == pytest.approx(177 / 2, abs=2)
    assert not result.in_shadow.values[night].any()
    assert float(result.shadow_hours.max()) <= total(result)[0, 0] + 1e-6
    assert float(result.sun_hours.min()) >= 0


def test_polar_day_has_24_hours_of_sun():
    result = umbra.shadow_study(
        pole(10, 2.0), umbra.Site(80.0, 15.0, "Arctic/Longyearbyen"), date="2026-06-21",
        start="00:00", end="24:00", every="15min", extent=(-61, -61, 61, 61), cell=2.0,
    )  # fmt: skip
    np.testing.assert_allclose(total(result), 24)
    # Shadows go round the whole compass.
    shaded = result.shadow_hours
    for x, y in ((0, 9), (0, -9), (9, 0), (-9, 0)):
        assert float(shaded.sel(x=x, y=y, method="nearest")) > 0
    assert float(shaded.sel(x=0, y=0, method="nearest")) == 24


def test_polar_night_has_no_hours_at_all():
    study = run_study(
        pole(10, 2.0), umbra.Site(80.0, 15.0, "Arctic/Longyearbyen"), date="2026-12-21",
        start="00:00", end="24:00", every="1h", masks=True, cell=2.0,
    )  # fmt: skip
    result = study.to_dataset()
    for name in ("shadow_hours", "sun_hours", "in_shadow"):
        assert not result[name].values.any()
    assert (result.sun_altitude < 0).all()
    assert result.sizes["time"] == 24
    assert not make_preview(study).shadows.any()


def test_23_hours_on_the_day_the_clock_jumps_ahead():
    polar = umbra.Site(78.2, 15.6, "Arctic/Longyearbyen")
    result = umbra.shadow_study(
        pole(10, 2.0), polar, date="2026-03-29", start="00:00", end="24:00", every="1h",
        cell=4.0,
    )  # fmt: skip
    assert result.sizes["time"] == 23
    up = float((result.sun_altitude > 0).sum())
    np.testing.assert_allclose(total(result), up)


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_masks_add_up_to_the_hours(town, receivers):
    options = {**DAY, "every": "50min", "receivers": receivers, "cell": 0.5}
    result = umbra.shadow_study(town, VIENNA, masks=True, **options)
    lengths = np.array([50 / 60] * 9 + [0.5])
    summed = np.tensordot(lengths, result.in_shadow.values.astype(float), 1)
    np.testing.assert_allclose(result.shadow_hours.values, summed, rtol=1e-6)
    without = umbra.shadow_study(town, VIENNA, **options)
    assert "in_shadow" not in without
    np.testing.assert_allclose(without.shadow_hours, result.shadow_hours, rtol=2e-7)
    assert 0.1 < float(result.in_shadow.mean()) < 0.8


@pytest.mark.parametrize("masks", [False, True])
@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_threads_and_tiles_change_nothing(town, monkeypatch, receivers, masks):
    options = {**DAY, "receivers": receivers, "cell": 0.7, "masks": masks}
    one = umbra.shadow_study(town, VIENNA, threads=1, **options)
    for threads in (2, 3):
        more = umbra.shadow_study(town, VIENNA, threads=threads, **options)
        assert more.attrs["threads"] == min(threads, count_cores())
        for name in one.data_vars:
            np.testing.assert_array_equal(more[name], one[name], err_msg=f"{threads} threads")
    monkeypatch.setattr(study_module, "TILE", 50)
    told = []
    tiled = run_study(
        town, VIENNA, threads=2, progress=lambda done, of: told.append((done, of)), **options
    )
    assert one.sizes["x"] > 100
    tiled_result = tiled.to_dataset()
    for name in one.data_vars:
        # A roof's heights are worked out anew in each tile, and may end in another digit.
        np.testing.assert_allclose(
            tiled_result[name], one[name], rtol=0, atol=1e-9, err_msg=f"{name} in tiles"
        )
    np.testing.assert_array_equal(tiled_result.x, one.x)
    # Progress rises, and ends where it said it would.
    done = [n for n, _ in told]
    assert done == sorted(done)
    assert told[-1][0] == told[-1][1]
    assert {of for _, of in told} == {told[-1][1]}


def test_each_run_gives_the_same(town):
    options = {**DAY, "receivers": "top", "cell": 0.7}
    first = umbra.shadow_study(town, VIENNA, **options)
    again = umbra.shadow_study(town, VIENNA, **options)
    np.testing.assert_array_equal(first.shadow_hours, again.shadow_hours)


def test_georeferenced_models_get_the_shadows_of_the_same_model_at_home(town):
    shift = np.array([601_000.0, 5_340_000.0, 4160.0])
    soup = town.triangles()
    home = make_scene(soup.vertices + town.origin - shift, soup.faces)
    extent = np.array([-30.0, -40.0, 60.0, 50.0])
    options = {**DAY, "receivers": "top", "cell": 0.6}
    there = umbra.shadow_study(town, VIENNA, extent=extent + np.tile(shift[:2], 2), **options)
    here = umbra.shadow_study(home, VIENNA, extent=extent, **options)
    differ = there.shadow_hours.values != here.shadow_hours.values
    assert differ.sum() <= 2  # cells on an edge: the file's digits end at a nanometre
    np.testing.assert_allclose(there.receiver_z - 4160, here.receiver_z, atol=1e-7)


def test_sun_is_the_sun_of_the_steps_midpoints(town):
    result = umbra.shadow_study(town, VIENNA, cell=5.0, **DAY)
    assert result.sizes["time"] == 16
    assert result.time.values[0] == np.datetime64("2026-09-18T07:15:00")  # 09:15 in summer time
    assert result.time.values[-1] == np.datetime64("2026-09-18T14:45:00")
    np.testing.assert_allclose(np.linalg.norm(result.sun_direction, axis=1), 1, rtol=1e-14)
    up, turn = np.radians(result.sun_altitude), np.radians(result.sun_azimuth)
    np.testing.assert_allclose(result.sun_direction[:, 2], np.sin(up), atol=1e-12)
    np.testing.assert_allclose(result.sun_direction[:, 0], np.sin(turn) * np.cos(up), atol=1e-12)
    assert (np.diff(result.sun_azimuth) > 0).all()


def test_refraction_is_the_standard_unless_told(town):
    options = {"date": EQUINOX, "start": "08:00", "end": "09:00", "every": "1h", "cell": 5.0}
    standard = umbra.shadow_study(town, VIENNA, **options)
    none = umbra.shadow_study(town, VIENNA, refraction="none", **options)
    assert standard.attrs["refraction"] == "standard"
    assert none.attrs["refraction"] == "none"
    lift = float(standard.sun_altitude[0] - none.sun_altitude[0])
    assert 0.02 < lift < 0.07  # at 22 degrees air lifts the sun by 2.4 minutes of arc
