"""The sun of a view."""

import datetime as dt
from dataclasses import replace

import numpy as np
import pytest

import umbra
from umbra.calls.first_view import begin_view, settle_view
from umbra.calls.picture_options import ViewOptions
from umbra.errors import InputError
from umbra.lights import Horizon
from umbra.sun import Site, find_sun
from umbra.window.daylight import ProfilePeriod, Sun, find_daily_suns, find_day, tell_daylight_hours
from umbra.window.handles import find_handles
from umbra.window.view_file import from_json, save_view, to_json
from umbra.window.view_state import SUN

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
JUNE = dt.date(2026, 6, 21)
MARCH = dt.date(2026, 3, 21)
WEST = Horizon("west", "", np.array([0.0, 180.0, 200.0, 340.0]), np.array([0.0, 0.0, 20.0, 20.0]))


def test_by_clock_it_stands_where_the_sun_is():
    sun = Sun(site=VIENNA, date=JUNE, minutes=13 * 60)
    path = find_sun(VIENNA, np.datetime64("2026-06-21T11:00"))
    assert sun.place() == (path.azimuth[0], path.altitude[0])
    assert sun.direction() == pytest.approx(path.direction[0])
    assert sun.tell_place() == f"sun {path.altitude[0]:.1f}° high in the S ({path.azimuth[0]:.1f}°)"
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


def test_it_goes_behind_the_land():
    """The last minute of light is that in which the sun's own place meets a ridge of 20 degrees."""
    for north in (0.0, 130.0):
        site = replace(VIENNA, true_north=north)
        sun = Sun(site=site, date=MARCH, land=WEST)
        minutes = np.arange(12 * 60, 18 * 60)
        lit = [replace(sun, minutes=float(one)).light() is not None for one in minutes]
        level = [replace(sun, minutes=float(one), land=None).place()[1] for one in minutes]
        assert lit == [one >= 20 for one in level]
        assert 60 < lit.count(False) < 240
    late = replace(sun, minutes=17 * 60.0)
    assert (late.is_up, late.is_behind_land, late.light()) == (True, True, None)
    assert not replace(sun, minutes=60.0).is_behind_land  # at night the earth hides it
    east, west = (Sun(azimuth=turn, altitude=10.0, land=WEST).light() for turn in (90.0, 270.0))
    assert (east is not None, west) == (True, None)


def test_the_handle_stays_while_it_is_behind_the_land(tower):
    options = ViewOptions(date="2026-03-21", at="17:00", horizon=WEST)
    view = begin_view(settle_view(options, tower, VIENNA), tower, VIENNA, (400, 300))
    assert view.shining() == {}
    assert [one.number for one in find_handles(view, (400, 300))] == [SUN]


def test_suns_behind_the_land_are_hours_of_shadow(tower):
    """As in a study of the same land: the sun is up, and reaches nothing."""
    site, period = replace(VIENNA, true_north=-130.0), ProfilePeriod(12 * 60.0, 18 * 60.0, 30.0)
    suns = find_daily_suns(site, MARCH, period, WEST)
    told = {"date": "2026-03-21", "start": "12:00", "end": "18:00", "every": "30min"}
    study = umbra.shadow_study(
        tower, site, **told, receivers="points", points=[(20.0, 9, 1)], horizon=WEST
    )
    assert suns.total == find_daily_suns(site, MARCH, period).total
    assert suns.behind_land == float(study.shadow_hours[0])
    assert suns.hours.sum() == float(study.sun_hours[0])
    assert 0 < suns.behind_land < suns.total


def test_a_view_of_a_file_takes_the_land_of_the_call(tower, tmp_path):
    options = ViewOptions(date="2026-03-21", at="17:00", horizon=WEST)
    view = begin_view(options, tower, VIENNA, (400, 300))
    save_view(tmp_path / "v.json", view)
    assert from_json(to_json(view)).sun == replace(view.sun, land=None)
    again = replace(options, view=tmp_path / "v.json", date=None, at=None)
    assert begin_view(again, tower, VIENNA, (400, 300)).shining() == {}
    bare = replace(again, horizon=None)
    assert list(begin_view(bare, tower, VIENNA, (400, 300)).shining()) == [SUN]


def test_a_distance_is_of_a_raster(tower):
    with pytest.raises(InputError) as caught:
        ViewOptions(horizon=WEST, horizon_from="2km")
    assert caught.value.option == "horizon_from"
    assert ViewOptions(horizon=WEST).horizon is WEST
