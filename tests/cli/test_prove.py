"""``umbra prove``: the sheet of a street, from files."""

import csv
import html
import json
import re
import struct
import zlib

import pytest
from support.model_files import save_obj
from support.shapes import box

SITE = ("--lat", "51.5", "--lon", "-0.12", "--year", "2026")
FILES = {"proof.html", "proof.pdf", "verdicts.csv", "conditions.csv"}
NAME = "<b>East</b> & Co"


def make_feature(name, x0, y0, x1, y1):
    ring = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]
    geometry = {"type": "Polygon", "coordinates": [ring]}
    return {"type": "Feature", "properties": {"name": name}, "geometry": geometry}


@pytest.fixture
def street(tmp_path):
    """Return a folder with a model, gardens, windows and a logo."""
    save_obj(tmp_path / "street.obj", {
        "front": box((-30, -30, 0), (30, -20, 12)), "house": box((-20, 0, 0), (20, 10, 12)),
        "new": box((-10, -30, 12), (10, -20, 24)),
    })  # fmt: skip
    gardens = [make_feature(NAME, 6, -18, 18, -2), make_feature("West", -18, -18, -6, -12)]
    (tmp_path / "gardens.geojson").write_text(
        json.dumps({"type": "FeatureCollection", "features": gardens})
    )
    lines = [f"W{k},{4 * k - 6},0,2,180,1.2,1.4,0.9,0.1,Flat {k // 2},living" for k in range(4)]
    (tmp_path / "windows.csv").write_text(
        "\n".join(["name,x,y,z,azimuth,width,height,sill,reveal,flat,room", *lines]) + "\n"
    )
    return tmp_path


def make_png(width, height):
    """Return a grey PNG."""

    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    rows = zlib.compress((b"\0" + b"\x80" * width) * height)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def test_a_sheet_from_files(umbra_here, street):
    (street / "logo.png").write_bytes(make_png(60, 30))
    out = street / "proof"
    said = umbra_here(
        "prove", street / "street.obj", *SITE, "--proposed", "new", "--areas",
        street / "gardens.geojson", "--windows", street / "windows.csv", "--rules",
        "bre-209-gardens,bre-209-vsc", "--rules", "sf-295", "--logo", street / "logo.png",
        "--title", "A <street>", "--number", "P-1", "--paper", "a4", "--out", out, "--json",
    )  # fmt: skip
    assert said.status == 0, said.err
    found = said.json()
    assert {path.name for path in out.iterdir()} == FILES
    assert found["year"] == 2026
    assert [one["rule"] for one in found["rules"]] == ["bre-209-gardens", "bre-209-vsc", "sf-295"]
    gardens, windows, _ = found["rules"]
    assert {one["name"] for one in gardens["findings"]} == {NAME, "West"}
    assert len(windows["findings"]) == 4
    for one in gardens["findings"] + windows["findings"]:
        assert one["margin"] == pytest.approx(one["value"] - one["limit"], abs=2e-4)
        assert one["verdict"] == ("pass" if one["margin"] >= 0 else "fail")
    with (out / "verdicts.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["name"], row["verdict"]) for row in rows] == [
        (one["name"], one["verdict"]) for rule in found["rules"] for one in rule["findings"]
    ]
    assert {row["standing"] for row in rows} == {"second-hand", "in-part"}
    page = (out / "proof.html").read_text()
    assert NAME not in page
    assert html.escape(NAME) in page
    assert "<title>A &lt;street&gt;</title>" in page
    assert not re.search(r"<script|https?://(?!www\.w3)|javascript:", page)
    for name in ("street.obj", "gardens.geojson", "windows.csv"):
        assert re.search(rf"{re.escape(name)}\s+SHA-256 [0-9a-f]{{64}}", page)
    assert (out / "proof.pdf").read_bytes().startswith(b"%PDF")


def test_what_lacks_is_unknown_and_the_status_is_0(umbra_here, street):
    rules = ("--rules", "bre-209-gardens", "--rules", "japan-56-2")
    said = umbra_here("prove", street / "street.obj", *SITE, *rules, "--out", street / "proof")
    assert said.status == 0, said.err
    assert "UNKNOWN" in said.out
    assert "--areas" in said.out
    assert "--plot" in said.out


WRONG = {
    "no rule": ((), "rules"),
    "an unknown rule": (("--rules", "bre-209-garden"), "bre-209-gardens"),
    "an unknown variant": (("--rules", "japan-56-2:9m"), "variant"),
    "a wrong year": (("--rules", "sf-295", "--year", "1900"), "1950"),
    "no proposal": (("--rules", "sf-295", "--proposed", "nothing"), "nothing"),
    "a logo that is none": (("--rules", "sf-295", "--logo", "street.obj"), "PNG"),
    "a logo of script": (("--rules", "sf-295", "--logo", "logo.svg"), "PNG"),
    "a large logo": (("--rules", "sf-295", "--logo", "large.png"), "3000"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_option_is_told_in_a_line(umbra_here, street, case, monkeypatch):
    monkeypatch.chdir(street)
    (street / "logo.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'><script/></svg>")
    (street / "large.png").write_bytes(make_png(4000, 2))
    words, message = WRONG[case]
    said = umbra_here("prove", "street.obj", *SITE, *words, "--out", street / "proof")
    assert said.status == 2
    last = said.err.strip().splitlines()[-1]
    assert message in last
    assert "Traceback" not in said.err
    assert not (street / "proof").exists()


def test_a_study_is_judged_by_a_cited_rule(umbra_here, street):
    out = street / "out"
    said = umbra_here(
        "study", street / "street.obj", "--lat", "51.5", "--lon", "-0.12", "--date", "2026-03-21",
        "--cell", "2", "--areas", street / "gardens.geojson", "--rules", "bre-209-gardens:x",
        "--no-pictures", "--out", out,
    )  # fmt: skip
    assert said.status == 2
    assert "no variant 'x'" in said.err
    said = umbra_here(
        "study", street / "street.obj", "--lat", "51.5", "--lon", "-0.12", "--date", "2026-03-21",
        "--cell", "2", "--areas", street / "gardens.geojson", "--rules", "bre-209-gardens",
        "--no-pictures", "--out", out,
    )  # fmt: skip
    assert said.status == 0, said.err
    with (out / "verdicts.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["rule"], row["name"]) for row in rows] == [
        ("bre-209-gardens", NAME), ("bre-209-gardens", "West"),
    ]  # fmt: skip
    assert 'rules = "bre-209-gardens"' in (out / "study.toml").read_text()
