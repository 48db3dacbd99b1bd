"""Addresses as outputs are refused by every writer, and leave no folder named after them."""

from pathlib import Path

import pytest
from support.command import VIENNA
from support.model_files import save_obj
from support.shapes import box

import umbra
from umbra.cli import main
from umbra.folders.atomic import check_is_here

ADDRESSES = ["s3://bucket/x", "gs://b/x", "https://example.org/x", "file:///tmp/x", "az+v2://x"]
DAY = {"date": "2026-09-18", "start": "11:00", "end": "13:00", "every": "1h"}


@pytest.fixture
def tower(tmp_path, monkeypatch):
    """An OBJ, and a current folder that must stay empty."""
    (tmp_path / "here").mkdir()
    path = save_obj(tmp_path / "tower.obj", {"tower": box((-2, -2, 0), (2, 2, 12))})
    monkeypatch.chdir(tmp_path / "here")
    yield path
    assert list(Path.cwd().iterdir()) == []


@pytest.mark.parametrize("address", ADDRESSES)
@pytest.mark.parametrize("kind", [str, Path])
def test_addresses_are_told_from_paths(address, kind):
    with pytest.raises(umbra.InputError) as caught:
        check_is_here(kind(address))
    assert caught.value.option == "out"
    assert f"'{address.replace(':///', '://')}'" in str(caught.value)


@pytest.mark.parametrize("path", ["a/s3:/b", "C:/x", "C:\\x", "s3:", "12:30/x", "//server/x", "x"])
def test_paths_pass(path):
    check_is_here(path)


def test_python_writes_to_no_address(tower):
    scene = umbra.read(tower)
    site = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
    study = umbra.shadow_study(scene, site, cell=1.0, receivers="ground", **DAY)
    drawing = umbra.draw_vectors(scene, camera=umbra.make_camera(scene))
    for write in (
        study.write,
        study.report,
        study.plot().save,
        drawing.write,
        lambda out: umbra.show(scene, site, out=out),
        lambda out: umbra.city_study(tower, site, out=out, cell=1.0, **DAY),
    ):
        with pytest.raises(umbra.InputError) as caught:
            write("s3://bucket/x.html")
        assert caught.value.option == "out"


@pytest.mark.parametrize(
    "words",
    [
        ["study", *VIENNA, "--date", "2026-09-18", "--out"],
        ["study", *VIENNA, "--date", "2026-09-18", "--tiles", "1km", "--out"],
        ["render", "--light", "1,1,1,0", "--out"],
        ["render", "--light", "1,1,1,0", "--out", "a.png", "--arrays"],
        ["view", *VIENNA, "--out"],
    ],
)
def test_the_shell_writes_to_no_address(tower, capsys, words):
    with pytest.raises(SystemExit) as ended:
        main([words[0], str(tower), *words[1:], "s3://bucket/x.html"])
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "s3://bucket/x.html" in told
