"""Rules of days and hours that the sun gives: solar time, terms, sunrise; solved by hand."""

import datetime as dt
import zoneinfo
from dataclasses import replace

import numpy as np
import pytest
from verdicts.scenes import find_lit, judge, make_model, rectangle, windows

from umbra.rules import Condition, read_rule
from umbra.sun import Site, find_sun
from umbra.verdicts.moments import find_sun_windows, find_term

BEIJING = Site(39.92, 116.4, "Asia/Shanghai")
TOKYO = Site(35.68, 139.77, "Asia/Tokyo")
SEOUL = Site(37.55, 126.99, "Asia/Seoul")
WARSAW = Site(52.23, 21.01, "Europe/Warsaw")
NEW_YORK = Site(40.71, -74.0, "America/New_York")
SAN_FRANCISCO = Site(37.77, -122.42, "America/Los_Angeles")
SYDNEY = Site(-33.87, 151.21, "Australia/Sydney")


def solar_suns(site, declination, first, last, minutes):
    """Return sun directions of steps in true solar time, by hour angle, and their length [h]."""
    middles = np.arange(first + minutes / 120, last, minutes / 60)
    angle, tilt = np.radians(15 * (middles - 12)), np.radians(declination)
    latitude = np.radians(site.latitude)
    up = np.sin(latitude) * np.sin(tilt) + np.cos(latitude) * np.cos(tilt) * np.cos(angle)
    east = -np.cos(tilt) * np.sin(angle)
    north = np.cos(latitude) * np.sin(tilt) - np.sin(latitude) * np.cos(tilt) * np.cos(angle)
    return np.stack([east, north, up], 1), minutes / 60


@pytest.mark.parametrize(
    ("longitude", "published"),
    [(116.37, "8:25:30"), (123.45, "7:57:02"), (108.94, "8:55:06"), (87.62, "10:20:18"),
     (113.30, "8:37:54")],
)  # fmt: skip
def test_true_solar_time_is_that_published_for_great_cold(longitude, published):
    site = Site(35, longitude, "Asia/Shanghai")
    days = find_term("great-cold", 2026, site.zone)
    assert days == [dt.date(2026, 1, 20)]
    condition = Condition(start="08:00", end="16:00", clock="solar")
    ((start, end),) = find_sun_windows(condition, days, site)
    local = dt.datetime.fromtimestamp(start / 1e6, zoneinfo.ZoneInfo(site.zone))
    hour, minute, second = map(int, published.split(":"))
    assert abs((local.hour * 60 + local.minute) * 60 + local.second
               - (hour * 60 + minute) * 60 - second) <= 45  # fmt: skip
    assert (end - start) / 3.6e9 == pytest.approx(8, abs=0.003)


@pytest.mark.parametrize(
    ("term", "year", "days"),
    [("winter-solstice", 2025, ["2025-12-21"]), ("summer-solstice", 2026, ["2026-06-21"]),
     ("equinox", 2026, ["2026-03-20", "2026-09-23"]), ("great-cold", 2027, ["2027-01-20"])],
)  # fmt: skip
def test_terms_are_those_of_almanacs(term, year, days):
    assert [str(day) for day in find_term(term, year, "Europe/London")] == days


def test_the_year_of_san_francisco_has_its_published_hours():
    days = [dt.date(2026, 1, 1) + dt.timedelta(k) for k in range(365)]
    spans = find_sun_windows(Condition(start="sunrise+1h", end="sunset-1h"), days, SAN_FRANCISCO)
    assert sum(b - a for a, b in spans) / 3.6e9 == pytest.approx(3720.8, abs=0.5)


def test_an_altitude_opens_and_closes_the_day():
    days = [dt.date(2026, 3, 21), dt.date(2026, 12, 21)]
    spans = find_sun_windows(Condition(start="altitude:10", end="altitude:10"), days, WARSAW)
    for span in spans:
        ends = find_sun(WARSAW, np.array(span).astype("datetime64[us]"))
        np.testing.assert_allclose(ends.altitude, 10, atol=0.01)
        assert ends.azimuth[0] < 180 < ends.azimuth[1]


PLOT = {"plot": rectangle(-12, -12, 12, 12)}
TOWER = {"tower": ((-7, -7, 0), (7, 7, 24))}


def test_japan_by_a_tower_on_a_grid_of_solar_hours():
    verdict = judge(make_model(TOWER, TOKYO, proposed=("tower",)), "japan-56-2:4m-4h", plot=PLOT)
    near, far = verdict.findings
    assert [one.where for one in verdict.findings] == ["5 to 10 m", "beyond 10 m"]
    directions, step = solar_suns(TOKYO, -23.43, 8, 16, 5)

    def find_most(low, high):
        """Return the most hours of shadow at a distance from the plot, north of it."""
        spots = [(x, y) for x in np.arange(-30, 30.1, 1.5) for y in np.arange(12, 60, 1.5)]
        most = 0.0
        for x, y in spots:
            away = np.hypot(max(abs(x) - 12, 0), max(abs(y) - 12, 0))
            if low <= away <= high:
                lit = find_lit(TOWER.values(), np.array([x, y, 4.0]), directions)
                most = max(most, step * float((~lit).sum()))
        return most

    for finding, low, high, limit in ((near, 5, 10, 4), (far, 10, 99, 2.5)):
        most = find_most(low, high)
        outcome = finding.outcome
        assert outcome.limit == limit
        assert outcome.value == pytest.approx(most, abs=0.35)
        assert outcome.value >= most - 0.1
        assert finding.verdict == ("pass" if outcome.value <= limit else "fail")
    assert verdict.verdict == "fail"
    low = {"house": ((-7, -7, 0), (7, 7, 9))}
    passes = judge(make_model(low, TOKYO, proposed=("house",)), "japan-56-2:4m-4h", plot=PLOT)
    assert passes.verdict == "pass"


@pytest.mark.parametrize(("width", "move"), [(6, 3.0), (16, 11.0)])
def test_japan_moves_the_boundary_across_a_road(width, move):
    """A road along the north side: bands lie as around a plot that reaches so far into it."""
    model = make_model(TOWER, TOKYO, proposed=("tower",))
    roads = {"road": rectangle(-200, 12, 200, 12 + width)}
    found = judge(model, "japan-56-2:4m-4h", plot=PLOT, roads=roads)
    moved = {"plot": rectangle(-12, -12, 12, 12 + move)}
    same = judge(model, "japan-56-2:4m-4h", plot=moved)
    plain = judge(model, "japan-56-2:4m-4h", plot=PLOT)
    values = [[one.outcome.value for one in each.findings] for each in (found, same, plain)]
    assert values[0] == pytest.approx(values[1], abs=0.17)  # squares lie elsewhere
    assert values[0][0] < values[2][0] - 0.3


def test_a_rule_that_moves_no_boundary_takes_the_plot_as_it_is():
    rule = read_rule("japan-56-2:4m-4h")
    kept = [
        replace(one, requirements=tuple(
            replace(each, across_roads=None) for each in one.requirements
        )) for one in rule
    ]  # fmt: skip
    model = make_model(TOWER, TOKYO, proposed=("tower",))
    roads = {"road": rectangle(-200, 12, 200, 28)}
    values = [
        [one.outcome.value for one in judge(model, kept, plot=PLOT, roads=given).findings]
        for given in (roads, None)
    ]
    assert values[0] == values[1]


def test_japan_without_a_zone_or_a_plot_is_unknown():
    model = make_model(TOWER, TOKYO, proposed=("tower",))
    verdict = judge(model, "japan-56-2")
    assert verdict.verdict == "unknown"
    assert "plot=" in verdict.findings[0].outcome.needs
    mixed = judge(model, read_rule("japan-56-2:4m-4h") + read_rule("japan-56-2:6.5m-5h"), plot=PLOT)
    words = {one.verdict for one in mixed.findings}
    assert words <= {"pass", "fail", "unknown"}


STREET = {"front": ((-60, -40, 0), (60, -26, 30)), "house": ((-20, 0, 0), (20, 10, 12))}


def hand_spell_hours(lit, step, least):
    """Return the hours in runs of at least ``least`` hours, and the longest run."""
    padded = np.concatenate([[0], lit.astype(int), [0]])
    turns = np.diff(padded)
    runs = (np.flatnonzero(turns == -1) - np.flatnonzero(turns == 1)) * step
    return float(runs[runs >= least - 1e-9].sum()), float(runs.max(initial=0.0))


@pytest.mark.parametrize("height", [1.0, 7.0, 11.0])
def test_china_on_the_winter_solstice_by_solar_time(height):
    spot = (0.0, -0.001, height)
    normal = np.array([0.0, -1.0, 0.0])
    verdict = judge(
        make_model(STREET, BEIJING), "china-gb-50180:beijing-solstice", [windows([spot])]
    )
    directions, step = solar_suns(BEIJING, -23.43, 9, 15, 1)
    lit = find_lit(STREET.values(), np.array(spot), directions, normal)
    angle = np.degrees(np.arcsin(-directions[:, 1] / np.hypot(directions[:, 0], directions[:, 1])))
    hours, _ = hand_spell_hours(lit & (angle >= 12), step, 0.5)
    outcome = verdict.findings[0].outcome
    assert outcome.value == pytest.approx(hours, abs=0.06)
    assert str(outcome.date) == "2026-12-22"  # by the calendar of Beijing
    assert verdict.verdict == ("pass" if outcome.value >= 1 else "fail")


def test_china_leaves_out_the_sun_along_a_facade():
    boxes, east = {"house": STREET["house"]}, np.array([1.0, 0.0, 0.0])
    spot = (20.001, 5.0, 2.0)
    found = judge(make_model(boxes, BEIJING), "china-gb-50180:beijing-solstice",
                  [windows([spot], east)])  # fmt: skip
    directions, step = solar_suns(BEIJING, -23.43, 9, 15, 1)
    lit = find_lit(boxes.values(), np.array(spot), directions, east)
    angle = np.degrees(np.arcsin(directions[:, 0] / np.hypot(directions[:, 0], directions[:, 1])))
    hours = step * (lit & (angle >= 12)).sum()
    assert hours < step * lit.sum() - 0.5  # a facade toward the sun at noon
    assert found.findings[0].outcome.value == pytest.approx(hours, abs=0.06)


@pytest.mark.parametrize(("gap", "verdict"), [(8.0, "pass"), (3.0, "fail")])
def test_korea_takes_two_hours_without_a_break(gap, verdict):
    boxes = {"west": ((-200, -20, 0), (-gap, -10, 60)), "east": ((gap, -20, 0), (200, -10, 60))}
    spot = (0.0, 0.0, 2.0)
    found = judge(make_model(boxes, SEOUL), "korea-sunlight", [windows([spot])])
    whole, unbroken = found.findings[0].outcome.parts
    zone = zoneinfo.ZoneInfo(SEOUL.zone)
    noon = dt.datetime(2026, 12, 22, tzinfo=zone)
    middles = [noon + dt.timedelta(minutes=480 + 5 * k + 2.5) for k in range(96)]
    lit = find_lit(boxes.values(), np.array(spot), find_sun(SEOUL, middles).direction,
                   np.array([0.0, -1.0, 0.0]))  # fmt: skip
    assert whole.value == pytest.approx(lit.sum() / 12, abs=1e-3)
    assert unbroken.value == pytest.approx(hand_spell_hours(lit[12:84], 1 / 12, 0)[1], abs=1e-3)
    assert (whole.verdict, unbroken.verdict, found.verdict) == ("fail", verdict, verdict)


def test_poland_judges_each_equinox_by_itself():
    spots = [(0.0, -0.001, 2.0), (0.0, -0.001, 11.0)]
    verdict = judge(make_model(STREET, WARSAW), "poland-wt-60", [windows(spots)])
    assert [(str(one.outcome.date), one.where) for one in verdict.findings] == [
        ("2026-03-20", "w1"), ("2026-03-20", "w2"), ("2026-09-23", "w1"), ("2026-09-23", "w2"),
    ]  # fmt: skip
    zone = zoneinfo.ZoneInfo(WARSAW.zone)
    for finding in verdict.findings:
        begin = dt.datetime.combine(finding.outcome.date, dt.time(7), zone)
        sun = find_sun(WARSAW, [begin + dt.timedelta(minutes=5 * k + 2.5) for k in range(120)])
        spot = np.array(spots[0] if finding.where == "w1" else spots[1])
        lit = find_lit(STREET.values(), spot, sun.direction, np.array([0, -1, 0])) & sun.is_up
        assert finding.outcome.value == pytest.approx(lit.sum() / 12, abs=1e-3)
        assert finding.verdict == ("pass" if finding.outcome.value >= 3 else "fail")


PARK = {"park": rectangle(-3, 30, 3, 34)}


def test_new_york_tells_when_new_shadow_enters_and_leaves():
    model = make_model(TOWER, NEW_YORK, proposed=("tower",))
    verdict = judge(model, "nyc-ceqr", areas=PARK)
    assert sorted(str(one.outcome.date) for one in verdict.findings) == [
        "2026-03-21", "2026-05-06", "2026-06-21", "2026-12-21",
    ]  # fmt: skip
    corners = [(x, y, 0.0) for x in (-2.9, 0, 2.9) for y in np.linspace(30.1, 33.9, 9)]
    for finding in verdict.findings:
        day, outcome = finding.outcome.date, finding.outcome
        zone = zoneinfo.ZoneInfo(NEW_YORK.zone)
        begin = dt.datetime.combine(day, dt.time(), zone)
        middles = [begin + dt.timedelta(minutes=5 * k + 2.5) for k in range(288)]
        sun = find_sun(NEW_YORK, middles)
        ((first, last),) = find_sun_windows(
            Condition(start="sunrise+90min", end="sunset-90min"), [day], NEW_YORK
        )
        inside = np.array([first <= m.timestamp() * 1e6 <= last for m in middles]) & sun.is_up
        dark = np.zeros(288, bool)
        for corner in corners:
            dark |= ~find_lit(TOWER.values(), np.array(corner), sun.direction)
        hours = (dark & inside).sum() / 12
        assert outcome.value == pytest.approx(hours, abs=0.2)
        assert finding.verdict == ("pass" if outcome.value == 0 else "fail")
        if hours > 0.3:
            when = outcome.first.astype("datetime64[us]").item().replace(tzinfo=dt.UTC)
            expected = middles[int(np.argmax(dark & inside))]
            assert abs((when - expected).total_seconds()) <= 600
    assert {one.verdict for one in verdict.findings} == {"pass", "fail"}


def test_san_francisco_adds_a_year_of_net_new_shadow():
    wide = {"wall": ((-4000, -1, 0), (4000, 0, 10)), "tower": ((-4000, -1, 10), (4000, 0, 20))}
    model = make_model(wide, SAN_FRANCISCO, proposed=("tower",))
    rule = read_rule("sf-295")
    verdict = judge(model, rule, areas={"park": rectangle(-1, 8, 1, 9)})
    lost = dark = whole = 0.0
    days = [dt.date(2026, 1, 1) + dt.timedelta(k) for k in range(0, 365, 7)]  # of the year
    condition = Condition(start="sunrise+1h", end="sunset-1h")
    for first, last in find_sun_windows(condition, days, SAN_FRANCISCO):
        middles = np.arange(first + 450_000_000, last, 900_000_000).astype("datetime64[us]")
        directions = find_sun(SAN_FRANCISCO, middles).direction
        before = find_lit([wide["wall"]], np.array([0, 8.5, 0]), directions)
        after = find_lit(wide.values(), np.array([0, 8.5, 0]), directions)
        whole, dark = whole + len(middles), dark + (~before).sum()
        lost += (before & ~after).sum()
    outcome = verdict.findings[0].outcome
    assert outcome.value == pytest.approx(100 * lost / whole, abs=1.5)
    assert outcome.before == pytest.approx(100 * dark / whole, abs=1.5)
    assert verdict.verdict == "fail"


def test_new_shadow_without_a_proposal_is_unknown():
    for name in ("sf-295", "nyc-ceqr"):
        verdict = judge(make_model(TOWER, NEW_YORK), name, areas=PARK)
        assert verdict.verdict == "unknown"
        assert "proposed=" in verdict.findings[0].outcome.needs


def make_flats(lit, dark):
    """Return panes of living rooms and balconies of flats with sun, and without (facing south)."""
    points, names, owner, normals, flats, rooms = [], [], [], [], [], []
    for flat in range(lit + dark):
        for room in ("living", "balcony"):
            k = len(names)
            names.append(f"{flat}-{room}")
            flats.append(f"F{flat}")
            rooms.append(room)
            for dx in (-0.5, 0.5):
                points.append((10 * flat + dx, 0.0, 2.0))
                owner.append(k)
                normals.append((0.0, 1.0 if flat < lit else -1.0, 0.0))
    from umbra.verdicts.subjects import Subjects  # noqa: PLC0415

    return Subjects(
        kind="windows", names=tuple(names), owner=np.array(owner), points=np.array(points),
        normals=np.array(normals), areas=np.full(len(points), 0.8),
        azimuths=np.zeros(len(names)), flats=tuple(flats), rooms=tuple(rooms),
        storeys=("",) * len(names),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("lit", "dark", "verdicts"),
    [(9, 1, ("pass", "pass")), (8, 2, ("pass", "fail")), (6, 4, ("fail", "fail"))],
)
def test_new_south_wales_counts_flats(lit, dark, verdicts):
    model = make_model({"far": ((900, 900, 0), (901, 901, 1))}, SYDNEY)
    verdict = judge(model, "nsw-adg-4a", [make_flats(lit, dark)])
    assert tuple(one.verdict for one in verdict.findings) == verdicts
    assert [one.outcome.value for one in verdict.findings] == [10.0 * lit, 10.0 * dark]
    assert verdict.findings[0].because == f"{lit} of 10 flats"


def test_a_square_metre_must_be_lit_at_one_moment():
    flats = make_flats(2, 0)
    flats.areas[:] = 0.4  # panes of 0.8 m2 never have 1 m2
    model = make_model({"far": ((900, 900, 0), (901, 901, 1))}, SYDNEY)
    assert judge(model, "nsw-adg-4a", [flats]).findings[0].outcome.value == 0


def test_a_flat_without_a_balcony_is_unknown():
    flats = make_flats(3, 0).pick([0, 1, 2, 3, 4])
    model = make_model({"far": ((900, 900, 0), (901, 901, 1))}, SYDNEY)
    finding = judge(model, "nsw-adg-4a", [flats]).findings[0]
    assert finding.verdict == "unknown"
    assert "'F2' has no balcony" in finding.outcome.needs
