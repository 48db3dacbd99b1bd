"""Layers, columns and sites of files on the command line."""

import json

import pytest
import xarray as xr
from support.model_files import save_obj
from support.shapes import box

WHERE = ["--lat", "48.2", "--lon", "16.37", "--date", "2026-09-18", "--every", "2h"]
PLAN = ["--size", "40x40", "--extent", "-20,-20,20,20"]


@pytest.fixture
def towers(tmp_path):
    """A low and a high tower, each in a file of its own."""
    low = save_obj(tmp_path / "low.obj", {"tower": box((0, 0, 0), (4, 4, 3))})
    high = save_obj(tmp_path / "high.obj", {"tower": box((0, 0, 0), (4, 4, 12))})
    return low, high


def shadow(said, out):
    assert said.status == 0, said
    with xr.open_dataset(out / "study.nc") as result:
        return float(result.shadow_hours.sum())


def test_a_layer_is_chosen_to_cast(umbra_here, no_pictures, tmp_path, towers):
    files = [f"existing={towers[0]}", f"proposed={towers[1]}"]
    hours = []
    for number, choice in enumerate((["--cast", "existing"], ["--no-cast", "existing"], [])):
        out = tmp_path / str(number)
        hours.append(shadow(umbra_here("study", *files, *WHERE, *PLAN, *choice, "--out", out), out))
    alone = tmp_path / "alone"
    expected = shadow(umbra_here("study", towers[0], *WHERE, *PLAN, "--out", alone), alone)
    assert hours[0] == expected
    assert hours[0] < hours[1]
    assert hours[1] == hours[2]  # the low one stands in the high one


def test_the_light_through_trees_lies_between_none_and_all(
    umbra_here, no_pictures, tmp_path, towers
):
    wall = save_obj(tmp_path / "wall.obj", {"wall": box((-9, 1, 0), (9, 2, 2))})
    files = [f"trees={towers[1]}", f"house={wall}"]
    through, without = tmp_path / "through", tmp_path / "without"
    shadow(umbra_here("study", *files, *WHERE, *PLAN, "--who", "trees", "--out", through), through)
    shadow(
        umbra_here("study", *files, *WHERE, *PLAN, "--no-cast", "trees", "--out", without), without
    )
    with (
        xr.open_dataset(through / "study.nc") as some,
        xr.open_dataset(without / "study.nc") as none,
    ):
        sole = some.sole_hours.sel(caster="trees", drop=True)
        assert float(sole.max()) > 0
        # A transmissivity of 1 is no tree.
        xr.testing.assert_allclose(some.sun_hours + 1.0 * sole, none.sun_hours)


def test_inspect_shows_layers(umbra_here, towers):
    files = [f"existing={towers[0]}", towers[1]]
    result = umbra_here("inspect", *files, "--json").json()
    assert result["layers"] == ["existing", "high"]
    assert [part["layer"] for part in result["parts"]] == ["existing", "high"]
    assert "existing" in umbra_here("inspect", *files).out


def test_columns_are_options_of_every_command(umbra_here, no_pictures, tmp_path):
    ring = [[2500, 340500], [2510, 340500], [2510, 340510], [2500, 340510], [2500, 340500]]
    feature = {
        "type": "Feature",
        "properties": {"floors": 4, "sill": "2,5"},
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }
    path = tmp_path / "f.geojson"
    crs = {"type": "name", "properties": {"name": "EPSG:31256"}}
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": [feature]}))
    columns = ["--height-column", "floors", "--base-column", "sill"]
    result = umbra_here("inspect", path, *columns, "--json").json()
    assert [corner[2] for corner in result["bounds"]] == [2.5, 6.5]
    assert "--height-column" in umbra_here("inspect", path).refusal()
    said = umbra_here("inspect", path, "--height-column", "flors").refusal()
    assert "did you mean 'floors'?" in said
    # A study writes them beside its results, and takes them from there.
    first, again = tmp_path / "first", tmp_path / "again"
    options = [*columns, "--date", "2026-09-18", "--every", "2h", "--size", "20x20"]
    hours = shadow(umbra_here("study", path, *options, "--out", first), first)
    written = (first / "study.toml").read_text()
    assert 'height-column = "floors"' in written
    assert 'base-column = "sill"' in written
    said = umbra_here("study", "--options", first / "study.toml", "--out", again)
    assert shadow(said, again) == hours


def test_an_ifc_file_without_a_site_names_the_options(umbra_here, no_pictures, tmp_path):
    pytest.importorskip("ifcopenshell")
    from support.ifc_files import IfcFile  # noqa: PLC0415

    model = IfcFile()
    model.box("IfcWall", "wall", (1, 1, 3))
    path = model.write(tmp_path / "a.ifc")
    said = umbra_here("study", path, "--date", "2026-09-18", "--out", tmp_path / "out")
    assert "give --lat and --lon" in said.refusal()


def test_sites_that_disagree_can_be_decided(umbra_here, no_pictures, tmp_path):
    pytest.importorskip("ifcopenshell")
    from support.ifc_files import IfcFile  # noqa: PLC0415

    model = IfcFile()
    for latitude in (48, 52):
        model.site(f"site {latitude}", (latitude, 0, 0), (16, 0, 0))
    model.box("IfcWall", "wall", (1, 1, 3))
    path = model.write(tmp_path / "a.ifc")
    out = tmp_path / "out"
    said = umbra_here("study", path, "--date", "2026-09-18", "--out", out)
    assert said.status == 2
    note, refused = said.err.splitlines()
    assert "sites disagree" in note
    assert "give --lat and --lon" in refused
    assert "a.ifc: its 2 sites disagree ('site 48' at 48.0000°" in refused
    assert shadow(umbra_here("study", path, *WHERE, *PLAN, "--out", out), out) > 0
