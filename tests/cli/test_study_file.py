"""Studies repeated from their options, and what receives beside plans."""

import os
import socket
import subprocess
import tomllib

import numpy as np
import pytest
import xarray as xr
from support.model_files import save_city, save_obj
from support.shapes import box, moved

from umbra.cli.study import command

HALF_DAY = ["--from", "10:00", "--to", "14:00", "--every", "1h"]
HOUSES = {
    "house": box((-2, -2, 0), (2, 2, 12)),
    "shed": moved(box((0, 0, 0), (3, 2, 3)), (6, -1, 0)),
}


def open_result(folder):
    with xr.open_dataset(folder / "study.nc") as result:
        return result.load()


def test_a_study_repeats_itself_from_what_it_wrote(study, umbra_here, tmp_path):
    path = save_obj(tmp_path / 'to"wn.obj', HOUSES)
    options = [
        *HALF_DAY, "--no-cast", "shed", "--extent", "-5,-5,5,9", "--receivers", "top", "--spells",
        "--date", "2026-06-21", "--sum", "--north", "-3.5", "--min-spell", "90min",
    ]  # fmt: skip
    assert study(*options, files=[path]).status == 0
    written = tmp_path / "out" / "study.toml"
    kept = tomllib.loads(written.read_text(encoding="utf-8"))
    assert kept["date"] == ["2026-09-18", "2026-06-21"]
    assert kept["from"] == "10:00"
    assert kept["extent"] == [-5, -5, 5, 9]
    assert kept["files"] == [str(path)]
    assert kept["spells"] is True
    assert kept["by-day"] is False
    assert "out" not in kept
    said = umbra_here("study", "--options", written, "--out", tmp_path / "again")
    assert said.status == 0, said
    one, two = open_result(tmp_path / "out"), open_result(tmp_path / "again")
    for name in one.data_vars:
        np.testing.assert_array_equal(one[name], two[name], err_msg=name)
    again = tmp_path / "again" / "study.toml"
    assert again.read_text(encoding="utf-8") == written.read_text(encoding="utf-8")


def test_what_is_typed_comes_before_the_file(umbra_here, no_pictures, tmp_path):
    save_obj(tmp_path / "town.obj", HOUSES)
    given = tmp_path / "mine.toml"
    given.write_text(
        'files = "town.obj"\ndate = 2026-09-18\nlat = 48.2\nlon = 16.37\ncell = 2\n'
        'every = "1h"\nno_cast = "shed"\nextent = [-10, -10, 10, 10]\n'
    )
    out = tmp_path / "out"
    said = umbra_here("study", "--options", given, "--cell", "1", "--lat", "-33", "--out", out)
    assert said.status == 0, said
    result = open_result(out)
    assert result.sizes["x"] == 20
    assert result.attrs["latitude"] == -33
    assert result.sizes["time"] == 8
    shed = result.shadow_hours.sel(x=7.5, y=0.5)
    assert float(shed) < 8


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('dates = "2026-03-21"', "did you mean 'date'"),
        ("date = ", "is not TOML"),
        ('[study]\ndate = "2026-03-21"', "without headings"),
        ('date = "2026-03-21"\ncell = "wide"', "is not a length"),
        ('date = "2026-03-21"\nextent = [1, 2]', "--extent"),
        ('date = "yesterday"', "is not a date"),
    ],
)
def test_slips_in_the_file_are_told(study, keep, tmp_path, text, says):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    said = study("--options", path, day=None, cell=None).refusal()
    assert says in said
    assert keep()
    assert "no such file" in study("--options", tmp_path / "none.toml").refusal()


def test_elevations_have_their_own_axes(study, tmp_path):
    said = study(*HALF_DAY, "--receivers", "south", "--json", cell="0.5")
    assert said.status == 0, said
    result = open_result(tmp_path / "out")
    assert result.shadow_hours.dims == ("z", "along")
    assert result.along.attrs["units"] == "m"
    assert result.position.dims == ("z", "along", "xyz")
    assert result.attrs["view_azimuth_deg"] == 180
    assert float(result.shadow_hours.max()) == 0
    assert np.isnan(result.shadow_hours).any()
    found = said.json()
    assert (found["cols"], found["rows"]) == (result.sizes["along"], result.sizes["z"])
    assert found["most_shadow_hours"] == 0
    assert "choose ground, top" in study("--receivers", "roof").refusal()


def test_surfaces_are_sampled_and_drawn(study, tmp_path):
    on_hill = {name: moved(mesh, (0, 0, 5)) for name, mesh in HOUSES.items()}
    path = save_city(tmp_path / "town.city.json", on_hill)
    said = study(
        *HALF_DAY, "--receivers", "surfaces", "--spacing", "1", "--on", "WallSurface", "--masks",
        files=[path], cell=None,
    )  # fmt: skip
    assert said.status == 0, said
    assert [line.rsplit("/", 1)[1] for line in said.out.splitlines()] == [
        "study.nc", "hours.png", "profile.png", "study.toml",
    ]  # fmt: skip
    # Of the ground that the picture alone shows.
    assert "the ground is assumed level at z = 5 m" in said.err
    result = open_result(tmp_path / "out")
    assert result.sizes["sample"] == 16 * 12 + 10 * 3
    assert result.in_shadow.dims == ("time", "sample")
    assert result.in_shadow.dtype == np.uint8
    assert set(result.part.values) == {"house", "shed"}
    assert result.attrs["spacing_m"] == 1
    assert "--spacing" in study("--receivers", "surfaces").refusal()


def test_points_come_from_a_table(study, tmp_path):
    table = tmp_path / "windows.csv"
    table.write_text("name,x,y,z,nx,ny,nz\nsouth,0,-2,5,0,-1,0\nnorth,0,2,5,0,1,0\n")
    said = study(
        *HALF_DAY, "--receivers", "points", "--points", table, "--spells", "--json", cell=None
    )
    assert said.status == 0, said
    result = open_result(tmp_path / "out")
    assert list(result.name.values) == ["south", "north"]
    np.testing.assert_array_equal(result.sun_hours, [4, 0])
    np.testing.assert_array_equal(result.sun_spells, [1, 0])
    assert said.json()["samples"] == 2
    assert "inside bodies" not in said.err
    # Within the wall no sun comes, and the table alone would not say why.
    table.write_text("name,x,y,z,nx,ny,nz\nsouth,0,-2,5,0,-1,0\ndeep,0,-1.9,5,0,-1,0\n")
    said = study(*HALF_DAY, "--receivers", "points", "--points", table, cell=None)
    assert "points inside bodies, where no sun comes: 1 ('deep' in 'tower')" in said.err
    assert "needs --points" in study("--receivers", "points", cell=None).refusal()
    table.write_text("x,y\n1,2\n")
    refused = study("--receivers", "points", "--points", table, cell=None).refusal()
    assert "line 1" in refused


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("date = " + "[" * 50_000, "nested too deep"),
        ('date = "2026-03-21"\n' + "#" * 1_000_000, "is larger than 1 MB"),
    ],
)
def test_an_options_file_is_short_and_flat(umbra_here, tmp_path, text, match):
    path = tmp_path / "study.toml"
    path.write_text(text)
    said = umbra_here("study", "a.obj", "--options", path, "--out", tmp_path / "out").refusal()
    assert match in said


def test_rules_are_found_beside_the_file_of_options(umbra_here, no_pictures, tmp_path, monkeypatch):
    save_obj(tmp_path / "town.obj", HOUSES)
    (tmp_path / "rules.yaml").write_text(
        'format: 1\nname: An example\nversion: "0"\nsource: Invented\nchecks:\n'
        "  - {name: ground, dates: 09-18, at_least: 2h, share: 30}\n"
    )
    given = tmp_path / "mine.toml"
    given.write_text(
        'files = "town.obj"\ndate = 2026-09-18\nlat = 48.2\nlon = 16.37\ncell = 1\n'
        'every = "1h"\nrules = "rules.yaml"\n'
    )
    monkeypatch.chdir(tmp_path.parent)
    said = umbra_here("study", "--options", given, "--out", tmp_path / "out")
    assert said.status == 0, said
    kept = tomllib.loads((tmp_path / "out" / "study.toml").read_text(encoding="utf-8"))
    assert kept["rules"] == str(tmp_path / "rules.yaml")


NAMES = """
files lat lon tz north
date from to clock every every-days by-day refraction
measure sky-directions weather albedo sunshine horizon horizon-from
receivers spacing on points eye target fov ground extent cell size crs
windows judge reveal areas areas-on band roads context least
cast no-cast canopy transmissivity leaf-on trunk canopy-heights
by who proposed replace replace-in under spells exact disc min-spell masks
title subtitle show at pictures report sheet paper logo write rules
tiles min-altitude
up height-column base-column name-column time animation bbox area geometric-error
place lift move
device
"""
FROM_A_FILE = NAMES.split()
"""What a file from anybody may set: each was decided. None writes elsewhere than typed, connects to
a machine, starts processes, or lets models name files outside their folder."""
TYPED = {
    "out": "elsewhere", "scheduler": "tcp://127.0.0.1:8786", "workers": 2, "memory": "4GB",
    "threads": 1, "allow-outside": True, "no-cache": True, "quiet": True, "json": True,
    "max-memory": 4,
}  # fmt: skip


def test_what_a_file_may_set_was_decided_for_each_option():
    long = {name for one in command.params for name in one.opts if name.startswith("--")}
    names = {"files", *(name.removeprefix("--") for name in long)} - {"options"}
    assert names == {*FROM_A_FILE, *TYPED}


@pytest.mark.parametrize("name", TYPED)
def test_a_file_does_not_write_connect_or_start_processes(study, tmp_path, monkeypatch, name):
    value = TYPED[name]
    text = f'"{value}"' if isinstance(value, str) else str(value).lower()
    monkeypatch.setattr(socket.socket, "connect", None)
    monkeypatch.setattr(subprocess, "Popen", None)
    for spelled in {name, name.replace("-", "_")}:
        path = tmp_path / "mine.toml"
        path.write_text(f'tiles = "1km"\n{spelled} = {text}\n')
        assert f" {name} is typed (--{name})" in study("--options", path).refusal()
    assert {one.name for one in tmp_path.iterdir()} == {"mine.toml", "tower.obj"}


@pytest.mark.skipif(os.name == "nt", reason="Windows has no endless devices")
@pytest.mark.parametrize(
    "option", ["points", "rules", "area", "files", "weather", "horizon", "sunshine", "logo"]
)
def test_a_file_that_names_an_endless_one_is_refused(
    umbra_here, tmp_path, tower, option, monkeypatch
):
    monkeypatch.setattr("umbra.readers.checks.find_memory", lambda: 4e8)
    path = tmp_path / "mine.toml"
    files = "" if option == "files" else f'files = "{tower}"\n'
    path.write_text(
        f'{files}date = "2026-09-18"\nlat = 48.2\nlon = 16.37\n{option} = "/dev/zero"\n'
        + 'receivers = "points"\n' * (option == "points")
        + 'measure = "irradiation"\n' * (option == "weather")
        + 'measure = "probable_sun_hours"\n' * (option == "sunshine")
    )
    said = umbra_here("study", "--options", path, "--out", tmp_path / "out").refusal()
    assert "/dev/zero" in said
    assert not (tmp_path / "out").exists()
