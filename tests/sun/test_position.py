import datetime as dt
import os
import subprocess
import sys
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.sweeps import reduce_count

from umbra.errors import InputError
from umbra.sun import Site, find_sun, sun_light
from umbra.sun import position as position_module


def sun_at(latitude, longitude, *instants, refraction="none", **site):
    site = Site(latitude, longitude, "UTC", **site)
    return find_sun(site, np.array(instants, "datetime64[us]"), refraction=refraction)


def minutes_of(day):
    return np.datetime64(day, "us") + np.arange(1440) * np.timedelta64(1, "m")


# ---------------------------------------------------------------- published values

GOLDEN = {"latitude": 39.742476, "longitude": -105.1786, "elevation": 1830.14}
AIR = {"pressure": 820.0, "temperature": 11.0, "delta_t": 67.0}


def golden(instant):
    seconds = np.array([instant], "datetime64[us]").astype(np.int64) / 1e6
    return [float(a[0]) for a in position_module._find_angles(seconds, **GOLDEN, **AIR)]


def test_spa_report_example():
    # NREL/TP-560-34302, table A5.1: 2003-10-17 12:30:30 at UTC-7.
    geometric, apparent, azimuth = golden("2003-10-17T19:30:30")
    assert 90 - apparent == pytest.approx(50.11162, abs=1e-5)
    assert azimuth == pytest.approx(194.34024, abs=1e-5)
    assert geometric == pytest.approx(39.872046, abs=1e-5)


def test_spa_report_example_through_the_public_face():
    # Our own air (1010 hPa at sea level, 12 degrees C) moves it by less than 0.001 degrees.
    site = Site(39.742476, -105.1786, "America/Denver", elevation=1830.14)
    path = find_sun(site, [dt.datetime(2003, 10, 17, 12, 30, 30, tzinfo=site_clock(-7))])
    assert 90 - path.altitude[0] == pytest.approx(50.11162, abs=0.001)
    assert path.azimuth[0] == pytest.approx(194.34024, abs=0.001)


def site_clock(hours):
    return dt.timezone(dt.timedelta(hours=hours))


def test_spa_report_sunrise_transit_and_sunset():
    # The reference program prints sunrise 06:12:43, transit 11:46:04, sunset 17:20:19, local:
    # those of the UT day, so the sunset is the one of the evening before, the 16th.
    # Rise and set are the centre at -0.8333 degrees, seen from the earth's centre: the
    # parallax of 0.0024 degrees lowers it here.
    for clock in ("2003-10-17T13:12:43", "2003-10-17T00:20:19"):
        assert golden(clock)[0] == pytest.approx(-0.8333 - 0.0024, abs=0.004)
    assert golden("2003-10-17T18:46:04")[2] == pytest.approx(180, abs=0.01)


def test_meeus_declination_and_equation_of_time():
    # Astronomical Algorithms, examples 25.b and 28.a: 1992 October 13.0 TD has
    # declination -7 deg 47' 01.74" and equation of time +13 min 42.6 s. TD is 59 s ahead.
    # On the equator the north component is the sine of the declination, and on
    # the meridian 180 E, 12 h ahead, the hour angle there is EoT - 59 s west of noon.
    path = sun_at(0, 180, "1992-10-12T23:59:01")
    east, north, up = path.direction[0]
    assert np.degrees(np.arcsin(north)) == pytest.approx(-7.783817, abs=0.001)
    hour_angle = np.degrees(np.arctan2(-east, up))
    assert hour_angle == pytest.approx((13 * 60 + 42.6 - 59) / 240, abs=0.003)


@pytest.mark.parametrize(
    ("instant", "declination"),
    [
        # USNO, Earth's seasons 2020, to the minute; the sun then climbs 0.0003 degrees a minute.
        ("2020-03-20T03:50", 0.0),
        ("2020-09-22T13:31", 0.0),
        ("2020-06-20T21:44", 23.4366),
        ("2020-12-21T10:02", -23.4366),
    ],
)
def test_seasons(instant, declination):
    north = sun_at(0, 0, instant).direction[0, 1]
    # Seen from the equator's surface, parallax is at most 0.0024 degrees.
    assert np.degrees(np.arcsin(north)) == pytest.approx(declination, abs=0.003)


@pytest.mark.parametrize(
    ("day", "declination"),
    [("2020-06-21", 23.4366), ("2020-12-21", -23.4366)],
)
@pytest.mark.parametrize("latitude", [0.0, 30.0, 48.2, -33.87, 80.0, -60.0])
def test_highest_sun_of_a_solstice(day, declination, latitude):
    path = sun_at(latitude, 16.37, *minutes_of(day))
    assert path.altitude.max() == pytest.approx(90 - abs(latitude - declination), abs=0.005)


def test_equals_pvlib():
    pd = pytest.importorskip("pandas")
    from pvlib.solarposition import get_solarposition  # noqa: PLC0415

    # 1901 to 2399: every month, each with its own Delta T.
    instants = np.datetime64("1901-01-15T03:00", "us") + np.arange(6000) * np.timedelta64(
        30 * 24 + 7, "h"
    )
    for site in (Site(48.2, 16.37, "UTC", elevation=171), Site(-70.5, -150.25, "UTC")):
        theirs = get_solarposition(
            pd.DatetimeIndex(instants, tz="UTC"),
            site.latitude,
            site.longitude,
            altitude=site.elevation,
            pressure=100 * 1010 * ((288.15 - 0.0065 * site.elevation) / 288.15) ** 5.25588,
            temperature=12,
            method="nrel_numpy",
            delta_t=None,
        )
        path = find_sun(site, instants)
        assert np.allclose(path.altitude, theirs["apparent_elevation"], rtol=0, atol=1e-9)
        assert np.allclose(path.azimuth, theirs["azimuth"], rtol=0, atol=1e-9)
        path = find_sun(site, instants, refraction="none")
        assert np.allclose(path.altitude, theirs["elevation"], rtol=0, atol=1e-9)


# ---------------------------------------------------------------- where it stands


def test_noon_is_south_in_vienna_and_north_in_sydney():
    vienna = sun_at(48.2, 16.37, *minutes_of("2026-09-18"))
    noon = vienna.altitude.argmax()
    assert vienna.direction[noon, 1] == pytest.approx(
        -np.cos(np.radians(vienna.altitude[noon])), abs=1e-4
    )
    assert vienna.azimuth[noon] == pytest.approx(180, abs=0.4)  # it turns so much in a minute
    sydney = sun_at(-33.87, 151.21, *minutes_of("2026-09-18"))
    noon = sydney.altitude.argmax()
    assert sydney.direction[noon, 1] > 0.5
    assert min(sydney.azimuth[noon], 360 - sydney.azimuth[noon]) < 0.5


def test_morning_sun_is_east_everywhere():
    for latitude in (-40, 0, 40):
        path = sun_at(latitude, 0, "2026-04-10T08:00", "2026-04-10T16:00")
        assert path.direction[0, 0] > 0.6
        assert path.direction[1, 0] < -0.6
        assert path.azimuth[0] < 180 < path.azimuth[1]


def test_pole_at_forty_five_degrees_casts_its_own_height_due_north():
    # A 10 m pole at true noon; the latitude is chosen so that the sun stands at 45 degrees.
    path = sun_at(45 - 23.4366, 0, *minutes_of("2020-12-21"))
    noon = path.altitude.argmax()
    east, north, up = path.direction[noon]
    tip = -10 * np.array([east, north]) / up
    assert tip == pytest.approx([0, 10], abs=0.05)


def test_true_north_turns_the_model():
    # True north along +x: due south is -x, so the noon sun stands over -x and the
    # morning sun, in the east, over -y.
    day = minutes_of("2026-09-18")
    straight = sun_at(48.2, 16.37, *day)
    turned = sun_at(48.2, 16.37, *day, true_north=90)
    noon = straight.altitude.argmax()
    assert turned.direction[noon, 0] < -0.6
    assert turned.direction[noon, 1] == pytest.approx(0, abs=0.005)
    assert turned.direction[noon - 300, 1] < -0.6
    # The whole day: the model's x is true north, its y is true west.
    assert np.allclose(turned.direction[:, 0], straight.direction[:, 1])
    assert np.allclose(turned.direction[:, 1], -straight.direction[:, 0])
    assert np.allclose(turned.direction[:, 2], straight.direction[:, 2])
    assert np.array_equal(turned.azimuth, straight.azimuth)  # from true north, whatever the model


def test_polar_day_and_polar_night():
    summer = sun_at(69.65, 18.96, *minutes_of("2020-06-20"))
    assert summer.is_up.all()
    assert summer.altitude.min() == pytest.approx(69.65 + 23.4366 - 90, abs=0.005)
    lowest = summer.azimuth[summer.altitude.argmin()]
    assert min(lowest, 360 - lowest) < 1  # the midnight sun stands in the north
    winter = sun_at(69.65, 18.96, *minutes_of("2020-12-21"), refraction="standard")
    assert not winter.is_up.any()
    assert winter.altitude.max() == pytest.approx(90 - 69.65 - 23.4366, abs=0.005)


def test_at_the_poles_altitude_is_declination():
    for latitude, sign in ((90, 1), (-90, -1)):
        path = sun_at(latitude, 0, *minutes_of("2020-06-20"))
        assert path.altitude == pytest.approx(np.full(1440, sign * 23.4366), abs=0.006)
        assert np.isfinite(path.direction).all()


def test_equator_day_is_twelve_hours():
    path = sun_at(0, 0, *minutes_of("2026-03-20"))
    assert path.is_up.sum() == pytest.approx(720, abs=1)


def test_sun_right_overhead():
    # Kaaba, 28 May 12:18 (09:18 UTC) each year: the sun is at the zenith and Makkah uses it
    # to find the qibla. The zenith must not be a hole in the formulas.
    path = sun_at(21.4225, 39.8262, "2026-05-28T09:18")
    assert path.altitude[0] > 89.9
    day = minutes_of("2026-03-20")[700:750]
    for longitude in np.linspace(0.5, 3, 40):
        assert np.isfinite(sun_at(0, longitude, *day, refraction="standard").direction).all()


def test_holes_of_the_formulas_are_mended(monkeypatch):
    # NaN where SPA's refraction has its pole, and where rounding takes arcsin above 1.
    nan = np.nan

    def solar_position(seconds, *_):
        return np.array([[nan] * 3, [nan] * 3, [nan, nan, 5], [-5.11, nan, 4], [7, 8, 9], [0] * 3])

    monkeypatch.setattr(
        position_module, "_load_spa", lambda: SimpleNamespace(solar_position=solar_position)
    )
    geometric, apparent, azimuth = position_module._find_angles(np.zeros(3), **GOLDEN, **AIR)
    assert geometric.tolist() == [-5.11, 90, 4]
    assert apparent.tolist() == [-5.11, 90, 5]
    assert azimuth.tolist() == [7, 8, 9]


# ---------------------------------------------------------------- refraction


def test_refraction_lifts_the_sun_by_the_published_amount():
    # Saemundsson's formula, [1] eq. 42: at a true altitude of 0, 28.98', at 12 degrees C
    # 283/285 of that. Bennett's table gives 34' for an apparent 0.
    day = minutes_of("2026-03-20")
    bent = sun_at(30, 0, *day, refraction="standard")
    bare = sun_at(30, 0, *day)
    lift = bent.altitude - bare.altitude
    at_zero = np.interp(0, bare.altitude[300:700], lift[300:700])
    assert at_zero == pytest.approx(28.98 / 60 * 283 / 285, abs=0.002)
    # Astronomical Almanac, page B82: 0.00452 P / ((273 + T) tan a) above 15 degrees.
    high = bare.altitude > 20
    almanac = 0.00452 * 1010 / 285 / np.tan(np.radians(bent.altitude[high]))
    assert np.allclose(lift[high], almanac, atol=0.003)
    # From the upper limb's touch of the horizon on down, nothing is bent.
    is_low = bare.altitude < -0.8334
    assert (lift[is_low] == 0).all()
    assert (lift[(bare.altitude > -0.8333) & (bare.altitude < 5)] > 0.1).all()
    assert np.array_equal(bent.azimuth, bare.azimuth)


def test_refraction_follows_into_direction_and_is_up():
    day = minutes_of("2026-03-20")
    bent, bare = sun_at(30, 0, *day, refraction="standard"), sun_at(30, 0, *day)
    for path in (bent, bare):
        assert np.allclose(path.direction[:, 2], np.sin(np.radians(path.altitude)))
        assert np.array_equal(path.is_up, path.altitude > 0)
    # 0.48 degrees at each end, and the sun climbs 0.217 degrees a minute at this latitude.
    assert bent.is_up.sum() - bare.is_up.sum() == pytest.approx(2 * 0.48 / 0.217, abs=1)


def test_thin_air_bends_less():
    # U.S. Standard Atmosphere 1976: 540.20 hPa at 5000 geopotential metres, 1013.25 at 0.
    assert position_module._pressure_at(5000) / 1010 == pytest.approx(540.20 / 1013.25, abs=2e-5)
    instants = minutes_of("2026-03-20")[400:500]
    lifts = [
        sun_at(30, 0, *instants, refraction="standard", elevation=elevation).altitude
        - sun_at(30, 0, *instants, elevation=elevation).altitude
        for elevation in (0, 5000)
    ]
    assert np.allclose(lifts[1] / lifts[0], 0.533, atol=0.001)


def test_standard_is_the_default():
    site = Site(48.2, 16.37, "UTC")
    when = np.array(["2026-09-18T05:00"], "datetime64[us]")
    assert find_sun(site, when).altitude == find_sun(site, when, refraction="standard").altitude
    assert find_sun(site, when).altitude > find_sun(site, when, refraction="none").altitude
    with pytest.raises(InputError, match="refraction 'bent' is not known; give 'standard'"):
        find_sun(site, when, refraction="bent")


# ---------------------------------------------------------------- laws


@settings(deadline=None, max_examples=reduce_count(60, 2))
@given(
    latitude=st.floats(-90, 90),
    longitude=st.floats(-180, 180),
    true_north=st.floats(-720, 720),
    instant=st.datetimes(dt.datetime(1600, 1, 1), dt.datetime(2999, 1, 1)),
    refraction=st.sampled_from(["standard", "none"]),
)
def test_unit_vectors_and_angles_agree(latitude, longitude, true_north, instant, refraction):
    path = sun_at(latitude, longitude, instant, refraction=refraction, true_north=true_north)
    x, y, z = path.direction[0]
    assert np.hypot(np.hypot(x, y), z) == pytest.approx(1, abs=1e-14)
    assert 0 <= path.azimuth[0] < 360
    assert -90 <= path.altitude[0] <= 90
    assert np.degrees(np.arcsin(z)) == pytest.approx(path.altitude[0], abs=1e-6)
    if abs(path.altitude[0]) < 89:
        turn = np.degrees(np.arctan2(x, y)) - true_north - path.azimuth[0]
        assert (turn + 180) % 360 - 180 == pytest.approx(0, abs=1e-9)


def test_each_instant_stands_alone():
    instants = minutes_of("2026-06-01")[::97]
    together = sun_at(48.2, 16.37, *instants)
    for i, instant in enumerate(instants):
        assert sun_at(48.2, 16.37, instant).altitude[0] == pytest.approx(
            together.altitude[i], abs=1e-9
        )
    assert together.altitude.shape == together.azimuth.shape == together.is_up.shape == (15,)
    assert together.direction.shape == (15, 3)
    assert together.direction.dtype == together.altitude.dtype == np.float64


def test_instants_of_many_kinds():
    site = Site(48.2, 16.37, "UTC")
    want = find_sun(site, np.datetime64("2026-06-21T11:00")).altitude
    assert want == pytest.approx([65.234], abs=0.001)
    utc = dt.datetime(2026, 6, 21, 11)
    for instants in (
        [utc],
        utc,
        utc.replace(tzinfo=dt.UTC),
        [utc.replace(hour=13, tzinfo=site_clock(2))],
        np.array(["2026-06-21T11:00"], "datetime64[m]"),
        ["2026-06-21T11:00"],
    ):
        assert np.array_equal(find_sun(site, instants).altitude, want)
    assert find_sun(site, []).direction.shape == (0, 3)


@pytest.mark.parametrize(
    ("instants", "message"),
    [
        ([1.5, 2.5], "instants must be a list or 1-D array of datetime64"),
        ([["2026-01-01"]], "instants must be a list or 1-D array"),
        (["noon"], "instants must be a list or 1-D array"),
        (
            ["2026-01-01", "NaT", "NaT"],
            r"2 of 3 instants are missing .* \(first: instant 1, NaT\); correct",
        ),
        (["-2000-12-31"], r"1 of 1 instants .*outside the years -1999 to 3000"),
        (["2026-01-01", "9999-01-01"], r"1 of 2 instants .*outside the years -1999 to 3000"),
    ],
)
def test_wrong_instants(instants, message):
    with pytest.raises(InputError, match=message):
        find_sun(Site(48.2, 16.37, "UTC"), instants)


# ---------------------------------------------------------------- loading pvlib's module


def run_python(code, **environment):
    return subprocess.run(
        [sys.executable, "-c", code],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
    ).stdout


CODE = """
import os, sys
from umbra.sun import Site, find_sun, make_steps
steps = make_steps("2026-09-18", "09:00", "17:00", "15min", "Europe/Vienna")
path = find_sun(Site(48.2, 16.37, "Europe/Vienna"), steps.instants)
loaded = {name.partition(".")[0] for name in sys.modules}
print(sorted(loaded & {"pandas", "scipy", "pvlib", "numba", "matplotlib", "xarray", "tzfpy"}))
print(len(path.altitude), os.environ.get("PVLIB_USE_NUMBA"))
"""


def test_the_time_of_sunlight_may_stand_with_its_date():
    site = Site(48.2, 16.37, "Europe/Vienna")
    sun = sun_light(site, "2026-03-21", "15:00").position
    when = dt.datetime(2026, 3, 21, 15)
    for moment in ("2026-03-21T15:00", "2026-03-21 15:00:00", when):
        np.testing.assert_array_equal(sun_light(site, moment).position, sun)
    with pytest.raises(InputError, match="needs a clock time; give time='15:00'"):
        sun_light(site, "2026-03-21")


def test_heavy_packages_stay_out():
    assert run_python(CODE).splitlines()[0] == "[]"


def test_numba_wish_of_pvlib_is_not_heard_and_given_back():
    assert run_python(CODE, PVLIB_USE_NUMBA="1").splitlines() == ["[]", "32 1"]


def test_falls_back_to_the_usual_import(monkeypatch):
    monkeypatch.setattr(position_module.importlib.util, "find_spec", lambda _: None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        module = position_module._load_spa.__wrapped__()
    assert module.__name__ == "pvlib.spa"
