"""True solar time, times of the sun, and days of its year, against published ones."""

import datetime as dt
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.lights import make_period
from umbra.sun.date_words import TERMS, find_term_day
from umbra.sun.day_times import (
    TIMES_OF_DAY,
    DayClock,
    find_solar_time,
    is_of_the_sun,
    show_on_clock,
)
from umbra.sun.position import find_daylight

CHINA = "Asia/Shanghai"
SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = dt.date(2026, 3, 21)

# When the local clock shows them at true solar 8:00 on Great Cold of 2026 (m.35331.cn), and the
# longitude that each city has there.
GREAT_COLD = [
    (39.9, 116.35, "08:25:30"), (41.8, 123.467, "07:57:02"), (34.3, 108.95, "08:55:06"),
    (43.8, 87.65, "10:20:18"), (23.1, 113.25, "08:37:54"),
]  # fmt: skip


@pytest.mark.parametrize(("latitude", "longitude", "shown"), GREAT_COLD)
def test_solar_eight_on_great_cold(latitude, longitude, shown):
    site = umbra.Site(latitude, longitude, CHINA)
    day = find_term_day("2026-great-cold", CHINA)
    assert day == dt.date(2026, 1, 20)
    local = DayClock(site, "solar").find(day, "08:00", "start").astimezone(ZoneInfo(CHINA))
    wanted = dt.datetime.combine(day, dt.time.fromisoformat(shown), ZoneInfo(CHINA))
    assert abs(local - wanted) < dt.timedelta(seconds=4)
    assert find_solar_time(site, local) == pytest.approx(8.0, abs=1e-6)


def test_terms_are_those_of_almanacs_by_the_sites_calendar():
    """2026 (USNO): 20 March 14:46, 21 June 08:24, 23 September 00:05, 21 December 20:50 UTC."""
    dates = {"equinox": "03-20", "summer-solstice": "06-21", "autumn-equinox": "09-23",
             "winter-solstice": "12-21"}  # fmt: skip
    for name, date in dates.items():
        assert str(find_term_day(f"2026-{name}")) == f"2026-{date}"
    assert str(find_term_day("2026-autumn-equinox", "America/New_York")) == "2026-09-22"
    assert str(find_term_day("2026-winter-solstice", CHINA)) == "2026-12-22"
    assert find_term_day("great-cold", CHINA).year == dt.datetime.now(ZoneInfo(CHINA)).year
    assert find_term_day("2026-start-of-spring", CHINA) == dt.date(2026, 2, 4)  # lichun
    assert len(TERMS) > 12


def test_solar_noon_is_when_the_sun_stands_south():
    site = umbra.Site(48.2, 16.37, "Europe/Vienna")
    noon = DayClock(site, "solar").find(DAY, "12:00", "start")
    assert umbra.sun.find_sun(site, [noon]).azimuth[0] == pytest.approx(180, abs=1e-3)
    south = umbra.Site(-33.9, 151.2, "Australia/Sydney")
    noon = DayClock(south, "solar").find(DAY, "12:00", "start")
    assert abs(umbra.sun.find_sun(south, [noon]).azimuth[0] - 360) % 360 < 1e-3


def test_standard_time_has_no_daylight_saving():
    summer = dt.date(2026, 7, 1)
    standard = DayClock(SITE, "standard").find(summer, "12:00", "start")
    local = DayClock(SITE).find(summer, "12:00", "start")
    assert (standard.hour, local.hour) == (11, 10)
    assert DayClock(SITE, "standard").find(DAY, "12:00", "start").hour == 11


def test_times_of_the_sun():
    light = umbra.sun.find_daylight(SITE, DAY)
    clock = DayClock(SITE)
    assert clock.find(DAY, "sunrise+1h", "start") == light.rises + dt.timedelta(hours=1)
    assert clock.find(DAY, "Sunset - 90min", "end") == light.sets - dt.timedelta(minutes=90)
    assert clock.find(DAY, "sunset", "end") == light.sets
    for what in ("start", "end"):
        when = clock.find(DAY, "altitude:10", what)
        assert umbra.sun.find_sun(SITE, [when]).altitude[0] == pytest.approx(10, abs=1e-3)
    assert clock.find(DAY, "altitude:10", "start") < clock.find(DAY, "altitude:10", "end")
    assert [is_of_the_sun(one) for one in ("sunrise", "altitude:-3", "09:00", "moonrise")] == [
        True, True, False, False
    ]  # fmt: skip


def test_san_franciscos_year_of_sunlight():
    """Section 295: an hour after sunrise to one before sunset; 3,720.8 h a year at 37.77 N."""
    site = umbra.Site(37.77, -122.42, "America/Los_Angeles")
    period = make_period("2026", "sunrise+1h", "sunset-1h", "6h", site, every_days=73)
    mean = sum(steps.hours.sum() for steps in period.steps) / len(period.days)
    assert mean * 365 == pytest.approx(3720.8, rel=2e-3)


def test_a_study_by_solar_time_says_so(tmp_path):
    scene = umbra.make_scene(*box((0, 0, 0), (10, 10, 10)))
    site = umbra.Site(39.9, 116.35, CHINA)
    study = umbra.shadow_study(
        scene, site, date="2026-great-cold", start="08:00", end="16:00", clock="solar", every="1h",
        receivers="points", points=[[50, 50, 1]], threads=1,
    )  # fmt: skip
    assert study.attrs["clock"] == "solar"
    first = study.time.values[0] - np.timedelta64(30, "m")
    assert abs(first - np.datetime64("2026-01-20T00:25:30")) < np.timedelta64(4, "s")
    # The second half of the day mirrors the first.
    azimuths = study.sun_azimuth.values
    assert azimuths[:4] - 180 == pytest.approx(180 - azimuths[:3:-1], abs=0.2)
    hours = study.result.period.hours
    assert len(hours) == 8
    assert hours.sum() == pytest.approx(8, abs=0.01)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"start": "sunset", "end": "sunrise"}, "is not after the start"),
        ({"start": "altitude:80"}, "does not reach 80° on 2026-03-21"),
        ({"start": "sunrise+soon"}, "is not a duration"),
        ({"clock": "sidereal"}, "clock"),
        ({"date": "2026-great-heat"}, "is not a date, nor a day of the sun's year"),
        ({"start": "moonrise"}, "is not a clock time"),
    ],
)
def test_slips(given, words):
    scene = umbra.make_scene(*box((0, 0, 0), (10, 10, 10)))
    asked = {"date": "2026-03-21", "every": "1h", **given}
    with pytest.raises(umbra.InputError, match=words):
        umbra.shadow_study(scene, SITE, receivers="points", points=[[50, 50, 1]], **asked)


def test_no_sunrise_in_the_polar_night():
    site = umbra.Site(75.0, 20.0, "Europe/Oslo")
    with pytest.raises(umbra.InputError, match="no sunrise on 2026-12-21"):
        DayClock(site).find(dt.date(2026, 12, 21), "sunrise", "start")


@pytest.mark.parametrize("day", [DAY, dt.date(2026, 6, 21), dt.date(2026, 12, 21)])
def test_times_of_a_day_divide_it_between_sunrise_noon_and_sunset(day):
    light = find_daylight(SITE, day)
    when = {name: DayClock(SITE).find(day, name, "start") for name in TIMES_OF_DAY}
    noon = when["noon"]
    assert find_solar_time(SITE, noon) == pytest.approx(12.0, abs=1e-3)
    minute = dt.timedelta(minutes=1)
    assert abs(when["morning"] - light.rises - (noon - light.rises) / 2) < minute
    assert abs(light.sets - when["afternoon"] - (light.sets - noon) / 2) < minute
    assert abs(light.sets - when["evening"] - (light.sets - noon) / 6) < minute
    for name, instant in when.items():
        shown = dt.time.fromisoformat(show_on_clock(SITE, day, name))
        local = dt.datetime.combine(day, shown, ZoneInfo(SITE.zone))
        assert abs(local - instant) <= minute / 2
        assert umbra.sun_light(SITE, day, name).position[2] > 0


def test_times_of_a_day_beyond_the_polar_circle():
    north = umbra.Site(70.0, 25.0, "Europe/Oslo")
    evening, noon = (
        DayClock(north).find(dt.date(2026, 6, 21), name, "") for name in ("evening", "noon")
    )
    assert evening - noon == dt.timedelta(hours=10)
    with pytest.raises(umbra.InputError) as caught:
        umbra.sun_light(north, "2026-12-21", "noon")
    assert caught.value.date == dt.date(2026, 12, 21)
