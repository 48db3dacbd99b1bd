"""``umbra envelope``: files, numbers, and what is refused."""

import json

import numpy as np
import pytest
import rasterio
import trimesh
from support.model_files import save_obj
from support.shapes import box

import umbra

SITE = ("--lat", "48.2", "--lon", "16.37", "--tz", "Europe/Vienna")
RULE = """\
format: 1
name: Two hours
version: "1"
source: Invented for a test
checks:
  - name: sun
    dates: 2026-03-21
    from: 10:00
    to: 15:00
    every: 1h
    at_least: {limit}
    where:
      - {{name: garden, x: 1.5, y: 14.2}}
"""
SKY = """\
format: 2
name: Sky
edition: "1"
source: Invented for a test
checks:
  - name: sky
    receivers: places
    where: [{name: garden, x: 1.5, y: 14.2}]
    measure: sky_component
    at_least: 20
"""


@pytest.fixture
def folder(tmp_path):
    save_obj(tmp_path / "m.obj", {"house": box((-30, -4, 0), (-22, 4, 9)),
                                  "shed": box((-3, -3, 0), (3, 3, 2.5)),
                                  "hall": box((20, -40, 0), (28, -30, 12))})  # fmt: skip
    (tmp_path / "rule.yaml").write_text(RULE.format(limit="2h"))
    (tmp_path / "sky.yaml").write_text(SKY)
    write_plot(tmp_path / "plot.geojson", -5, -5, 5, 5)
    return tmp_path


def write_plot(path, x0, y0, x1, y1):
    ring = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]
    geometry = {"type": "Polygon", "coordinates": [ring]}
    one = {"type": "Feature", "properties": {"name": "plot"}, "geometry": geometry}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [one]}))
    return path


@pytest.fixture
def build(umbra_here, folder):
    def run(*options, plot="plot.geojson", rules="rule.yaml"):
        return umbra_here(
            "envelope", folder / "m.obj", "--plot", folder / plot, "--rules", folder / rules,
            *SITE, "--ground", "0", *options,
        )  # fmt: skip

    return run


def test_all_files_hold_the_same_solid(build, folder):
    out = folder / "out"
    said = build("--cell", "2", "--max", "30", "--out", out, "--json", "--write", "cityjson,json")
    assert said.status == 0, said.err
    found = said.json()
    assert found["violations"] == 0
    assert 0 < found["volume_m3"] <= found["bound_m3"] <= 3000
    assert found["max_height_m"] == pytest.approx(30, abs=2e-3)
    assert found["replaced"] == ["shed"]
    assert {path.name for path in out.iterdir()} == {
        "envelope.png", "envelope.tif", "envelope.obj", "envelope.glb", "envelope.city.json",
        "envelope.json",
    }  # fmt: skip
    assert json.loads((out / "envelope.json").read_text())["volume_m3"] == found["volume_m3"]
    for name in ("envelope.obj", "envelope.glb"):
        solid = trimesh.load(out / name, force="mesh")
        assert solid.is_watertight
        assert solid.volume == pytest.approx(found["volume_m3"], rel=1e-3)
    with rasterio.open(out / "envelope.tif") as raster:
        heights = raster.read(1)
        assert raster.descriptions == ("height", "height_bound", "ground")
        assert np.nansum(heights) * 4 == pytest.approx(found["volume_m3"], rel=1e-6)
        assert raster.bounds == (-5, -5, 5, 5)
        assert np.all(raster.read(2)[np.isfinite(heights)] >= heights[np.isfinite(heights)] - 2e-3)


def test_what_is_kept_stands_among_the_casters(build):
    alone = build("--cell", "2", "--json").json()
    beside = build("--cell", "2", "--json", "--keep", "shed").json()
    assert alone["replaced"] == ["shed"]
    assert beside["replaced"] == []


def test_who_has_too_little_before_is_named(build, folder):
    (folder / "much.yaml").write_text(RULE.format(limit="9h"))
    said = build("--cell", "2", "--json", rules="much.yaml")
    assert said.status == 0
    assert said.json()["broken_before"] == ["garden (sun)"]
    assert "garden" in said.err


@pytest.mark.parametrize(
    ("corners", "options", "rules", "word"),
    [
        ((5000, 5000, 5010, 5010), (), "rule.yaml", "plot"),
        ((-5, -5, 5, -5), (), "rule.yaml", "plot"),
        ((-5, -5, 5, 20), (), "rule.yaml", "garden"),
        ((-5, -5, 5, 5), ("--cell", "0.001"), "rule.yaml", "cell"),
        ((-5, -5, 5, 5), ("--cell", "0.01"), "rule.yaml", "cells"),
        ((-5, -5, 5, 5), ("--cell", "50"), "rule.yaml", "cell"),
        ((-5, -5, 5, 5), ("--max", "0"), "rule.yaml", "cap"),
        ((-5, -5, 5, 5), ("--write", "dwg"), "rule.yaml", "dwg"),
        ((-5, -5, 5, 5), ("--keep", "shade"), "rule.yaml", "shed"),
        ((-5, -5, 5, 5), (), "sky.yaml", "sky"),
        ((-5, -5, 5, 5), (), "none.yaml", "none.yaml"),
        ((-5, -5, 5, 5), ("--max-height", "hall"), "rule.yaml", "one of the two"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(build, folder, corners, options, rules, word):
    write_plot(folder / "other.geojson", *corners)
    said = build("--json", *options, plot="other.geojson", rules=rules)
    assert said.status == 2, said.out
    assert word in said.err.splitlines()[-1]
    assert "Traceback" not in said.err


def test_a_part_reaches_the_height_of_its_plane(umbra_here, folder):
    """The hall alone shades the garden: one step at noon, so that its edge is on the ray."""
    save_obj(folder / "wall.obj", {"wall": box((-20, 0, 0), (20, 1, 3))})
    (folder / "noon.yaml").write_text(
        RULE.format(limit="1h").replace("10:00", "12:00").replace("15:00", "13:00")
    )
    said = umbra_here(
        "envelope", folder / "wall.obj", "--max-height", "wall", "--rules", folder / "noon.yaml",
        *SITE, "--ground", "0", "--json", "--out", folder / "part",
    )  # fmt: skip
    assert said.status == 0, said.err
    found = said.json()
    for ending in ("obj", "glb"):
        low, high = umbra.read(folder / "part" / f"envelope.{ending}").bounds()
        assert (high - low)[2] == pytest.approx(found["max_height_m"], abs=1e-5)
    wrong = umbra_here(
        "envelope", folder / "wall.obj", "--max-height", "wall", "--rules", folder / "noon.yaml",
        *SITE, "--write", "cityjson", "--out", folder / "part",
    )  # fmt: skip
    assert (wrong.status, "--plot" in wrong.err) == (2, True)
    from umbra.sun import Site, find_sun  # noqa: PLC0415

    sun = find_sun(Site(48.2, 16.37, "Europe/Vienna"), ["2026-03-21T11:30"]).direction[0]
    height = (14.2 - 1.0) * sun[2] / -sun[1]  # over the wall's northern edge
    assert found["max_height_m"] <= height < found["max_height_m"] + 0.01
    assert found["binding"] == ["garden (sun)"]
    assert found["studies"] < 20
