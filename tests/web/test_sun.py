"""The page's sun and clocks, run by Chromium, against umbra's."""

import json
from datetime import UTC, datetime
from zoneinfo import ZoneInfo

import numpy as np
import pytest

from umbra.sun import Site, find_daylight, find_sun
from umbra.web.bundle import bundle


def call(page, module, expression):
    return page.ask(f"(() => {{ {bundle(module)}\nreturn {expression}; }})()")


def test_the_sun_agrees_to_a_hundredth_of_a_degree(page):
    rng = np.random.default_rng(3)
    first, last = (datetime(year, 1, 1, tzinfo=UTC).timestamp() * 1000 for year in (1950, 2051))
    lines = []
    for latitude in [-90.0, -66.5, -23.4, 0.0, 23.4, 48.2, 66.5, 90.0, *rng.uniform(-90, 90, 92)]:
        elevation = float(rng.choice([-400.0, 0.0, 4000.0]))
        turn, longitude = float(rng.uniform(-180, 180)), float(rng.uniform(-180, 180))
        site = Site(latitude, longitude, "UTC", elevation=elevation, true_north=turn)
        instants = rng.integers(int(first), int(last), 40)
        path = find_sun(site, instants.astype("datetime64[ms]"))
        lines.append((site, instants, path))
    asked = [
        {"latitude": site.latitude, "longitude": site.longitude, "elevation": site.elevation,
         "trueNorth": site.true_north, "instants": instants.tolist()}
        for site, instants, _ in lines
    ]  # fmt: skip
    found = call(
        page, "sun",
        f"{json.dumps(asked)}.map((site) => site.instants.map((at) => "
        "{ const sun = $sun.findSun(site, at); "
        "return [sun.altitude, sun.azimuth, ...sun.direction]; }))",
    )  # fmt: skip
    for (_, _, path), rows in zip(lines, np.array(found), strict=True):
        off = np.linalg.norm(np.cross(path.direction, rows[:, 2:]), axis=1)
        assert np.degrees(off).max() < 0.003
        assert np.abs(path.altitude - rows[:, 0]).max() < 0.003
        around = (path.azimuth - rows[:, 1] + 180) % 360 - 180
        assert np.abs(around * np.cos(np.radians(path.altitude))).max() < 0.003


@pytest.mark.parametrize(
    ("place", "day"),
    [((48.2, 16.37, "Europe/Vienna"), "2026-03-29"),
     ((-33.9, 151.2, "Australia/Sydney"), "2026-12-21"),
     ((69.6, 18.96, "Europe/Oslo"), "2026-06-21"), ((69.6, 18.96, "Europe/Oslo"), "2026-12-21"),
     ((27.7, 85.3, "Asia/Kathmandu"), "2026-08-01")],
)  # fmt: skip
def test_sunrise_and_sunset_agree_to_two_seconds(page, place, day):
    light = find_daylight(Site(*place), datetime.fromisoformat(day).date())
    given = json.dumps({"latitude": place[0], "longitude": place[1], "elevation": 0,
                        "trueNorth": 0, "zone": place[2]})  # fmt: skip
    found = call(page, "daylight", f"new $daylight.Daylight({given}).day('{day}')")
    for instant, when in ((found["rise"], light.rises), (found["set"], light.sets)):
        assert (instant is None) == (when is None)
        if when:
            assert abs(instant / 1000 - when.timestamp()) < 2


def test_clocks_agree_with_the_zone_database(page):
    rng = np.random.default_rng(5)
    zones = ["Europe/Vienna", "America/St_Johns", "Asia/Kathmandu", "Pacific/Kiritimati",
             "Australia/Lord_Howe", "UTC"]  # fmt: skip
    cases = []
    for zone in zones:
        for at in rng.integers(0, 2_200_000_000, 40).tolist():
            local = datetime.fromtimestamp(at, ZoneInfo(zone))
            cases.append((zone, at * 1000, local))
    asked = json.dumps([(zone, at) for zone, at, _ in cases])
    found = call(
        page, "clock",
        f"{asked}.map(([zone, at]) => {{ const c = $clock.readClock(zone, at); "
        "return [c.date, c.minutes, $clock.findInstant(zone, c.date, c.minutes)]; })",
    )  # fmt: skip
    for (_, at, local), (date, minutes, back) in zip(cases, found, strict=True):
        assert date == local.date().isoformat()
        assert minutes == pytest.approx(local.hour * 60 + local.minute + local.second / 60)
        if (
            local.utcoffset() == local.replace(fold=1 - local.fold).utcoffset()
        ):  # not a doubled hour
            assert back == at


@pytest.mark.parametrize(
    ("date", "minutes", "utc"),
    [("2026-03-29", 90, "2026-03-29T00:30"), ("2026-03-29", 180, "2026-03-29T01:00"),
     ("2026-03-29", 150, "2026-03-29T01:30"),  # skipped: the old clock
     ("2026-10-25", 150, "2026-10-25T00:30"),  # twice: the first
     ("2026-10-25", 1440, "2026-10-25T23:00")],
)  # fmt: skip
def test_clock_times_around_jumps_have_instants(page, date, minutes, utc):
    found = call(page, "clock", f"$clock.findInstant('Europe/Vienna', '{date}', {minutes})")
    assert found == datetime.fromisoformat(f"{utc}+00:00").timestamp() * 1000


def test_times_and_dates_are_read_as_typed(page):
    texts = ["9", "09:30", "9.30", "24:00", "9:60", "x", "", "23:59"]
    found = call(page, "clock", f"{json.dumps(texts)}.map($clock.parseMinutes)")
    assert found == [540, 570, 570, None, None, None, None, 1439]
    dates = ["2026-02-29", "2024-02-29", "2026-13-01", "26-1-1"]
    assert call(page, "clock", f"{json.dumps(dates)}.map($clock.isDate)") == [
        False,
        True,
        False,
        False,
    ]
    assert call(page, "clock", "$clock.addDays('2024-02-28', 2)") == "2024-03-01"
