"""``umbra sky``: the sky above a place."""

import json

import numpy as np
import pytest
from support.model_files import save_obj
from support.shapes import box

SITE = ("--lat", "48.2", "--lon", "16.37")


@pytest.fixture
def model(tmp_path):
    return save_obj(tmp_path / "m.obj", {"tower": box((-4, 10, 0), (4, 12, 20))})


def test_all_files_of_one_place(umbra_here, model, tmp_path):
    out = tmp_path / "out"
    said = umbra_here(
        "sky", model, "--at", "0,0,0,0,1,0", *SITE, "--date", "2026-06-21", "--out", out,
        "--write", "svg,pdf,csv,horizon,json", "--json",
    )  # fmt: skip
    assert said.status == 0, said.err
    found = said.json()
    assert {path.name for path in out.iterdir()} == {
        "sky.png", "sky.svg", "sky.pdf", "sky.csv", "sky-horizon.txt", "sky.json",
    }  # fmt: skip
    assert json.loads((out / "sky.json").read_text()) == found
    assert found["blocked_by"].keys() == {"tower"}
    assert found["sky_component"] / 39.61770884 + found["blocked_by"]["tower"] == pytest.approx(1)
    assert found["sun"][0].keys() >= {"date", "from", "to"}
    first = np.zeros(3)
    for outline in found["outlines"]:
        p = np.array(outline["directions"])
        n = np.cross(p, np.roll(p, -1, 0))
        size = np.linalg.norm(n, axis=1)
        angle = np.arctan2(size, (p * np.roll(p, -1, 0)).sum(1))
        first += ((angle / size)[:, None] * n).sum(0) / 2
        assert len(outline["part"]) == len(p)
    assert first[1] / np.pi == pytest.approx(found["sky_view_factor"], abs=1e-12)
    horizon = np.loadtxt(out / "sky-horizon.txt")
    assert horizon.shape == (360,)
    assert horizon[0] == pytest.approx(np.degrees(np.arctan(2)), abs=1e-3)


def test_several_places_by_name(umbra_here, model, tmp_path):
    table = tmp_path / "p.csv"
    table.write_text("name,x,y,z\nkitchen,0,0,1\n../../etc,1,0,1\n")
    out = tmp_path / "out"
    said = umbra_here("sky", model, "--points", table, "--out", out, "--json")
    assert said.status == 0, said.err
    assert [one["name"] for one in said.json()["points"]] == ["kitchen", "etc"]
    assert {path.name for path in out.iterdir()} == {"sky-kitchen.png", "sky-etc.png"}


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["--at", "0,0"],
        ["--at", "0,0,nan"],
        ["--at", "0,0,0,0,0,0"],
        ["--at", "0,0,0", "--points", "p.csv"],
        ["--at", "0,0,0", "--write", "tiff"],
        ["--at", "0,0,0", "--projection", "fisheye"],
        ["--at", "0,0,0", "--date", "2026-02-30", *SITE],
        ["--at", "0,0,0", "--date", "2026-02-03"],
        ["--at", "0,0,0", "--no-cast", "towr"],
    ],
)
def test_bad_input_is_one_line(umbra_here, model, tmp_path, options):
    said = umbra_here("sky", model, *options, "--out", tmp_path / "out", "--quiet")
    assert said.status == 2
    assert len(said.err.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
