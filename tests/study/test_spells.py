"""First and last sun, spells, several days: against every instant, and solved by hand."""

import numpy as np
import pytest
from support.days import EQUINOX, find_noon, parts, pole, wall
from support.shapes import box, city

import umbra
from umbra.receivers import plan as study_module
from umbra.scene import make_scene
from umbra.study import result as result_module
from umbra.study import run_study
from umbra.study.accumulators.step_masks import Masks

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
EQUATOR = umbra.Site(0.0, 0.0, "UTC")
DAY = {"date": "2026-03-05", "start": "05:30", "end": "18:40", "every": "25min"}
MINUTE = np.timedelta64(1, "m")


@pytest.fixture(scope="module")
def town():
    return make_scene(*city(3, seed=5, cell=13.0))


def follow(result, least):
    """Walk through every instant of one day, cell by cell, in plain Python."""
    shadow = result.in_shadow.values.reshape(result.sizes["time"], -1)
    up = result.sun_altitude.values > 0
    start = np.datetime64("2026-03-05T04:30")  # 05:30 in winter time
    step = 25 * MINUTE
    end = np.datetime64("2026-03-05T17:40")
    found = []
    for cell in shadow.T:
        spells, began = [], None
        for i, (dark, is_up) in enumerate(zip(cell, up)):
            at = start + i * step
            if is_up and not dark and began is None:
                began = at
            elif began is not None and (dark or not is_up):
                spells.append((began, at))
                began = None
        if began is not None:
            spells.append((began, end))
        lengths = [(b - a) / np.timedelta64(1, "h") for a, b in spells]
        found.append(
            (
                spells[0][0] if spells else np.datetime64("NaT"),
                spells[-1][1] if spells else np.datetime64("NaT"),
                len(spells),
                max(lengths, default=0),
                sum(length for length in lengths if length >= least),
                sum(lengths),
            )
        )
    return found


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_spells_are_those_that_every_instant_tells(town, receivers):
    result = umbra.shadow_study(
        town, VIENNA, **DAY, receivers=receivers, cell=1.1, masks=True, min_spell="75min"
    )
    expected = follow(result, 1.25)
    names = ("first_sun", "last_sun", "sun_spells", "longest_sun_hours", "sun_hours_in_spells",
             "sun_hours")  # fmt: skip
    for name, values in zip(names, zip(*expected)):
        found = result[name].values.ravel()
        if name in ("first_sun", "last_sun"):
            np.testing.assert_array_equal(found, np.array(values, "datetime64[ns]"), err_msg=name)
        else:
            np.testing.assert_allclose(found, values, rtol=2e-7, atol=1e-6, err_msg=name)
    assert result.sun_spells.values.max() >= 3
    assert (result.sun_hours_in_spells < result.sun_hours - 0.1).any()
    hours = float(result.shadow_hours[0, 0] + result.sun_hours[0, 0])
    np.testing.assert_allclose(result.shaded_share, result.shadow_hours / hours, rtol=1e-6)


def test_a_place_east_of_a_wall_has_the_sun_until_its_hour():
    # 10 m west of a wall of 10 m along the meridian the sun comes at 9 solar time and stays.
    noon = find_noon()
    result = umbra.shadow_study(
        wall(10.0), EQUATOR, date=EQUINOX, start="06:30", end="17:45", every="1min",
        refraction="none", extent=(-20, -0.5, 20, 0.5), size=(4000, 1), spells=True,
    ).isel(y=0)  # fmt: skip
    west, east = (result.sel(x=x, method="nearest") for x in (-10.2, 10.0))
    three = np.timedelta64(3, "h")
    assert abs(west.first_sun.values - (noon - three)) <= 1.5 * MINUTE
    assert west.last_sun.values == np.datetime64(f"{EQUINOX}T17:45")
    assert east.first_sun.values == np.datetime64(f"{EQUINOX}T06:30")
    assert abs(east.last_sun.values - (noon + three)) <= 1.5 * MINUTE
    assert (int(west.sun_spells), int(east.sun_spells)) == (1, 1)
    under = result.sel(x=-0.1, method="nearest")  # under the wall itself
    assert np.isnat(under.first_sun.values)
    assert np.isnat(under.last_sun.values)
    assert (int(under.sun_spells), float(under.longest_sun_hours)) == (0, 0)
    assert float(under.shaded_share) == 1


def test_a_thin_pole_cuts_the_sun_in_two_spells():
    # Due north of a pole the shadow passes at noon.
    noon = find_noon()
    site = umbra.Site(45.0, 0.0, "UTC")
    result = umbra.shadow_study(
        pole(10.0, 0.5), site, date=EQUINOX, start="09:00", end="15:00", every="1min",
        extent=(-0.05, 5.95, 0.05, 6.05), cell=0.1, min_spell="170min", by_day=True,
    ).isel(x=0, y=0)  # fmt: skip
    assert int(result.sun_spells) == 2
    # Seen from there the pole is 5 degrees wide, and the azimuth turns by 15 / sin 45 an hour.
    width = 2 * np.degrees(np.arctan(0.25 / 5.75))
    assert float(result.shadow_hours) == pytest.approx(width / 15 * np.sqrt(0.5), abs=1 / 60)
    # The morning has 3 h 7 min to noon, the afternoon 2 h 53 min less half the shadow.
    morning = (noon - np.datetime64(f"{EQUINOX}T09:00")) / np.timedelta64(1, "h")
    half = float(result.shadow_hours) / 2
    assert float(result.longest_sun_hours) == pytest.approx(morning - half, abs=1.1 / 60)
    assert float(result.sun_hours_in_spells) == pytest.approx(morning - half, abs=1.1 / 60)
    assert result.longest_sun_hours_by_day.shape == (1,)


def test_threads_and_tiles_change_no_spell(town, monkeypatch):
    options = {**DAY, "date": "2026-03-05,2026-06-21", "receivers": "top", "cell": 0.7}
    options |= {"masks": True, "min_spell": "30min"}
    one = umbra.shadow_study(town, VIENNA, threads=1, **options)
    monkeypatch.setattr(study_module, "TILE", 37)
    tiled = umbra.shadow_study(town, VIENNA, threads=2, **options)
    for name in one.data_vars:
        if name != "receiver_z":
            np.testing.assert_array_equal(tiled[name], one[name], err_msg=name)


def test_several_days_are_the_sum_of_each(town):
    dates = ["2026-03-21", "2026-06-21", "2026-12-21"]
    options = {**DAY, "extent": (-30, -30, 40, 40), "cell": 1.3, "receivers": "top"}
    del options["date"]
    every = umbra.shadow_study(town, VIENNA, date=dates, min_spell="1h", **options)
    plain = umbra.shadow_study(town, VIENNA, date=",".join(dates), **options)
    summed = umbra.shadow_study(town, VIENNA, date=dates, by_day=False, spells=True, **options)
    single = [
        umbra.shadow_study(town, VIENNA, date=day, min_spell="1h", **options) for day in dates
    ]
    np.testing.assert_array_equal(every.day.values, np.array(dates, "datetime64[ns]"))
    for k, day in enumerate(single):
        for name in ("shadow_hours", "sun_hours", "first_sun", "last_sun", "sun_spells",
                     "longest_sun_hours", "sun_hours_in_spells"):  # fmt: skip
            found = every[f"{name}_by_day"].isel(day=k).values
            np.testing.assert_array_equal(found, day[name].values, err_msg=name)
        np.testing.assert_allclose(plain.shadow_hours_by_day[k], day.shadow_hours, rtol=1e-6)
        assert float(every.up_hours_by_day[k]) == pytest.approx(
            float(day.shadow_hours[0, 0] + day.sun_hours[0, 0]), rel=1e-6
        )
    total = sum(day.shadow_hours.values for day in single)
    for result in (every, plain, summed):
        np.testing.assert_allclose(result.shadow_hours, total, rtol=1e-6)
        assert result.sizes["time"] == sum(day.sizes["time"] for day in single)
    assert "day" not in summed.coords
    for name, join in (("sun_spells", np.sum), ("longest_sun_hours", np.max),
                       ("first_sun", np.fmin.reduce), ("last_sun", np.fmax.reduce)):  # fmt: skip
        expected = join([day[name].values for day in single], axis=0)
        np.testing.assert_array_equal(every[name].values, expected)
        np.testing.assert_array_equal(summed[name].values, expected)


def test_more_than_twelve_dates_are_summed_only():
    options = {"start": "11:00", "end": "13:00", "every": "1h", "cell": 4.0}
    result = umbra.shadow_study(pole(), VIENNA, date="2026-06", every_days=2, **options)
    assert "day" not in result.dims
    assert result.sizes["time"] == 30
    assert result.attrs["days"] == 15
    assert float(result.sun_hours.max()) == 30
    by_day = umbra.shadow_study(pole(), VIENNA, date="2026-06", by_day=True, **options)
    assert by_day.sizes["day"] == 30


def test_night_has_no_sun_and_breaks_a_spell():
    # North of the polar circle near midsummer the sun dips below the horizon for a short night.
    site = umbra.Site(66.5, 15.0, "UTC")
    scene = parts(stone=box((-1, -1, 0), (1, 1, 0.5)))
    result = umbra.shadow_study(
        scene, site, date="2026-06-15", start="20:00", end="24:00", every="5min", spells=True,
        refraction="none", extent=(50, 50, 60, 60), cell=5.0,
    )  # fmt: skip
    night = result.sun_altitude.values <= 0
    assert night.any()
    assert not night[-1]
    assert (result.sun_spells == 2).all()
    assert float(result.sun_hours[0, 0]) == pytest.approx((~night).sum() / 12)
    polar_night = umbra.shadow_study(
        scene, umbra.Site(80.0, 15.0, "UTC"), date="2026-12-21", spells=True, cell=5.0
    )
    assert np.isnat(polar_night.first_sun.values).all()
    assert not polar_night.sun_spells.any()
    assert np.isnan(polar_night.shaded_share).all()


def test_masks_take_an_eighth_of_a_byte_each(town):
    study = run_study(town, VIENNA, **DAY, cell=1.0, masks=True)
    up = int(study.sun.is_up.sum())
    assert study.masks.nbytes == (up + 7) // 8 * study.shadow_hours.size
    assert study.masks.shape == (len(study.sun.is_up), *study.shadow_hours.shape)
    whole = np.asarray(study.masks)
    assert whole.dtype == study.masks.dtype == np.uint8
    assert study.masks.size == whole.size
    assert study.masks.ndim == 3
    for i, mask in enumerate(study.masks):
        np.testing.assert_array_equal(mask, whole[i])
    np.testing.assert_array_equal(study.masks[3:7], whole[3:7])
    np.testing.assert_array_equal(study.masks[:, 4, 5], whole[:, 4, 5])
    assert not whole[~study.sun.is_up].any()
    # A year at 15 minutes of a million cells: 17,500 instants with the sun up.
    assert 17_500 / 8 * 1e6 < 2.2e9
    many = Masks(np.arange(35_040) % 2 == 0, (2, 3))
    assert many.nbytes == 2190 * 6


def test_masks_that_fit_only_packed_stay_so(town, monkeypatch):
    study = run_study(town, VIENNA, **DAY, cell=1.0, masks=True)
    monkeypatch.setattr(result_module, "find_memory", lambda: 1000.0)
    with pytest.raises(umbra.InputError, match="stays packed"):
        study.to_dataset()
    assert study.variables()["in_shadow"][1] is study.masks


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"min_spell": "soon"}, "least spell min_spell='soon' is not a duration"),
        ({"min_spell": "0min"}, "least spell"),
        ({"date": "2026-09-01..2026-08-01"}, "ends before it begins"),
        ({"every_days": 0}, "at least 1"),
    ],
)
def test_slips_are_told(options, says):
    with pytest.raises(umbra.InputError, match=says):
        umbra.shadow_study(pole(), VIENNA, **{**DAY, **options})
