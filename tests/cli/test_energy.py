"""Measures of the year in the shell: files, pictures, and what is told."""

import json
import tomllib

import numpy as np
import pytest
import xarray as xr
from support.weather_files import make_values, save_epw

from umbra.study import StudyOptions

NOTE = "note: "


@pytest.fixture
def epw(tmp_path):
    rise = np.maximum(np.sin((np.arange(8760) % 24 - 6) * np.pi / 12), 0)
    values = make_values(500 * rise, 300 * (rise > 0), 200 * rise)
    return save_epw(tmp_path / "made.epw", values)


def run(umbra_here, tower, out, *words):
    return umbra_here(
        "study", tower, "--receivers", "ground", "--cell", "4", "--out", out, "--json", *words
    )


def test_a_study_of_the_year_is_written_with_its_maps(umbra_here, tower, tmp_path, epw):
    out = tmp_path / "out"
    asked = ["--measure", "irradiation,winter_probable_sun_share", "--weather", epw,
             "--sky-directions", "tregenza", "--albedo", "0.3"]  # fmt: skip
    said = run(umbra_here, tower, out, *asked)
    assert said.status == 0, said
    notes = [line for line in said.err.splitlines() if line.startswith(NOTE)]
    # The model says no place: the weather file does. The table of sunshine is not given.
    assert [line for line in notes if "made.epw" in line and "48.200" in line]
    assert [line for line in notes if "--sunshine" in line]
    told = json.loads(said.out)["measures"]
    assert set(told) >= {"irradiation", "irradiation_sky", "winter_probable_sun_share"}
    with xr.open_dataset(out / "study.nc") as data:
        assert data.attrs["latitude"] == 48.2
        assert data.attrs["albedo"] == 0.3
        assert data.irradiation.attrs["units"] == "kWh/m2"
        assert 0 <= float(data.irradiation.min()) < float(data.irradiation.max())
    for name in ("irradiation", "irradiation_beam", "winter_probable_sun_share"):
        assert (out / f"{name}.png").stat().st_size > 5000
    kept = tomllib.loads((out / "study.toml").read_text("utf-8"))
    assert kept["weather"] == str(epw)
    again = umbra_here("study", "--options", out / "study.toml", "--out", tmp_path / "again")
    assert again.status == 0, again


def test_the_site_given_counts_before_the_weathers(umbra_here, tower, tmp_path, epw):
    asked = ["--measure", "sunshine_hours", "--weather", epw, "--no-pictures"]
    said = run(umbra_here, tower, tmp_path / "out", *asked, "--lat", "50", "--lon", "16.37")
    assert said.status == 0, said
    assert [line for line in said.err.splitlines() if "200 km" in line]
    with xr.open_dataset(tmp_path / "out" / "study.nc") as data:
        assert data.attrs["latitude"] == 50


def test_surfaces_and_their_picture_take_the_weather_too(umbra_here, tower, tmp_path, epw):
    out = tmp_path / "out"
    said = umbra_here(
        "study", tower, "--receivers", "surfaces", "--spacing", "2", "--out", out, "--measure",
        "irradiation", "--weather", epw, "--sky-directions", "145", "--write", "csv",
    )  # fmt: skip
    assert said.status == 0, said
    assert (out / "irradiation.png").exists()
    assert "irradiation_ground" in (out / "samples.csv").read_text().splitlines()[0]


def test_a_command_without_a_place_is_refused_in_a_line(umbra_here, tower, tmp_path, epw):
    told = run(umbra_here, tower, tmp_path / "out", "--measure", "probable_sun_hours").refusal()
    assert "--lat" in told
    told = run(umbra_here, tower, tmp_path / "out", "--measure", "irradiation").refusal()
    assert "--weather" in told
    assert not (tmp_path / "out").exists()


def test_maps_say_which_hours_of_the_weather_are_added_up(epw):
    given = {"weather": epw, "measure": ["irradiation"]}
    [measure] = StudyOptions(**given).measures
    assert "09:00" not in measure.tell(StudyOptions(**given))
    told = measure.tell(StudyOptions(**given, date="2026-03-21", end="12:00"))
    assert all(word in told for word in ("2026-03-21", "09:00", "12:00"))
