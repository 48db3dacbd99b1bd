"""Tables of several dates: each says what a study of that date alone says."""

import csv
import json

import numpy as np
import pytest
from support.days import parts
from support.shapes import box, moved

from umbra.study import run_study
from umbra.sun import Site
from umbra.writers.csv_tables import write_cells, write_samples
from umbra.writers.output_formats import Job
from umbra.writers.outputs import write_formats
from umbra.writers.report.sample_tables import list_receivers
from umbra.writers.report.tables import find_comparisons, find_sun_areas, list_dates
from umbra.writers.vectors import find_hour_lines, make_line_layer

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
DATES = ("2026-03-21", "2026-12-21")
ASKED = {
    "start": "09:00", "end": "15:00", "every": "1h", "proposed": ["tower"], "by": "part",
    "under": "3h",
}  # fmt: skip


@pytest.fixture(scope="module")
def street():
    return parts(
        tower=box((-3, -8, 0), (3, -4, 13)),
        house=box((-5, 4, 0), (5, 10, 4)),
        shed=moved(box((0, 0, 0), (3, 3, 2)), (8, 5, 0)),
    )


def run(street, receivers, date, **more):
    if receivers in {"surfaces", "points"}:
        own = {"spacing": 1.0} if receivers == "surfaces" else {"points": [(0, 0, 0), (0, 3, 1)]}
        return run_study(street, VIENNA, receivers=receivers, date=date, **own, **ASKED, **more)
    place = {"extent": (-18, -14, 18, 24), "cell": 1.0, "ground": 0.0}
    return run_study(street, VIENNA, receivers=receivers, date=date, **place, **ASKED, **more)


def list_tables(study):
    found = [*find_comparisons(study), find_sun_areas(study)]
    return found + (list_receivers(study) if study.receivers in {"surfaces", "points"} else [])


@pytest.mark.parametrize("receivers", ["ground", "top", "surfaces", "points"])
def test_tables_have_the_rows_of_each_date(street, receivers):
    several = run(street, receivers, DATES)
    alone = [list_tables(run(street, receivers, date)) for date in DATES]
    for k, table in enumerate(list_tables(several)):
        assert table.columns[0] == "date"
        assert "sum" not in table.title
        for date, tables in zip(DATES, alone, strict=True):
            mine = [row[1:] for row in table.rows if row[0] == date]
            assert sorted(mine, key=str) == sorted(tables[k].rows, key=str), table.title
            assert (table.title, tuple(table.columns[1:])) == (
                tables[k].title,
                tuple(tables[k].columns),
            )
            assert len(table.index) == sum(len(each[k].index) for each in alone)
    by_date = list_dates(several)
    assert [row[0] for row in by_date.rows] == list(DATES)
    assert by_date.rows[0][1] == "sunrise 05:56, sunset 18:09"
    assert by_date.rows[0][2] == 6
    assert list_dates(run(street, receivers, DATES[0])) is None


def test_a_table_of_sums_says_so_and_has_no_limit(street):
    summed = run(street, "top", DATES, by_day=False)
    tables = list_tables(summed)
    assert all(table.title.endswith(", sum of 2 dates") for table in tables)
    before, neighbours = tables[0], tables[1]
    names = [row[1] for row in before.rows]
    assert not [name for name in names if "3 h of sun" in name]
    told = [row for row in before.rows if row[1].startswith("newly under 3 h on at least one")][-1]
    assert told[2:] == (0, (newly := int(summed.more["newly_under"][1].sum())), newly)
    assert newly > 0
    assert "newly under 3 h on at least one date [m²]" in neighbours.columns


def test_csv_has_a_column_for_each_date(street, tmp_path):
    several = run(street, "ground", DATES)
    write_cells(tmp_path / "cells.csv", several)
    found = np.genfromtxt(tmp_path / "cells.csv", delimiter=",", names=True, deletechars="")
    assert not {"sun_hours", "shadow_hours", "hours_lost", "newly_under"} & set(found.dtype.names)
    for date in DATES:
        alone = run(street, "ground", date)
        np.testing.assert_allclose(found[f"sun_hours_{date}"], alone.sun_hours.ravel(), atol=1e-4)
        lost = alone.more["hours_lost"][1].ravel()
        np.testing.assert_allclose(found[f"hours_lost_{date}"], lost, atol=1e-4)
        before = run_study(
            street, VIENNA, receivers="ground", date=date, no_cast=["tower"],
            extent=(-18, -14, 18, 24), cell=1.0, ground=0.0, start="09:00", end="15:00", every="1h",
        ).sun_hours.ravel()  # fmt: skip
        kept = found[f"sun_kept_{date}"]
        has_sun = np.isfinite(lost) & (before > 0)
        np.testing.assert_allclose(kept[has_sun], 1 - lost[has_sun] / before[has_sun], atol=1e-4)
        assert np.isnan(kept[~has_sun]).all()
        assert (kept < 0.8).any()
    write_cells(tmp_path / "sums.csv", run(street, "ground", DATES, by_day=False))
    head = (tmp_path / "sums.csv").read_text().partition("\n")[0].split(",")
    assert {"sun_hours_sum", "shadow_hours_sum", "hours_lost_sum", "newly_under"} <= set(head)
    write_samples(tmp_path, run(street, "surfaces", DATES))
    with (tmp_path / "surfaces.csv").open(encoding="utf-8") as file:
        surfaces = list(csv.DictReader(file))
    assert [row["surface"] for row in surfaces] == list(map(str, range(len(surfaces))))
    assert {row["surface_part"] for row in surfaces} == {"tower", "house", "shed"}
    head = (tmp_path / "parts.csv").read_text().partition("\n")[0].split(",")
    assert {f"part_mean_sun_hours_{date}" for date in DATES} <= set(head)


def test_lines_and_models_are_of_each_date(street, tmp_path):
    pytest.importorskip("ezdxf")
    pytest.importorskip("shapely")
    several = run(street, "ground", DATES)
    lines = list(find_hour_lines(several))
    for date in DATES:
        mine = [line for line in lines if line.date == date]
        alone = list(find_hour_lines(run(street, "ground", date)))
        assert [line.shadow_hours for line in mine] == [line.shadow_hours for line in alone]
        for one, other in zip(mine, alone, strict=True):
            for a, b in zip(one.lines, other.lines, strict=True):
                np.testing.assert_allclose(a, b)
    assert make_line_layer(lines).values["date"] == [line.date for line in lines]
    names = write_formats(Job(several, tmp_path, "street", print), ["dxf", "glb"])
    assert set(names) == {"study.dxf", *(f"hours_{date}.glb" for date in DATES)}
    drawn = (tmp_path / "study.dxf").read_text()
    assert all(f"HOURS_{date}_03" in drawn for date in DATES)
    summed = run(street, "ground", DATES, by_day=False)
    assert {line.date for line in find_hour_lines(summed)} == {"sum of 2 dates"}
    for date in DATES:  # one scale: its end is the longest date's
        data = (tmp_path / f"hours_{date}.glb").read_bytes()
        size = int.from_bytes(data[12:16], "little")
        extras = json.loads(data[20 : 20 + size])["asset"]["extras"]
        assert (extras["date"], extras["hours_of_darkest"]) == (date, 6.0)
