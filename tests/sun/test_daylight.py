"""Sunrise and sunset: as pvlib's almanac has them, and where there are none."""

import datetime as dt

import pandas as pd
import pvlib
import pytest

from umbra.sun import Site, find_daylight

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
TROMSO = Site(69.65, 18.96, "Europe/Oslo")


@pytest.mark.parametrize(
    ("site", "day", "says"),
    [
        (VIENNA, dt.date(2026, 3, 21), "sunrise 05:56, sunset 18:09"),
        (VIENNA, dt.date(2026, 6, 21), "sunrise 04:54, sunset 20:59"),
        (TROMSO, dt.date(2026, 12, 21), "the sun does not rise"),
        (TROMSO, dt.date(2026, 6, 21), "the sun does not set"),
    ],
)
def test_sunrise_and_sunset_are_told_on_the_local_clock(site, day, says):
    assert str(find_daylight(site, day)) == says


@pytest.mark.parametrize("day", [dt.date(2026, 1, 31), dt.date(2026, 6, 5), dt.date(2026, 10, 25)])
@pytest.mark.parametrize("site", [VIENNA, Site(-33.9, 18.4, "Africa/Johannesburg")])
def test_they_are_an_almanacs_to_half_a_minute(site, day):
    found = find_daylight(site, day)
    noon = dt.datetime.combine(day, dt.time(12))
    times = pd.DatetimeIndex([pd.Timestamp(noon, tz=site.zone)])
    told = pvlib.solarposition.sun_rise_set_transit_spa(times, site.latitude, site.longitude)
    assert abs(found.rises - told.sunrise.iloc[0]) < dt.timedelta(seconds=30)
    assert abs(found.sets - told.sunset.iloc[0]) < dt.timedelta(seconds=30)


def test_the_day_on_which_the_clock_goes_forward_has_its_own_hours():
    before, after = (find_daylight(VIENNA, dt.date(2026, 3, d)) for d in (28, 29))
    assert (before.rises.hour, after.rises.hour) == (5, 6)
    assert after.sets.date() == dt.date(2026, 3, 29)
