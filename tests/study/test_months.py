"""Hours by month of many dates: they are those of each month alone, and add up to all."""

import csv

import numpy as np
import pytest
from support.days import parts
from support.shapes import box

import umbra

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
DATES = {"date": "2026", "every_days": 15, "every": "1h"}
YEAR = {**DATES, "threads": 1}
PLAN = {"receivers": "ground", "cell": 4.0, "extent": (-20, -20, 20, 40), "ground": 0.0}


@pytest.fixture(scope="module")
def scene():
    return parts(wall=box((-10, -1, 0), (10, 0, 10)), tower=box((4, 10, 0), (9, 15, 20)))


@pytest.mark.parametrize(
    "more",
    [
        PLAN,
        {"receivers": "surfaces", "spacing": 3.0},
        {**PLAN, "spells": True},
        {**PLAN, "proposed": ["tower"]},
        {**PLAN, "canopy": "tower", "transmissivity": "0.3:0.6", "leaf_on": "04-15..10-31"},
        {**PLAN, "disc": True},
    ],
    ids=["plan", "surfaces", "spells", "proposal", "leaves", "disc"],
)
def test_a_month_is_the_mean_of_its_dates(scene, more):
    study = umbra.shadow_study(scene, SITE, **YEAR, **more)
    found, days = study.dataset, np.array(study.result.period.days, "datetime64[D]")
    assert found.month.values.tolist() == list(range(1, 13))
    dates = [d for d in days if d.astype("datetime64[M]") == np.datetime64("2026-10")]
    alone = umbra.shadow_study(
        scene, SITE, **{**YEAR, **more, "date": [str(d) for d in dates], "every_days": 1}
    ).dataset
    assert int(found.dates_by_month[9]) == len(dates) == 2
    np.testing.assert_allclose(found.shadow_hours_by_month[9], alone.shadow_hours / 2, atol=2e-6)
    assert float(alone.shadow_hours.max()) / 2 - float(alone.shadow_hours.min()) / 2 > 0.2
    whole = (found.sun_hours_by_month * found.dates_by_month).sum("month")
    np.testing.assert_allclose(whole, found.sun_hours.fillna(0), atol=1e-3)


def test_the_sum_of_all_has_the_same_bytes_with_months(scene):
    """Also of steps that no binary fraction is."""
    asked = {**YEAR, **PLAN, "every": "10min", "date": "2026-02-20..2026-03-10", "every_days": 1}
    found, alone = (umbra.shadow_study(scene, SITE, **asked, by_day=by).dataset
                    for by in (None, False))  # fmt: skip
    assert found.shadow_hours.values.tobytes() == alone.shadow_hours.values.tobytes()
    assert found.month.values.tolist() == [2, 3]
    assert "month" not in alone.variables


def test_many_dates_write_their_months_unasked(scene, tmp_path):
    asked = {"date": "2026-06-24..2026-07-09", "every": "2h", "threads": 1}
    study = umbra.shadow_study(scene, SITE, **asked, **PLAN)
    names = {path.name for path in study.write(tmp_path, report=True)}
    assert {"months.png", "months.csv", "report.html"} <= names
    rows = list(csv.DictReader((tmp_path / "months.csv").open()))
    assert [(int(row["month"]), int(row["dates"])) for row in rows] == [(6, 7), (7, 9)]
    counted = study.result.kind.find_counted(study.result)
    mean = counted.average(study.sun_hours_by_month.values[1])
    assert float(rows[1]["mean_sun_hours"]) == pytest.approx(mean, rel=1e-5)
    assert float(rows[1]["share_of_possible"]) == pytest.approx(mean / 8, rel=1e-5)
    assert "Month by month" in (tmp_path / "report.html").read_text()
