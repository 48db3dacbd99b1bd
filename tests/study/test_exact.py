"""Instants solved to a second: against finer and finer steps, and by hand."""

import datetime as dt

import numpy as np
import pytest
from support.days import EQUINOX, find_noon, wall
from support.shapes import box, city, moved

import umbra
from umbra.lights import make_period
from umbra.receivers import plan as study_module
from umbra.receivers import single as points_module
from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.study.accumulators.exact import find_runs

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
    # The rest had spells of less than the minute within which nothing is looked for.
    assert same.mean() > 0.99
    assert exact.sun_spells.values.max() >= 3


def test_coarse_steps_solve_the_same_instants(town):
    options = {**HOURS, **PLACE, "receivers": "top", "spells": True, "exact": True}
    fine = umbra.shadow_study(town, VIENNA, every="5min", **options)
    coarse = umbra.shadow_study(town, VIENNA, every="30min", **options)
    apart = np.abs(fine.sun_hours.values - coarse.sun_hours.values) * 3600
    solved = apart <= 0.5 * 2 * fine.sun_spells.values + 0.2
    assert solved.mean() > 0.99
    assert apart.max() < 60  # one spell of less than a minute
    assert fine.attrs["exact_least_spell_seconds"] == 50
    assert coarse.attrs["exact_least_spell_seconds"] == 60
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
    # Each minute, and both ends; the half hours are the steps' ends and midpoints.
    minutes = (altitude > 0).sum() - 2
    assert np.diff(run).max() == 6e7
    assert len(run) == minutes + 2 == (run[-2] - run[1]) // 6e7 + 3
    assert set(period.instants.astype(np.int64)[3:-3]) <= set(run.tolist())
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


def test_surfaces_change_when_rays_find_it(town, monkeypatch):
    options = {"date": HOURS["date"], "start": "09:00", "end": "12:00", "every": "30min"}
    options |= {"receivers": "surfaces", "spacing": 1.1, "exact": True, "spells": True}
    counted = umbra.shadow_study(town, VIENNA, **options)
    monkeypatch.setattr(points_module, "MANY_SUNS", 10**9)
    asked = umbra.shadow_study(town, VIENNA, **options)
    # A change is bracketed by both alike, but where float64 cannot tell at one of its ends.
    for name in ("first_sun", "last_sun"):
        apart = np.abs(counted[name].values - asked[name].values)
        np.testing.assert_array_equal(np.isnat(counted[name]), np.isnat(asked[name]))
        assert (apart[~np.isnat(apart)] <= SECOND).all()
    np.testing.assert_array_equal(counted.sun_spells, asked.sun_spells)
    np.testing.assert_allclose(counted.sun_hours, asked.sun_hours, atol=1 / 3600)
    assert int(counted.sun_spells.max()) >= 2


def test_a_tolerance_out_of_reach_is_refused(town):
    with pytest.raises(umbra.InputError, match="to 60 s"):
        umbra.shadow_study(town, VIENNA, every="1h", exact=1e-6, **HOURS, **PLACE)


def test_a_pole_s_shadow_between_two_steps_is_found():
    # At noon on the equator the sun goes 15 degrees an hour: the shadow of a pole 0.2 m wide,
    # 10 m up, passes a place below in 0.2 / 10 rad, 275 s; one of 0.1 m in 137 s.
    noon = find_noon()
    start = noon.astype("datetime64[m]").item() - dt.timedelta(minutes=31)
    for side, seconds in ((0.2, 275.0), (0.1, 137.5)):
        bar = make_scene(*box((-side / 2, -50, 10), (side / 2, 50, 10.01)))
        result = umbra.shadow_study(
            bar, EQUATOR, date=start.date(), start=start.time(),
            end=(start + dt.timedelta(hours=1)).time(), every="60min", exact=True,
            refraction="none", extent=(0.45, -1, 0.55, 1), size=(1, 1), ground=0.0, spells=True,
        )  # fmt: skip
        # A step of an hour, whose ends and middle are in the sun.
        assert float(result.shadow_hours[0, 0]) * 3600 == pytest.approx(seconds, rel=0.01)
        assert int(result.sun_spells[0, 0]) == 2


@pytest.mark.parametrize("receivers", ["ground", "surfaces"])
def test_who_casts_is_as_exact_as_the_whole(receivers):
    made = [
        Part(name, "", Mesh(*moved(city(1, seed=seed), place)))
        for seed, (name, place) in enumerate(
            {"old": (0, 0, 0), "new": (-9, -8, 0), "far": (14, -3, 0)}.items()
        )
    ]
    where = {**PLACE, "ground": 0.0} if receivers == "ground" else {"spacing": 2.0, "on": ["old"]}
    options = {**HOURS, **where, "every": "1h", "receivers": receivers, "exact": True}
    found = umbra.shadow_study(
        make_scene(made), VIENNA, by="part", proposed=["new"], under="4h", **options
    )
    for name in ("new", "far"):
        without = umbra.shadow_study(make_scene(made), VIENNA, no_cast=[name], **options)
        np.testing.assert_allclose(
            found.sole_hours.sel(caster=name), without.sun_hours - found.sun_hours, atol=1e-6
        )
        alone = umbra.shadow_study(make_scene(made), VIENNA, cast=[name], **options)
        cast = found.cast_hours.sel(caster=name)
        if receivers == "ground":
            np.testing.assert_allclose(cast, alone.shadow_hours, atol=1e-6)
        assert float(cast.max()) > 0.05
    known = np.isfinite(found.hours_lost.values)
    np.testing.assert_array_equal(
        found.hours_lost.values[known], found.sole_hours.sel(caster="new").values[known]
    )
    # The map of what is newly under agrees with the hours beside it.
    newly = (found.sun_hours < 4 - 1e-4) & (found.sun_hours + found.hours_lost >= 4 - 1e-4)
    np.testing.assert_array_equal(found.newly_under, newly)
