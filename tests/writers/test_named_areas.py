"""Named areas come first: in the lines at a study's end and in the report's tables."""

import datetime as dt

import pytest
import shapely
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene
from umbra.sun import name_date
from umbra.writers.folder.captions import outline_areas
from umbra.writers.folder.elevation_sheet import find_window
from umbra.writers.folder.summary import tell_answers
from umbra.writers.picture_content import Plan
from umbra.writers.report.area_rows import list_areas

VIENNA = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
DATES = ["2026-03-21", "2026-12-21"]
GARDENS = {"north": shapely.box(-10, 2, 10, 22), "far": shapely.box(30, -40, 50, -30)}


def study(dates=DATES, gardens=GARDENS):
    tower = Part("tower", "", Mesh(*box((-8, -10, 0), (8, 0, 25))))
    return umbra.shadow_study(
        make_scene([tower]), VIENNA, date=dates, start="08:00", end="17:00", every="30min",
        receivers="areas", areas=gardens, proposed="tower", ground=0.0, cell=2.0,
    )  # fmt: skip


@pytest.fixture(scope="module")
def found():
    return study()


def test_the_lines_begin_with_each_area_and_date(found):
    lines = tell_answers(found.result, ["tower"])
    shares = found.result.areas.columns["share_2h"]
    before = found.result.areas.columns["share_2h_before"]
    assert shares[0].max() < before[0].min()
    expected = [
        f"{name}: {100 * shares[k, d]:.1f} % of {size} m² has at least 2 h of sun on "
        f"{name_date(dt.date.fromisoformat(date))} "
        f"from 08:00 to 17:00 "
        f"({100 * before[k, d]:.1f} % before)"
        for k, (name, size) in enumerate((("north", 400), ("far", 200)))
        for d, date in enumerate(DATES)
    ]
    assert lines[:4] == expected
    assert len(lines) > 4


def test_of_many_areas_the_worst_are_told_on_their_worst_date():
    gardens = {f"g{k}": shapely.box(-10 + 6 * k, 2, -5 + 6 * k, 7) for k in range(10)}
    some = study(gardens=gardens)
    lines = tell_answers(some.result)
    worst = some.result.areas.columns["share_2h"].min(1)
    told = [float(line.split(": ")[1].split(" %")[0]) for line in lines[:8]]
    assert told == pytest.approx(sorted(100 * worst)[:8], abs=0.051)
    assert lines[8].startswith("and 2 more areas")


def test_the_table_has_each_figure_before_and_after(found):
    table, areas = list_areas(found.result), found.result.areas
    assert [row[:4] for row in table.rows] == [
        (name, date, "08:00 to 17:00", size)
        for name, size in (("north", 400.0), ("far", 200.0))
        for date in DATES
    ]
    columns = areas.columns
    for k in range(2):
        for d in range(2):
            row = table.rows[2 * k + d]
            figures = [round(100 * float(columns[f"share_2h{end}"][k, d]), 1)
                       for end in ("_before", "")]  # fmt: skip
            for name in ("mean", "least", "most"):
                for end in ("_before", ""):
                    figures.append(round(float(columns[f"{name}_sun_hours{end}"][k, d]), 2))
            assert list(row[4:12]) == figures
            assert len(row) == len(table.columns) == 16
    first = columns["first_sun"][1, 0].astype("datetime64[m]").item()  # UTC; the clock is CET
    assert table.rows[2][13] == f"{first.hour + 1:02}:{first.minute:02}"


def test_the_report_lists_areas_before_other_tables(found, tmp_path):
    page = found.report(tmp_path / "report.html").read_text("utf-8")
    assert 0 < page.find("Named areas") < page.find("Before and after")


def test_verdicts_tell_the_hours_that_they_count_beside_a_map_of_others(tmp_path):
    """A garden has a share of the study's hours, and one of the rule's whole day."""
    study(dates=DATES[:1]).write(tmp_path, rules="bre-209-gardens", report=True)
    page = (tmp_path / "report.html").read_text()
    assert (
        "on 21 March 2026, sunrise to sunset, where the rule asks for at least 2 h of sun" in page
    )
    assert "on 21 March 2026 from 08:00 to 17:00" in page


def test_a_sheet_s_plan_holds_all_areas():
    tower = make_scene([Part("tower", "", Mesh(*box((-8, -10, 0), (8, 0, 25))))])
    found = umbra.shadow_study(
        tower, VIENNA, date=DATES[0], start="11:00", end="13:00", every="1h", cell=4.0,
        areas={"far": shapely.box(-140, -90, -120, -70)},
    )  # fmt: skip
    laid = found.result
    plan = Plan(laid.x, laid.y, areas=outline_areas(laid.named_areas))
    (low, high), _ = find_window(laid, plan, found.options)
    assert (low < (-140, -90)).all()
    assert (high > (8, 0)).all()
    (low, _), _ = find_window(laid, Plan(laid.x, laid.y), found.options)
    assert low[0] > -40
