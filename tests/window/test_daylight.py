"""The sun of a view."""

import datetime as dt
from dataclasses import replace

import numpy as np
import pytest

from umbra.sun import Site, find_sun
from umbra.window.daylight import Sun, find_day, tell_daylight_hours

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
JUNE = dt.date(2026, 6, 21)


def test_by_clock_it_stands_where_the_sun_is():
    sun = Sun(site=VIENNA, date=JUNE, minutes=13 * 60)
    path = find_sun(VIENNA, np.datetime64("2026-06-21T11:00"))
    assert sun.place() == (path.azimuth[0], path.altitude[0])
    assert sun.direction() == pytest.approx(path.direction[0])
    assert sun.light().position == pytest.approx([*path.direction[0], 0])


def test_true_north_turns_it():
    turned = Sun(site=replace(VIENNA, true_north=30.0), date=JUNE, minutes=13 * 60)
    plain = Sun(site=VIENNA, date=JUNE, minutes=13 * 60)
    turn = np.radians(30)
    x, y, z = plain.direction()
    expected = [np.cos(turn) * x + np.sin(turn) * y, np.cos(turn) * y - np.sin(turn) * x, z]
    assert turned.direction() == pytest.approx(expected)


def test_by_angles_it_stands_as_told():
    sun = Sun(azimuth=90, altitude=30)
    assert sun.direction() == pytest.approx([3**0.5 / 2, 0, 0.5])
    moved = sun.point_at(np.array([0.0, -2.0, 2.0]))
    assert (moved.azimuth, moved.altitude) == pytest.approx((180, 45))
    assert sun.point_at(np.array([0.0, 1.0, -1.0])).altitude == 1.0


def test_at_night_and_switched_off_it_gives_no_light():
    assert Sun(site=VIENNA, date=JUNE, minutes=60).light() is None
    assert Sun(shines=False).light() is None


def test_time_passes_round_the_day():
    sun = Sun(site=VIENNA, date=JUNE, minutes=1430)
    assert sun.pass_time(15).clock() == "00:05"
    assert sun.pass_time(-1430).clock() == "00:00"
    assert Sun(azimuth=350).pass_time(60).azimuth == 5


def test_playing_leaves_out_the_night():
    evening = Sun(site=VIENNA, date=JUNE, minutes=20 * 60 + 50)
    morning = evening.play(20)
    assert 0 < morning.place()[1] < 2
    assert morning.minutes < 6 * 60
    assert evening.play(1).minutes == evening.minutes + 1
    polar = Sun(site=Site(69.65, 18.96, "Europe/Oslo"), date=dt.date(2026, 12, 21), minutes=700)
    assert polar.play(20).minutes == 720


def test_the_day_of_the_jump_has_its_clock():
    spring = dt.date(2026, 3, 29)
    minutes, path = find_day(VIENNA, spring)
    assert len(minutes) == len(path.altitude) == 288
    before, after = (Sun(site=VIENNA, date=spring, minutes=m).when() for m in (90, 210))
    assert (after - before) == dt.timedelta(hours=2)  # of the clock
    assert after.utcoffset() - before.utcoffset() == dt.timedelta(hours=1)


def test_it_rises_and_sets_as_in_pages_and_reports():
    assert tell_daylight_hours(VIENNA, dt.date(2026, 3, 21)) == "sunrise 05:56, sunset 18:09"
    assert tell_daylight_hours(VIENNA, JUNE) == "sunrise 04:54, sunset 20:59"
    north = Site(69.65, 18.96, "Europe/Oslo")
    assert tell_daylight_hours(north, JUNE) == "the sun does not set"
    assert tell_daylight_hours(north, dt.date(2026, 12, 21)) == "the sun does not rise"
