"""``umbra study`` along the time axis: spells and several days in study.nc."""

from importlib.util import find_spec

import numpy as np
import pytest
import xarray as xr
from support.model_files import save_obj
from support.shapes import box, moved

from umbra.writers import painter

ENGINES = ["h5netcdf"] + (["netcdf4"] if find_spec("netCDF4") else [])
HALF_DAY = ["--from", "10:00", "--to", "14:00", "--every", "1h"]


def open_result(folder, engine="h5netcdf"):
    with xr.open_dataset(folder / "study.nc", engine=engine) as result:
        return result.load()


@pytest.mark.parametrize("engine", ENGINES)
def test_spells_are_written_with_their_units(study, tmp_path, engine):
    said = study(*HALF_DAY, "--min-spell", "90min")
    assert said.status == 0
    assert not said.err
    result = open_result(tmp_path / "out", engine)
    kinds = {"first_sun": "M", "last_sun": "M", "sun_spells": "i", "longest_sun_hours": "f",
             "sun_hours_in_spells": "f", "shaded_share": "f"}  # fmt: skip
    for name, kind in kinds.items():
        assert result[name].dims == ("y", "x"), name
        assert result[name].dtype.kind == kind, name
        assert result[name].attrs["long_name"], name
    assert result.attrs["min_spell_minutes"] == 90
    under = result.sel(x=0.5, y=0.5, method="nearest")
    assert np.isnat(under.first_sun.values)
    assert int(under.sun_spells) == 0
    south = result.sel(x=0.5, y=-3.5, method="nearest")
    # 10:00 to 14:00 in summer time is 8:00 to 12:00 UTC.
    assert south.first_sun.values == np.datetime64("2026-09-18T08:00")
    assert south.last_sun.values == np.datetime64("2026-09-18T12:00")
    assert float(south.longest_sun_hours) == 4
    assert float(south.shaded_share) == 0


def test_dates_give_results_by_day(study, tmp_path):
    dates = ["--date", "2026-03-21,2026-06-21", "--date", "2026-12-21"]
    said = study(*HALF_DAY, *dates, "--masks", "--spells", day=None)
    assert said.status == 0, said
    result = open_result(tmp_path / "out")
    assert result.sizes["day"] == 3
    assert result.sizes["time"] == 12
    assert result.day.values[1] == np.datetime64("2026-06-21")
    np.testing.assert_allclose(result.shadow_hours_by_day.sum("day"), result.shadow_hours)
    np.testing.assert_allclose(result.in_shadow.sum("time"), result.shadow_hours)
    np.testing.assert_array_equal(result.up_hours_by_day, 4)
    assert result.first_sun_by_day.dims == ("day", "y", "x")
    assert result.shadow_hours_by_day.attrs == {
        "long_name": "hours in shadow, on the day", "units": "h",
    }  # fmt: skip
    said = study(*HALF_DAY, *dates, "--sum", day=None)
    assert "day" not in open_result(tmp_path / "out").dims


def test_quiet_says_nothing(study, tmp_path):
    said = study("--from", "22:00", "--to", "24:00", "--quiet")
    assert (said.status, said.out, said.err) == (0, "", "")
    assert (tmp_path / "out" / "study.nc").exists()
    assert study(*HALF_DAY, "--quiet", "--json").json()["hours"] == 4


def test_offsets_tell_a_repeated_time_apart(study, tmp_path):
    """The night when clocks go back: 02:30 CET is an hour after 02:30 CEST."""
    day = "2026-10-25"
    study("--from", "02:30+01:00", "--to", "09:00", "--at", "02:30+02:00 08:30", day=day)
    first = open_result(tmp_path / "out").time[0]
    assert str(first.values)[:19] == "2026-10-25T01:37:30"
    said = study("--from", "02:30+05:00", "--to", "09:00", day=day).refusal()
    assert "+02:00 or +01:00" in said
    assert "25:00" in study("--at", "25:00", "--from", "02:30+01:00", day=day).refusal()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--date", "2026-09-23..2026-03-21"], "ends before it begins"),
        (["--date", "2026-09-23", "--every-days", "0"], "--every-days"),
        (["--date", "2026-09-23", "--min-spell", "long"], "not a duration"),
        ([], "--date"),
    ],
)
def test_slips_are_told_before_anything_is_read(study, keep, options, says):
    assert says in study(*options, day=None).refusal()
    assert keep()


def test_who_casts_and_what_is_lost_are_written(study, tmp_path):
    houses = {
        "house": box((-2, -2, 0), (2, 2, 12)),
        "shed": moved(box((0, 0, 0), (3, 2, 3)), (-1, 4, 0)),
    }
    path = save_obj(tmp_path / "town.obj", houses)
    said = study(
        *HALF_DAY, "--by", "part", "--proposed", "house", "--under", "3h",
        "--receivers", "top", "--json", files=[path],
    )  # fmt: skip
    assert said.status == 0, said
    assert (tmp_path / "out" / "hours_lost.png").exists()
    table = said.json()["neighbours"]
    assert {row["name"] for row in table} == {"shed", "ground"}
    assert all(row["area"] >= row["area_touched"] >= row["area_newly_under"] for row in table)
    result = open_result(tmp_path / "out")
    assert list(result.caster.values) == ["house", "shed"]
    assert result.cast_hours.dims == ("caster", "y", "x")
    assert result.sole_hours.attrs["units"] == "h"
    assert result.attrs["under_hours"] == 3
    assert set(result.neighbour.values) == {"shed", "ground"}
    assert result.neighbour_area.attrs["units"] == "m2"
    assert np.isnan(result.hours_lost.sel(x=0.5, y=0.5, method="nearest"))
    lost = result.hours_lost.values
    assert float(result.neighbour_area_touched.sum()) == pytest.approx((lost > 1e-4).sum())
    for option in ("--who", "--proposed"):
        said = study(*HALF_DAY, option, "tower", files=[path]).refusal()
        assert f"{option} tower matches no part" in said
    assert "--under 0h is not longer" in study(*HALF_DAY, "--under", "0h", files=[path]).refusal()


def find_pictures(monkeypatch):
    """Note what each picture is asked to show."""
    seen = {}

    def note(self, path, plan, days, *args, **options):
        seen[path.name] = (days, args, options, plan)
        path.write_bytes(b"a picture")

    monkeypatch.setattr(painter.Painter, "draw_hours", note)
    return seen


@pytest.fixture
def street(tmp_path):
    houses = {
        "tower": box((-3, -8, 0), (3, -4, 13)), "house": box((-5, 4, 0), (5, 10, 4)),
    }  # fmt: skip
    return save_obj(tmp_path / "street.obj", houses)


ASKED = ["--proposed", "tower", "--under", "2h", "--receivers", "top"]


def test_pictures_name_their_ground_and_what_they_leave_out(study, street, monkeypatch):
    seen = find_pictures(monkeypatch)
    assert study(*HALF_DAY, "--ground", "-1.5", files=[street]).status == 0
    assert "ground at z = -1.5 m" in seen["hours.png"][3].note
    where = ["--receivers", "surfaces", "--on", "house", "--spacing", "2"]
    assert study(*HALF_DAY, *where, files=[street], cell=None).status == 0
    assert "hours of house alone" in seen["hours.png"][3].note


def test_pictures_of_several_dates_show_each_with_its_daylight(study, street, monkeypatch):
    seen = find_pictures(monkeypatch)
    dates = ["--date", "2026-03-21,2026-06-21,2026-12-21"]
    said = study(*dates, *ASKED, "--json", files=[street], day=None)
    assert said.status == 0, said
    result = said.json()
    for name, what in (("hours.png", "hours of sun on the date"),
                       ("hours_lost.png", "hours of sun lost to tower")):  # fmt: skip
        maps, _, options, plan = seen[name]
        assert [each.title for each in maps] == [
            "21 March 2026",
            "21 June 2026",
            "21 December 2026",
        ]
        assert maps[0].remark.startswith("sunrise 05:56, sunset 18:09")
        assert options["what"] == what
        assert plan.date == "09:00 to 17:00 (UTC+01:00/UTC+02:00)"
    # Each has the area that is newly under the limit on its date, as the table has it.
    for each, day in zip(seen["hours_lost.png"][0], dates[1].split(","), strict=True):
        rows = [row for row in result["neighbours"] if row["date"] == day]
        area = sum(row["area_newly_under"] for row in rows)
        assert each.hatched.sum() == area
        told = "nowhere" if area == 0 else f"{area:.0f} m²"
        assert each.remark.endswith(f"newly under 2 h: {told}")
    assert sum(each.hatched.sum() for each in seen["hours_lost.png"][0]) > 0
    # The colours of a date's own picture are those of its map among the others.
    assert seen["hours_2026-12-21.png"][1][0] == seen["hours.png"][1][0] == 8.0
    assert [day["date"] for day in result["dates"]] == ["2026-03-21", "2026-06-21", "2026-12-21"]
    assert result["dates"][2]["sunset"].startswith("2026-12-21T16:02:")
    assert result["dates"][2]["hours"] < result["dates"][0]["hours"] == 8
    assert result["days"] == 3


@pytest.mark.parametrize(
    ("options", "says", "most"),
    [
        (["--date", "2026-06-01..2026-06-30"], " a day, mean of 30 dates", 8.0),
        (["--date", "2026-06-01..2026-06-30", "--sum"], ", sum of 30 dates", 240.0),
        (["--date", "2026-06-01,2026-06-02", "--sum"], ", sum of 2 dates", 16.0),
    ],
)
def test_all_dates_together_are_a_mean_or_a_sum_and_say_so(
    study, street, monkeypatch, options, says, most
):
    seen = find_pictures(monkeypatch)
    assert study(*options, *ASKED, "--every", "1h", files=[street], day=None).status == 0
    (day,), (scale,), named, _ = seen["hours.png"]
    assert named["what"] == f"hours of sun{says}"  # several dates lead with the sun
    assert named["show"] == "sun"
    assert scale == most
    assert day.hours.max() <= most
    (lost,), _, named, _ = seen["hours_lost.png"]
    assert named["what"] == f"hours of sun lost to tower{says}"
    assert np.nanmax(lost.hours) <= most
    assert named["hatch"].startswith("newly under 2 h on at least one of")


def test_of_very_many_dates_by_day_every_nth_has_a_map(study, street, monkeypatch):
    seen = find_pictures(monkeypatch)
    options = ["--date", "2026-06-01..2026-06-30", "--by-day", "--every", "2h"]
    assert study(*options, files=[street], day=None).status == 0
    maps, _, _, plan = seen["hours.png"]
    assert [each.title.split()[0] for each in maps] == [f"{k}" for k in range(1, 31, 3)]
    assert plan.date.startswith("10 of 30 days from 1 June 2026 to 30 June 2026")


def test_points_and_sheets_are_drawn_of_each_date(study, street, tmp_path, monkeypatch):
    seen = {}

    def note(self, path, plan, places, days, most, *rest, what="", **options):
        seen[path.name] = (days, most, rest, what, plan)
        assert options == ({"ramp": "loss"} if path.name == "hours_lost.png" else {})
        path.write_bytes(b"a picture")

    monkeypatch.setattr(painter.Painter, "draw_points", note)
    (tmp_path / "points.csv").write_text("x,y,z\n0,2,0\n9,9,0\n")
    dates = ["--date", "2026-03-21,2026-12-21", "--every", "2h"]
    points = ["--receivers", "points", "--points", tmp_path / "points.csv"]
    said = study(*dates, *points, "--show", "sun", files=[street], day=None, cell=None)
    assert said.status == 0, said
    days, most, (_, show, what), *_ = seen["points.png"]
    assert (most, show, what) == (8.0, "sun", "hours of sun on the date")
    result = open_result(tmp_path / "out")
    for day, sun in zip(days, result.sun_hours_by_day.values, strict=True):
        np.testing.assert_allclose(most - day.hours, sun, atol=1e-5)
    lost = study(
        *dates, *points, "--proposed", "tower", "--json", files=[street], day=None, cell=None
    )
    assert "neighbours" not in lost.json()  # points have names of their own, and no area
    days, _, _, what, plan = seen["hours_lost.png"]
    assert what == "hours of sun lost to tower on the date"
    result = open_result(tmp_path / "out")
    np.testing.assert_array_equal([day.hours for day in days], result.hours_lost_by_day)
    assert plan.proposed.any()  # the tower is drawn, also where no point is near
    sheets = study(*dates, "--sheet", files=[street], day=None)
    assert sheets.status == 0, sheets
    for date in ("2026-03-21", "2026-12-21"):
        assert (tmp_path / "out" / f"sheet_{date}.png").exists()
