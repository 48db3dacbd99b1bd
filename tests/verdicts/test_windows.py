"""Rules of windows across a street, solved by hand."""

import datetime as dt

import numpy as np
import pytest
from verdicts.scenes import (
    LONDON,
    SOUTH,
    find_lit,
    find_suns,
    hand_hours,
    judge,
    make_model,
    windows,
)

from umbra.verdicts.sunlight import SunlightOf

CANYON = {"south": ((-1000, -30, 0), (1000, -20, 12)), "house": ((-20, 0, 0), (20, 10, 12))}
FLOORS = [(0.0, -0.001, 1.5), (0.0, -0.001, 4.5), (0.0, -0.001, 10.5)]


def hand_vsc(angle):
    """
    Return the sky component of a wall before an endless obstruction, by midpoints [%].

    Overcast sky of the CIE, in the half of directions before the wall whose angle in the section
    is above ``angle``.
    """
    altitude = np.radians((np.arange(900) + 0.5) / 10)[:, None]
    azimuth = np.radians(np.arange(-900, 900) / 10 + 0.05)
    section = np.arctan2(np.sin(altitude), np.cos(altitude) * np.cos(azimuth))
    light = (1 + 2 * np.sin(altitude)) / 3 * np.cos(altitude)
    seen = light * np.cos(altitude) * np.cos(azimuth) * (section > np.radians(angle))
    whole = np.pi * 7 / 9
    return 100 * seen.sum() * np.radians(0.1) ** 2 / whole


def test_the_sky_of_a_street_canyon():
    assert hand_vsc(0) == pytest.approx(39.6, abs=0.05)  # published
    assert hand_vsc(25) == pytest.approx(27, abs=0.5)  # the guide's rule of thumb
    verdict = judge(make_model(CANYON, proposed=("south",)), "bre-209-vsc", [windows(FLOORS)])
    for (_, _, z), finding in zip(FLOORS, verdict.findings, strict=True):
        angle = np.degrees(np.arctan2(12 - z, 20))
        share, ratio = finding.outcome.parts
        assert share.value == pytest.approx(hand_vsc(angle), abs=0.15)
        assert share.before == pytest.approx(39.62, abs=0.05)
        assert ratio.value == pytest.approx(share.value / share.before)
        assert finding.verdict == ("pass" if share.value >= 27 or ratio.value >= 0.8 else "fail")
    assert [one.verdict for one in verdict.findings] == ["fail", "pass", "pass"]


def test_probable_sun_of_a_street_canyon():
    verdict = judge(make_model(CANYON, proposed=("south",)), "bre-209-apsh", [windows(FLOORS[:1])])
    days = np.datetime64("2001-01-01") + np.arange(365)
    whole = lit_hours = winter = 0.0
    for day in days.astype(str):
        directions, hours, _, _ = find_suns(LONDON, day, "00:00", "24:00", "15min")
        lit = find_lit([CANYON["south"]], np.array(FLOORS[0]), directions, np.array(SOUTH))
        whole += hours.sum()
        lit_hours += hours[lit].sum()
        winter += hours[lit].sum() if day >= "2001-09-21" or day <= "2001-03-21" else 0.0
    year, cold = verdict.findings[0].outcome.parts[0].parts
    assert year.value == pytest.approx(100 * lit_hours / whole, abs=0.1)
    assert cold.value == pytest.approx(100 * winter / whole, abs=0.1)
    assert (year.limit, cold.limit) == (25, 5)


@pytest.mark.parametrize(
    ("before", "after", "variant", "verdict"),
    [
        ((26, 2), (12, 1), "as-cited", "fail"),  # the published case, a loss of 54 %
        ((40, 9), (26, 6), "as-cited", "pass"),
        ((24, 6), (21, 5), "as-cited", "pass"),
        ((10, 4), (7, 3), "as-cited", "fail"),
        ((10, 4), (7, 3), "either", "pass"),  # 3 points are little
        ((24, 4), (19.5, 3.5), "as-cited", "fail"),
        ((24, 4), (19.5, 3.5), "either", "pass"),
    ],
)
def test_probable_sun_by_arithmetic(monkeypatch, before, after, variant, verdict):
    shares = {"before": before, "after": after}

    def measure(self, name, which):
        return np.array([shares[which][name.startswith("winter")]], float)

    monkeypatch.setattr(SunlightOf, "measure_sky", measure)
    found = judge(make_model(CANYON, proposed=("south",)), f"bre-209-apsh:{variant}",
                  [windows(FLOORS[:1])])  # fmt: skip
    assert found.verdict == verdict


def test_windows_that_face_north_are_not_asked_of():
    away = windows(FLOORS[:1], (0.0, 1.0, 0.0))
    verdict = judge(make_model(CANYON, proposed=("south",)), "bre-209-apsh", [away])
    assert verdict.verdict == "pass"
    assert [one.members for one in verdict.findings] == [()]
    assert any("1 of 1" in note for note in verdict.notes)


def list_dates(first, last):
    day = dt.date.fromisoformat(first)
    while day <= dt.date.fromisoformat(last):
        yield day.isoformat()
        day += dt.timedelta(1)


def test_en_17037_takes_the_best_date_and_names_the_level():
    model = make_model(CANYON)
    for lowest in (0, 13):
        verdict = judge(model, f"en-17037-sunlight:lowest_sun={lowest}", [windows(FLOORS)])
        for point, finding in zip(FLOORS, verdict.findings, strict=True):
            dates = [*list_dates("2026-02-01", "2026-03-21")]
            hours = [hand_hours(CANYON, point, LONDON, day, every="10min", altitude=lowest,
                                normal=np.array(SOUTH)) for day in dates]  # fmt: skip
            best = max(hours)
            outcome = finding.outcome
            assert outcome.value == pytest.approx(best, abs=1e-3)
            assert str(outcome.date) == dates[int(np.argmax(hours))]
            level = next((name for name, least in (("high", 4), ("medium", 3), ("minimum", 1.5))
                          if best >= least), "")  # fmt: skip
            assert (outcome.level, finding.verdict) == (level, "pass" if level else "fail")
    assert any("name no flat" in note for note in verdict.notes)


def test_en_17037_without_a_lowest_sun_is_unknown_where_it_matters():
    # A wall that leaves the low sun alone.
    boxes = {"beam": ((-1000, -6, 8), (1000, -5, 300))}
    low = [(0.0, 0.0, 6.0)]
    below = hand_hours(boxes, low[0], LONDON, "2026-02-01", every="10min", normal=np.array(SOUTH))
    assert below > 1.5
    verdict = judge(make_model(boxes), "en-17037-sunlight", [windows(low)])
    (finding,) = verdict.findings
    assert finding.verdict == "unknown"
    assert finding.variants == ("every-sun", "czechia", "high-sun")
    assert "rules='en-17037-sunlight:every-sun'" in finding.outcome.needs
    for variant, expected in (("every-sun", "pass"), ("high-sun", "fail")):
        assert judge(make_model(boxes), f"en-17037-sunlight:{variant}",
                     [windows(low)]).verdict == expected  # fmt: skip


def test_one_room_of_a_flat_is_enough():
    flats = ("A", "A", "B")
    given = windows([FLOORS[2], (0.0, 10.001, 3.0), (5.0, 10.001, 3.0)], flats=flats)
    given.normals[1:] = (0, 1, 0)
    verdict = judge(make_model(CANYON), "en-17037-sunlight:every-sun", [given])
    assert [(one.kind, one.where, one.verdict) for one in verdict.findings] == [
        ("flat", "A", "pass"), ("flat", "B", "fail"),
    ]  # fmt: skip
    assert verdict.findings[0].because == "w1"
    assert verdict.findings[0].members == ("w1", "w2")


@pytest.mark.parametrize(("name", "first", "last", "least"), [
    ("tno-light", "2026-02-19", "2026-10-21", 2), ("tno-strict", "2026-01-21", "2026-11-22", 3),
])  # fmt: skip
def test_tno_takes_the_worst_date(name, first, last, least):
    verdict = judge(make_model(CANYON), name, [windows(FLOORS[1:])])
    ends = [*list_dates(first, last)]
    for point, finding in zip(FLOORS[1:], verdict.findings, strict=True):
        some = [*ends[:4], *ends[-4:], *ends[60:200:10]]
        hours = {day: hand_hours(CANYON, point, LONDON, day, every="10min",
                                 normal=np.array(SOUTH)) for day in some}  # fmt: skip
        outcome = finding.outcome
        assert first <= str(outcome.date) <= last
        assert outcome.value <= min(hours.values()) + 1e-3
        again = hand_hours(CANYON, point, LONDON, str(outcome.date), every="10min",
                           normal=np.array(SOUTH))  # fmt: skip
        assert outcome.value == pytest.approx(again, abs=1e-3)
        assert finding.verdict == ("pass" if again >= least else "fail")


def test_the_hague_counts_the_sun_from_10_degrees():
    given = [windows(FLOORS[2:])]
    value = {}
    for variant in ("as-tno", "den-haag"):
        outcome = judge(make_model(CANYON), f"tno-light:{variant}", given).findings[0].outcome
        value[variant] = outcome.value
        day = str(outcome.date)
        lowest = {"as-tno": 0, "den-haag": 10}[variant]
        assert outcome.value == pytest.approx(
            hand_hours(CANYON, FLOORS[2], LONDON, day, every="10min", normal=np.array(SOUTH),
                       altitude=lowest), abs=1e-3,
        )  # fmt: skip
    assert value["den-haag"] < value["as-tno"]


def test_germany_tells_minutes_before_and_after_and_gives_no_verdict():
    verdict = judge(make_model(CANYON, proposed=("south",)), "germany-before-after",
                    [windows(FLOORS[:1])])  # fmt: skip
    assert verdict.verdict == "unknown"
    assert len(verdict.findings) == 4
    for finding in verdict.findings:
        day, outcome = str(finding.outcome.date), finding.outcome
        after = hand_hours(CANYON, FLOORS[0], LONDON, day, every="1min", normal=np.array(SOUTH))
        before = hand_hours({}, FLOORS[0], LONDON, day, every="1min", normal=np.array(SOUTH))
        assert outcome.value == pytest.approx(after, abs=1e-3)
        assert outcome.before == pytest.approx(before, abs=1e-3)
        assert outcome.margin is None
