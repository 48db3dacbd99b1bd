"""``umbra study``: what it writes and says."""

import hashlib
import json
from importlib.util import find_spec

import h5py
import numpy as np
import pytest
import xarray as xr
from support.model_files import save_city, save_city_sequence, save_glb, save_obj
from support.shapes import box, moved

import umbra

VARIABLES = {
    "shadow_hours": (("y", "x"), np.float32),
    "sun_hours": (("y", "x"), np.float32),
    "receiver_z": (("y", "x"), np.float64),
    "sun_altitude": (("time",), np.float64),
    "sun_azimuth": (("time",), np.float64),
    "sun_direction": (("time", "xyz"), np.float64),
}
ATTRIBUTES = {
    "umbra_version": str,
    "command": str,
    "source": str,
    "device": str,
    "threads": (int, np.integer),
    "prepare_seconds": (float, np.floating),
    "count_seconds": (float, np.floating),
}
ENGINES = ["h5netcdf"] + (["netcdf4"] if find_spec("netCDF4") else [])
HOUSES = {
    "house": box((-2, -2, 0), (2, 2, 12)),
    "shed": moved(box((0, 0, 0), (3, 2, 3)), (6, -1, 0)),
}
HALF_DAY = ["--from", "10:00", "--to", "14:00", "--every", "1h"]


def open_result(folder, engine="h5netcdf"):
    with xr.open_dataset(folder / "study.nc", engine=engine) as result:
        return result.load()


def check_contract(result, masks=False):
    """Check every name, dimension, type and attribute that users rely on."""
    variables = dict(VARIABLES)
    if masks:
        variables["in_shadow"] = (("time", "y", "x"), np.uint8)
    assert set(result.data_vars) == set(variables)
    for name, (dims, dtype) in variables.items():
        assert result[name].dims == dims, name
        assert result[name].dtype == dtype, name
    for axis in "xy":
        assert result[axis].dims == (axis,)
        assert result[axis].dtype == np.float64
        assert result[axis].attrs["units"] == "m"
        assert (np.diff(result[axis]) > 0).all()
    assert result.time.dims == ("time",)
    assert np.issubdtype(result.time.dtype, np.datetime64)
    assert result.sizes["xyz"] == 3
    np.testing.assert_allclose(np.linalg.norm(result.sun_direction, axis=1), 1, rtol=1e-12)
    for name, kind in ATTRIBUTES.items():
        assert isinstance(result.attrs[name], kind), name
    assert result.attrs["umbra_version"] == umbra.__version__
    assert result.attrs["device"] == "cpu"
    assert result.attrs["prepare_seconds"] > 0
    assert result.attrs["count_seconds"] > 0
    assert result.attrs["Conventions"].startswith("CF-1")
    if masks:
        assert set(np.unique(result.in_shadow)) == {0, 1}


@pytest.mark.parametrize("masks", [False, True])
@pytest.mark.parametrize("engine", ENGINES)
def test_netcdf_is_as_promised(study, tower, tmp_path, engine, masks):
    said = study(*HALF_DAY, *(["--masks"] if masks else []), "--threads", "2")
    assert said.status == 0
    assert not said.err
    assert len(said.answers) == 1
    folder = tmp_path / "out"
    assert said.out.splitlines() == [
        str(folder / name) for name in ("study.nc", "hours.png", "profile.png", "study.toml")
    ]
    assert sorted(path.name for path in folder.iterdir()) == [
        "hours.png", "profile.png", "study.nc", "study.toml",
    ]  # fmt: skip
    result = open_result(folder, engine)
    check_contract(result, masks)
    assert result.attrs["threads"] == 2
    assert result.attrs["command"].startswith(f"umbra study {tower} --lat 48.2")
    digest = hashlib.sha256(tower.read_bytes()).hexdigest()
    assert "tower.obj" in result.attrs["source"]
    assert digest in result.attrs["source"]
    assert "crs" not in result.attrs
    # 10:30 in summer time is 8:30 UTC.
    assert result.time.values[0] == np.datetime64("2026-09-18T08:30")
    assert result.sizes["time"] == 4
    np.testing.assert_allclose(result.shadow_hours + result.sun_hours, 4)
    assert (result.receiver_z == 0).all()
    # The tower's own ground is in shadow all the time; its shadow lies north.
    assert float(result.shadow_hours.sel(x=0.5, y=0.5, method="nearest")) == 4
    assert float(result.shadow_hours.sel(x=0.5, y=5.5, method="nearest")) > 0
    assert float(result.shadow_hours.sel(x=0.5, y=-3.5, method="nearest")) == 0


def test_time_says_that_it_is_utc_to_any_reader(study, tmp_path):
    study(*HALF_DAY)
    with h5py.File(tmp_path / "out" / "study.nc") as file:
        units = file["time"].attrs["units"]
        units = units.decode() if isinstance(units, bytes) else units
        assert units.partition(" since ")[2][:10].count("-") == 2
        assert file["shadow_hours"].dtype == np.float32
        assert file["sun_direction"].shape == (4, 3)


def test_json_is_one_object_on_stdout(study, tmp_path):
    said = study(*HALF_DAY, "--json")
    assert said.status == 0
    found = said.json()
    result = open_result(tmp_path / "out")
    assert found["files"] == [
        str(tmp_path / "out" / name)
        for name in ("study.nc", "hours.png", "profile.png", "study.toml")
    ]
    assert (found["cols"], found["rows"]) == (result.sizes["x"], result.sizes["y"])
    assert found["cell"] == [1.0, 1.0]
    assert found["hours"] == 4.0
    assert found["most_shadow_hours"] == 4.0
    assert found["mean_shadow_hours"] == pytest.approx(float(result.shadow_hours.mean()))


def test_without_pictures_the_result_and_its_options_are_written(study, tmp_path):
    written = [tmp_path / "out" / name for name in ("study.nc", "study.toml")]
    assert study(*HALF_DAY, "--no-pictures", "--json").json()["files"] == list(map(str, written))
    assert "pictures = false" in written[1].read_text().splitlines()
    refused = study(*HALF_DAY, "--no-pictures", "--write", "svg").refusal()
    assert "--write svg asks for pictures, which are left out" in refused


@pytest.mark.parametrize(
    ("save", "name"),
    [
        (save_obj, "town.obj"),
        (save_glb, "town.glb"),
        (save_city, "town.city.json"),
        (save_city_sequence, "town.city.jsonl"),
    ],
)
def test_every_format_gives_the_same_hours(study, tmp_path, save, name):
    extent = ["--extent", "-10,-10,20,20"]
    reference = save_obj(tmp_path / "reference.obj", HOUSES)
    assert study(*HALF_DAY, *extent, files=[reference], out=tmp_path / "a").status == 0
    said = study(*HALF_DAY, *extent, files=[save(tmp_path / name, HOUSES)], out=tmp_path / "b")
    assert said.status == 0, said
    expected, found = open_result(tmp_path / "a"), open_result(tmp_path / "b")
    np.testing.assert_array_equal(found.shadow_hours, expected.shadow_hours)
    assert name in found.attrs["source"]


def test_two_files_make_one_scene(study, tmp_path):
    extent = ["--extent", "-10,-10,20,20"]
    both = save_obj(tmp_path / "both.obj", HOUSES)
    apart = [save_obj(tmp_path / f"{name}.obj", {name: HOUSES[name]}) for name in HOUSES]
    study(*HALF_DAY, *extent, files=[both], out=tmp_path / "a")
    assert study(*HALF_DAY, *extent, files=apart, out=tmp_path / "b").status == 0
    a, b = open_result(tmp_path / "a"), open_result(tmp_path / "b")
    np.testing.assert_array_equal(a.shadow_hours, b.shadow_hours)
    assert "house.obj" in b.attrs["source"]
    assert "shed.obj" in b.attrs["source"]


def test_files_with_a_crs_need_no_site(study, tmp_path):
    # EPSG:31256 lies about Vienna: the place and the zone come from the coordinates.
    meshes = {name: moved(mesh, (2500, 340000, 180)) for name, mesh in HOUSES.items()}
    path = save_city(tmp_path / "vienna.city.json", meshes, crs=31256)
    assert study(*HALF_DAY, files=[path], site=[]).status == 0
    result = open_result(tmp_path / "out")
    check_contract(result)
    assert result.attrs["crs"] == "EPSG:31256"
    assert result.attrs["time_zone"] == "Europe/Vienna"
    assert result.attrs["latitude"] == pytest.approx(48.2, abs=0.05)
    assert result.attrs["longitude"] == pytest.approx(16.37, abs=0.05)
    assert result.shadow_hours.attrs["grid_mapping"] == "spatial_ref"
    # Given values win.
    assert study(*HALF_DAY, "--tz", "UTC", files=[path], site=["--lat", "10"]).status == 0
    result = open_result(tmp_path / "out")
    assert (result.attrs["latitude"], result.attrs["time_zone"]) == (10.0, "UTC")


def test_a_crs_in_degrees_is_converted_and_said(study, tmp_path):
    degrees = {"house": moved(box((0, 0, 0), (1e-4, 1e-4, 12)), (16.37, 48.2, 180))}
    path = save_city(tmp_path / "degrees.city.json", degrees, crs=4979, scale=1e-7)
    said = study(*HALF_DAY, files=[path], site=[])
    assert said.status == 0
    assert "converted from EPSG:4979 to EPSG:32633" in said.err
    result = open_result(tmp_path / "out")
    assert result.attrs["crs"].startswith("EPSG:32633")
    assert 590_000 < float(result.x[0]) < 610_000


def test_a_crs_in_feet_is_converted(study, tmp_path):
    # EPSG:2263 is New York in feet and says nothing of heights, which is told; 6360 does.
    feet = {"house": moved(box((0, 0, 0), (40, 40, 40)), (980_000, 200_000, 10))}
    path = save_city(tmp_path / "feet.city.json", feet, crs=2263)
    assert "does not say the unit of heights" in study(*HALF_DAY, files=[path], site=[]).err
    path = save_city(tmp_path / "feet.city.json", feet, crs="EPSG:2263+6360")
    said = study(*HALF_DAY, files=[path], site=[], out=tmp_path / "feet")
    assert said.status == 0
    result = open_result(tmp_path / "feet")
    assert result.attrs["time_zone"] == "America/New_York"
    under = (result.shadow_hours == 4).values
    assert 10 * 10 < under.sum() < 18 * 18  # 40 feet are 12.2 m


def test_options_that_begin_with_a_minus_sign(study, tmp_path):
    said = study(
        *HALF_DAY, "--extent", "-10,-10,10,10", "--ground", "-1", "--north", "-90",
        site=["--lat", "-33.4", "--lon", "-70.6"],
    )  # fmt: skip
    assert said.status == 0
    result = open_result(tmp_path / "out")
    assert float(result.x[0]) == -9.5
    assert result.attrs["time_zone"] == "America/Santiago"
    assert result.attrs["true_north_deg"] == -90
    assert (result.receiver_z == -1).all()
    # The southern sun stands in the north, here at -x: shadows fall toward +x.
    shaded = result.shadow_hours.sel(y=0.5, method="nearest")
    assert float(shaded.sel(x=4.5)) > 0
    assert float(shaded.sel(x=-4.5)) == 0


def test_size_and_top_and_refraction(study, tmp_path):
    said = study(
        *HALF_DAY, "--size", "40x30", "--extent", "-10,-10,10,10", "--receivers", "top",
        "--refraction", "none", cell=None,
    )  # fmt: skip
    assert said.status == 0
    result = open_result(tmp_path / "out")
    assert result.shadow_hours.shape == (30, 40)
    assert float(result.receiver_z.max()) == 12
    assert result.attrs["receivers"] == "top"
    assert result.attrs["refraction"] == "none"


def test_cast_and_no_cast_choose_parts_by_name_or_kind(study, tmp_path):
    path = save_city(tmp_path / "town.city.json", HOUSES)
    extent = ["--extent", "-10,-10,20,20"]

    def hours(*options):
        assert study(*HALF_DAY, *extent, *options, files=[path]).status == 0
        return open_result(tmp_path / "out").shadow_hours

    everything, house, shed = hours(), hours("--cast", "house"), hours("--no-cast", "house")
    assert float(house.sel(x=0.5, y=0.5)) == 4
    assert float(house.sel(x=7.5, y=0.5)) == 0
    assert float(shed.sel(x=0.5, y=0.5)) == 0
    assert float(shed.sel(x=7.5, y=0.5)) == 4
    np.testing.assert_array_equal(everything, np.maximum(house, shed))
    roofs = hours("--cast", "Roof*")
    walls = hours("--no-cast", "RoofSurface")
    assert 0 < float(roofs.sum()) < float(everything.sum())
    assert 0 < float(walls.sum()) <= float(everything.sum())
    np.testing.assert_array_equal(hours("--cast", "house", "--cast", "shed"), everything)


def test_night_is_a_warning_and_a_true_result(study, tmp_path):
    said = study("--from", "22:00", "--to", "24:00", "--masks")
    assert said.status == 0
    assert said.err.count("\n") == 1
    assert "warning" in said.err
    assert "below the horizon" in said.err
    result = open_result(tmp_path / "out")
    for name in ("shadow_hours", "sun_hours", "in_shadow"):
        assert not result[name].any()
    assert (result.sun_altitude < 0).all()


def test_a_period_into_the_night_warns_of_nothing(study, tmp_path):
    assert "warning" not in study("--from", "18:00", "--to", "21:00").err
    result = open_result(tmp_path / "out")
    assert 0.75 <= float((result.shadow_hours + result.sun_hours)[0, 0]) <= 1.25


def test_a_new_result_replaces_the_old_one_and_leaves_other_files(study, keep, tmp_path):
    before = (tmp_path / "out" / "study.nc").read_bytes()
    assert study("--cell", "0.5").status == 0
    assert (tmp_path / "out" / "study.nc").read_bytes() != before
    assert (tmp_path / "out" / "notes.txt").read_text() == "mine"
    assert not list((tmp_path / "out").glob(".umbra*"))


def test_terrain_that_a_file_names_is_told_of_the_ground(umbra_here, tmp_path):
    # It covers half of its plan only: a corner is missing.
    corners = [[0, 0, 0], [90, 0, 2], [0, 90, 4]]
    land = {"type": "CompositeSurface", "lod": "1", "boundaries": [[[0, 1, 2]]]}
    city = {
        "type": "CityJSON", "version": "2.0", "vertices": corners,
        "transform": {"scale": [1, 1, 1], "translate": [0, 0, 0]},
        "CityObjects": {"land": {"type": "TINRelief", "geometry": [land]}},
    }  # fmt: skip
    file = tmp_path / "land.city.json"
    file.write_text(json.dumps(city))
    asked = ["study", file, "--lat", "51.5", "--lon", "0", "--date", "2026-03-21"]
    asked += ["--every", "4h", "--size", "9x9", "--out", tmp_path / "out"]
    note = "note: the model brings ground of its own, of which a plane at z = 0 m shows nothing"
    assert note in umbra_here(*asked, "--receivers", "ground").err
    assert "note: " not in umbra_here(*asked).err


def test_a_terrain_is_told_of_the_ground_and_a_house_is_not(study, tmp_path):
    plate = box((-20, -20, -0.5), (20, 20, 0))
    path = save_obj(tmp_path / "plate.obj", {"plate": plate, **HOUSES})
    note = "--receivers top"
    assert note in study(*HALF_DAY, files=[path]).err
    assert note not in study(*HALF_DAY, "--receivers", "top", files=[path]).err
    assert "note: " not in study(*HALF_DAY).err


def test_a_study_from_the_cache_is_the_same_to_the_bit(study, tmp_path, monkeypatch):
    monkeypatch.setenv("UMBRA_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("umbra.readers.kept.LEAST", 1)
    town = save_city(tmp_path / "town.city.json", {"a": box((0, 0, 0), (4, 4, 9))})
    options = ["--receivers", "top", "--spells", "--who", "RoofSurface", *HALF_DAY]
    runs = {"cold": [], "warm": [], "none": ["--no-cache"]}
    for name, more in runs.items():
        with monkeypatch.context() as patch:
            if name == "warm":
                patch.setattr("umbra.readers._read_one", lambda *_: pytest.fail("was read"))
            assert study(*options, *more, files=[town], out=tmp_path / name).status == 0
    cold, warm, none = (open_result(tmp_path / name) for name in runs)
    for other in (warm, none):
        assert set(other.variables) == set(cold.variables)
        for name in cold.variables:
            np.testing.assert_array_equal(cold[name], other[name], strict=True)
        assert other.attrs["source"] == cold.attrs["source"]


def test_a_dataset_in_python_knows_its_units_as_the_file_does(study, tower, tmp_path):
    more = ["--masks", "--spells", "--date", "2026-09-19"]
    assert study(*HALF_DAY, *more).status == 0
    written = open_result(tmp_path / "out")
    scene, site = umbra.read(tower), umbra.Site(48.2, 16.37, "Europe/Vienna")
    made = umbra.shadow_study(
        scene, site, date=["2026-09-18", "2026-09-19"], start="10:30", end="14:30", every="1h",
        cell=1, masks=True, spells=True,
    )  # fmt: skip
    assert set(made.variables) == set(written.variables)
    for name in written.variables:
        assert written[name].attrs.items() >= made[name].attrs.items(), name
    summed = {"long_name": "hours in shadow, sum of 2 dates", "units": "h"}
    assert made.shadow_hours.attrs == summed
    assert made.sun_spells_by_day.attrs["long_name"].endswith(", on the day")
    label = made.shadow_hours.plot().colorbar.ax.get_ylabel()
    assert label.replace("\n", " ") == "hours in shadow, sum of 2 dates [h]"
