"""Instants solved to a second: against finer and finer steps, and by hand."""

import numpy as np
import pytest
from support.days import EQUINOX, find_noon, wall
from support.shapes import city

import umbra
from umbra.scene import make_scene
from umbra.study import run_study
from umbra.study import study as study_module
from umbra.study.exact import find_runs
from umbra.study.period import make_period

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
EQUATOR = umbra.Site(0.0, 0.0, "UTC")
SECOND = np.timedelta64(1, "s")
HOURS = {"date": "2026-03-05", "start": "09:00", "end": "16:30"}
PLACE = {"extent": (-31, -33, 36, 42), "size": (41, 43)}


@pytest.fixture(scope="module")
def town():
    return make_scene(*city(3, seed=5, cell=13.0))


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_finer_and_finer_steps_come_to_the_exact_answer(town, receivers):
    options = {**HOURS, **PLACE, "receivers": receivers, "spells": True}
    exact = umbra.shadow_study(town, VIENNA, every="5min", exact=True, **options)
    assert exact.attrs["exact_tolerance_seconds"] == 1
    before = np.inf
    for every in (900, 100, 10, 1):
        steps = umbra.shadow_study(town, VIENNA, every=f"{every}s", **options)
        off = np.abs(steps.sun_hours.values - exact.sun_hours.values) * 3600
        # Each change is off by at most half a step and half the tolerance.
        same = steps.sun_spells.values == exact.sun_spells.values
        changes = 2 * exact.sun_spells.values
        assert (off[same] <= changes[same] * (every / 2 + 0.6) + 0.1).all()
        mean = off[same].mean()
        assert mean < before / 3
        before = mean
        for name in ("first_sun", "last_sun"):
            known = same & ~np.isnat(exact[name].values)
            apart = np.abs(steps[name].values - exact[name].values)[known]
            assert (apart <= (every / 2 + 0.6) * 1e9 * np.timedelta64(1, "ns")).all()
    assert mean < 0.6  # [s]
    # The rest had spells shorter than the exact study's half step of 2.5 minutes.
    assert same.mean() > 0.97
    assert exact.sun_spells.values.max() >= 3


def test_coarse_steps_solve_the_same_instants(town):
    options = {**HOURS, **PLACE, "receivers": "top", "spells": True, "exact": True}
    fine = umbra.shadow_study(town, VIENNA, every="5min", **options)
    coarse = umbra.shadow_study(town, VIENNA, every="30min", **options)
    same = fine.sun_spells.values == coarse.sun_spells.values
    assert same.mean() > 0.85
    apart = np.abs(fine.sun_hours.values - coarse.sun_hours.values)[same] * 3600
    assert (apart <= 0.5 * 2 * fine.sun_spells.values[same] + 0.2).all()
    np.testing.assert_allclose(fine.sun_hours + fine.shadow_hours, 7.5, rtol=1e-6)


def test_a_wall_s_shadow_comes_and_goes_to_the_second():
    # On the equator at the equinox: 10 m beside a wall of 10 m, three hours from noon.
    noon = find_noon()
    result = umbra.shadow_study(
        wall(10.0), EQUATOR, date=EQUINOX, start="06:30", end="17:45", every="1h", exact=True,
        refraction="none", extent=(-10.4, -0.5, 10.2, 0.5), size=(103, 1), spells=True,
    ).isel(y=0)  # fmt: skip
    x = result.x.values
    for cell in (x > 0.1) & (x < 10), (x < -0.3) & (x > -10):
        place = np.where(x[cell] > 0, x[cell], -0.2 - x[cell])
        away = np.degrees(np.arctan(place / 10)) / 15 * 3600
        name, sign = ("last_sun", 1) if x[cell][0] > 0 else ("first_sun", -1)
        found = (result[name].values[cell] - noon) / SECOND
        # The almanac's noon is known to a second, the equator to 0.25 degrees.
        np.testing.assert_allclose(found, sign * away, atol=4)


def test_sunrise_and_sunset_bound_the_hours():
    # Almanac: on 18 September 2026 the sun's centre is up in Vienna from 6:37 to 19:00.
    result = umbra.shadow_study(
        wall(1.0), VIENNA, date="2026-09-18", start="00:00", end="24:00", every="30min",
        exact=True, spells=True, extent=(3000, 3000, 3010, 3010), cell=5.0,
    ).isel(x=0, y=0)  # fmt: skip
    sun = umbra.find_sun(VIENNA, [result.first_sun.values, result.last_sun.values])
    np.testing.assert_allclose(sun.altitude, 0, atol=3e-3)  # a second is 0.003 degrees
    length = (result.last_sun.values - result.first_sun.values) / np.timedelta64(1, "h")
    assert float(result.sun_hours) == pytest.approx(length, abs=1e-5)
    assert int(result.sun_spells) == 1


def test_runs_hold_steps_ends_midpoints_sunrise_and_sunset():
    period = make_period("2026-09-18", "05:00", "21:00", "1h", VIENNA)
    (run,) = find_runs(period, 0)
    altitude = umbra.find_sun(VIENNA, run.view("datetime64[us]")).altitude
    assert (altitude > 0).all()
    assert altitude[0] < 1e-5
    assert altitude[-1] < 1e-5
    assert len(run) == 24 + 2  # 7:00 to 18:30 by half hours, and both ends
    assert np.diff(run).max() == 1.8e9
    night = make_period("2026-09-18", "22:00", "23:00", "1h", VIENNA)
    assert find_runs(night, 0) == []
    # The midnight sun dips below the horizon: two runs.
    arctic = make_period("2026-06-15", "20:00", "24:00", "5min", umbra.Site(66.5, 15.0, "UTC"),
                         refraction="none")  # fmt: skip
    first, second = find_runs(arctic, 0)
    assert first[-1] < second[0]


def test_threads_tiles_and_masks_change_nothing(town, monkeypatch):
    options = {**HOURS, **PLACE, "every": "30min", "receivers": "top", "exact": True}
    options |= {"date": "2026-03-05,2026-06-21", "min_spell": "20min", "masks": True}
    told = []
    one = run_study(
        town, VIENNA, threads=1, progress=lambda done, of: told.append((done, of)), **options
    ).to_dataset()
    assert told[-1][0] == told[-1][1]
    monkeypatch.setattr(study_module, "TILE", 17)
    tiled = umbra.shadow_study(town, VIENNA, threads=2, **options)
    for name in one.data_vars:
        if name != "receiver_z":
            np.testing.assert_array_equal(tiled[name], one[name], err_msg=name)
    steps = umbra.shadow_study(town, VIENNA, **{**options, "exact": False})
    np.testing.assert_array_equal(one.in_shadow, steps.in_shadow)
    assert one.attrs["exact_tolerance_seconds"] == 1
    assert "exact_tolerance_seconds" not in steps.attrs


def test_a_tolerance_out_of_reach_is_refused(town):
    with pytest.raises(umbra.InputError, match="to 60 s"):
        umbra.shadow_study(town, VIENNA, every="1h", exact=1e-6, **HOURS, **PLACE)
