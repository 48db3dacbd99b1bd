"""``umbra study`` along the time axis: spells and several days in study.nc."""

from importlib.util import find_spec

import numpy as np
import pytest
import xarray as xr
from support.model_files import save_obj
from support.shapes import box, moved

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
    assert "matches no part" in study(*HALF_DAY, "--who", "tower", files=[path]).refusal()
    assert "least sun" in study(*HALF_DAY, "--under", "0h", files=[path]).refusal()
