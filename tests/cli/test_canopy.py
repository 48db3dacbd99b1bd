"""Canopies on the command line."""

import csv

import numpy as np
import pytest
import xarray as xr
from support.model_files import RULES, save_obj
from support.shapes import box


@pytest.fixture
def garden(tmp_path):
    """A house, and a crown of 8 x 8 m that hangs 4 m over the ground beside it."""
    return save_obj(
        tmp_path / "garden.obj",
        {"house": box((-20, -2, 0), (-10, 2, 8)), "crown": box((-6, -4, 4), (6, 4, 9))},
    )


def read(path):
    with xr.open_dataset(path / "study.nc") as found:
        return found.load()


def test_a_study_with_leaves_and_without(study, garden, tmp_path):
    summer, winter = tmp_path / "summer", tmp_path / "winter"
    leaves = ["--canopy", "crown", "--transmissivity", "0.03:50%", "--leaf-on", "04-15..10-31"]
    assert study(*leaves, "--masks", files=[garden], out=summer).status == 0
    assert study(*leaves, files=[garden], out=winter, day="2026-12-18").status == 0
    found = read(summer)
    # A crown hangs: its underside tells nothing of the ground, which is that of the house.
    assert found.attrs["ground_z"] == 0
    assert not found.receiver_z.values.any()
    light = (1 - found.in_shadow) * (1 - (1 - found.canopy_transmissivity) * found.under_canopy)
    np.testing.assert_allclose(found.sun_hours, light.sum("time") * 0.25, atol=1e-4)
    assert float(found.canopy_hours.max()) > 3
    assert found.attrs["leaf_on"] == "04-15..10-31"
    assert "units" in found.canopy_hours.attrs
    assert set(np.unique(read(winter).canopy_transmissivity)) == {0.5}
    # What was typed comes back from study.toml.
    again = tmp_path / "again"
    options = ["--options", summer / "study.toml"]
    assert study(*options, files=[garden], out=again).status == 0
    np.testing.assert_array_equal(read(again).sun_hours, found.sun_hours)


def test_rasters_of_tree_tops(umbra_here, no_pictures, tmp_path):
    rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed")
    ground, tops, zone = np.full((3, 20, 30), [[[200.0]], [[0.0]], [[0.0]]])
    tops[8:12, 10:20], zone[8:12, 10:20] = 12.0, 5.0
    for name, heights in (("dsm", ground), ("cdsm", tops), ("tdsm", zone)):
        with rasterio.open(
            tmp_path / f"{name}.tif", "w", driver="GTiff", height=20, width=30, count=1,
            dtype="float64", crs="EPSG:32633",
            transform=rasterio.transform.from_origin(600000, 5340000, 1, 1),
        ) as file:  # fmt: skip
            file.write(heights, 1)
    files = [f"dsm={tmp_path / 'dsm.tif'}", f"canopy={tmp_path / 'cdsm.tif'}"]
    first, again = tmp_path / "first", tmp_path / "again"
    said = umbra_here(
        "study", *files, "--canopy", "canopy", "--trunk", tmp_path / "tdsm.tif",
        "--transmissivity", "0.03:0.5", "--leaf-on", "04-15..10-31", "--receivers", "top",
        "--date", "2026-06-21", "--from", "12:00", "--to", "14:00", "--cell", "1",
        "--extent", "600001,5339981,600029,5339999", "--out", first,
    )  # fmt: skip
    assert said.status == 0, said
    assert "a canopy on the terrain, 40 cells up to 12 m" in said.err
    assert "overlap" not in said.err
    found = read(first)
    assert float(found.receiver_z.max()) == 200
    # With the sun in the south, a little high: below the crown is light, north of it shade.
    assert float(found.canopy_hours.max()) == 2
    assert float(found.sun_hours.min()) == pytest.approx(2 * 0.03, rel=1e-5)
    assert umbra_here("study", "--options", first / "study.toml", "--out", again).status == 0
    np.testing.assert_array_equal(read(again).sun_hours, found.sun_hours)


@pytest.mark.parametrize("receivers", ["ground", "points"])
def test_rules_weigh_what_comes_through(study, garden, tmp_path, receivers):
    table = tmp_path / "p.csv"
    table.write_text("x,y,z\n0,3,0\n")
    measured = {}
    for measure in ("sun_hours", "shadow_hours", "longest_sun_hours"):
        rules = tmp_path / "rules.yaml"
        text = RULES.format(measure=measure, place="bench", x=0, y=3)
        rules.write_text(text if receivers == "ground" else text.split("    where")[0])
        options = ["--rules", rules, "--canopy", "crown", "--transmissivity", "0.5"]
        options += ["--receivers", receivers, "--from", "10:00", "--to", "14:00", "--every", "1h"]
        options += ["--points", table] if receivers == "points" else []
        cell = "1" if receivers == "ground" else None
        assert study(*options, files=[garden], cell=cell).status == 0
        with (tmp_path / "out" / "verdicts.csv").open(encoding="utf-8") as file:
            (row,) = csv.DictReader(file)
        measured[measure] = row["measured"]
        assert "behind canopies" in row["evidence"]
    # The bench lies behind the crown all the time.
    assert measured == {"sun_hours": "2 h", "shadow_hours": "2 h", "longest_sun_hours": "0 h"}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ["--canopy", "crow"],
            "--canopy crow matches no part; did you mean 'crown'? the file has",
        ),
        (["--transmissivity", "0.03"], "say which parts they are with --canopy"),
        (["--canopy", "crown", "--transmissivity", "3"], "for 3 % write 0.03 or 3%"),
    ],
)
def test_slips_are_told_in_a_line(study, garden, options, said):
    assert said in study(*options, files=[garden]).refusal()
