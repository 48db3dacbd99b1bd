"""A study in tiles from the shell, and what strangers give it."""

import json
import os
import zipfile
from contextlib import nullcontext
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from support.cities import DAY, make_houses, read_store, write_city
from support.forks import run_umbra
from support.shapes import box

import umbra
from umbra.calls.city import run_city
from umbra.errors import InputError, write_for_shell
from umbra.study.options import StudyOptions
from umbra.tiles.city_file import check_reading
from umbra.tiles.city_options import CityOptions
from umbra.writers.city import check_city_formats

GIVEN = {**DAY, "receivers": "ground", "cell": 2.0}
HERE = (84950, 446950, 85520, 447290)


def run(*words, folder):
    """Run the command in a process; return it with what it printed."""
    return run_umbra("study", *words, cwd=folder)


def test_the_command_writes_the_files_of_a_city(city, tmp_path):
    pytest.importorskip("rasterio")
    words = (
        city[0].parent, "--tiles", "150m", "--date", DAY["date"], "--every", "2h", "--cell", 2,
        "--write", "geotiff,stac", "--out", "out", "--json", "--quiet",
    )  # fmt: skip
    made = run(*words, folder=tmp_path)
    assert made.returncode == 0, made.stderr
    names = {str(Path(path).relative_to("out")) for path in json.loads(made.stdout)["files"]}
    assert {"study.zarr", "study.toml", "hours.vrt", "map.png", "item.json"} < names
    assert all((tmp_path / "out" / name).exists() for name in names)
    item = json.loads((tmp_path / "out" / "item.json").read_text())
    assert set(item["assets"]) == {"study", "hours", "map"}
    assert "geotiff" in (tmp_path / "out" / "study.toml").read_text()
    again = run("--options", "out/study.toml", "--no-pictures", "--out", "b", folder=tmp_path)
    assert again.returncode == 0, again.stderr
    assert (tmp_path / "b" / "hours.vrt").exists()
    assert not (tmp_path / "b" / "map.png").exists()
    assert read_store(tmp_path / "out") == read_store(tmp_path / "b")


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--tiles", "1km", "--write", "dxf"), "--write dxf is not made of a study in tiles"),
        (("--tiles", "1km", "--sheet"), "--sheet is not made of a study in tiles"),
        (("--tiles", "1km", "--write", "map", "--receivers", "surfaces"), "--write map is of pl"),
        (("--write", "stac"), "--write stac is of studies in tiles"),
        (("--tiles", "0m"), "--tiles is a length"),
        (("--tiles", "1"), "--tiles 1m are too small"),
        (("--tiles", "1km", "--memory", "10kB"), "--memory 10kB is too little"),
        (("--memory", "4GB"), "--memory is for a study in tiles"),
        (("--tiles", "1km", "--workers", "2", "--scheduler", "x"), "--workers starts a cluster"),
    ],
)
def test_errors_are_in_the_words_of_the_command(city, tmp_path, more, words):
    made = run(city[0], "--date", DAY["date"], *more, "--out", "out", folder=tmp_path)
    assert made.returncode == 2, made.stderr
    assert words in made.stderr
    assert not (tmp_path / "out" / "study.zarr").exists()


def test_unknown_formats_are_named_before_a_city_is_counted():
    with pytest.raises(umbra.InputError, match="there are geotiff, map, stac, geop") as caught:
        check_city_formats(["dxf"])
    assert caught.value.option == "write"
    check_city_formats(["stac", "map"])


def test_a_file_outside_the_box_is_left_out_with_a_note(city, tmp_path, monkeypatch):
    count = partial(umbra.city_study, tiles=60, extent=(84990, 446990, 85120, 447110), **GIVEN)
    box = {"bbox": (85000, 447000, 85100, 447100)}
    made = count(city[::-1], out=tmp_path / "all", reading=box)
    assert any("c_far.city.json: objects outside" in note for note in made.notes)
    alone = count(city[0], out=tmp_path / "one", reading=box)
    np.testing.assert_array_equal(made.dataset.shadow_hours, alone.dataset.shadow_hours)
    assert float(alone.dataset.shadow_hours.max()) > 1
    monkeypatch.setattr("umbra.tiles.city_catalogue.read", None)  # no file is read again
    again = count(city[::-1], out=tmp_path / "all", reading=box)
    assert again.notes == made.notes
    monkeypatch.undo()
    with pytest.raises(umbra.InputError, match="no object meets bbox="):
        count(city[1:], out=tmp_path / "none", reading=box)


def test_files_of_the_whole_are_written_while_no_other_run_may_use_the_folder(city, tmp_path):
    options = StudyOptions(**DAY, receivers="ground", cell=5.0)
    seen = []

    def write(study):
        with pytest.raises(umbra.InputError, match=r"another run .* writes into"):
            study.write("map")
        seen.append(study)

    run_city([city[0]], None, options, CityOptions(tiles=200), tmp_path, write=write)
    assert len(seen) == 1
    assert seen[0].write("map") == [tmp_path / "map.png"]


def test_a_damaged_file_among_many_is_named(city, tmp_path):
    damaged = tmp_path / "d.city.json"
    damaged.write_bytes(city[0].read_bytes()[:300])
    with pytest.raises(umbra.InputError, match=r"d\.city\.json: ends too early"):
        umbra.city_study([*city, damaged], out=tmp_path / "out", tiles=100, **GIVEN)


def test_a_file_that_is_removed_between_two_runs_is_named(tmp_path):
    folder = tmp_path / "files"
    folder.mkdir()
    for name, low in (("a", 85000), ("b", 85100)):
        houses = make_houses(3, 4, (low, 447000), (low + 50, 447050), name)
        write_city(folder / f"{name}.city.json", houses)
    count = partial(umbra.city_study, folder, out=tmp_path / "out", tiles=50, **GIVEN)
    before = count().dataset.shadow_hours.load()
    (folder / "b.city.json").unlink()
    with pytest.raises(umbra.InputError, match=r"other files .*b\.city\.json, now missing"):
        count()
    assert list((tmp_path / "out" / "tiles").glob("*.json"))
    assert float(before.max()) > 1
    renamed = partial(umbra.city_study, out=tmp_path / "named", tiles=50, **GIVEN)
    renamed(f"old={folder / 'a.city.json'}")
    with pytest.raises(umbra.InputError, match=r"a\.city\.json, of other layer or order"):
        renamed(f"new={folder / 'a.city.json'}")


@pytest.mark.parametrize(
    ("size", "options", "said"),
    [
        (1_000_000_000, {}, r"takes about 20\.8 GB, .* use 4\.0 GB; cut it into several files"),
        (1_000_000_000, {"bbox": (0, 0, 9, 9)}, "cut it into several"),
        (200_000_000, {}, r"about 4\.4 GB, .*, or give memory='5GB'"),
        (150_000_000, {}, None),
    ],
)
def test_a_file_that_is_larger_than_the_memory_is_refused_before_it_is_read(
    tmp_path, monkeypatch, size, options, said
):
    monkeypatch.setattr("umbra.tiles.city_file.find_memory", lambda: 8 * 2**30)
    path = tmp_path / "city.json"
    path.write_bytes(b"{")
    os.truncate(path, size)  # holds nothing: it takes no place on the disk
    with pytest.raises(InputError, match=said) if said else nullcontext():
        check_reading(path, 4 * 2**30, options)


def test_packed_citygml_is_judged_by_what_it_holds_and_a_part_of_it_is_read(tmp_path):
    path = tmp_path / "city.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.gml", bytes(1 << 22))
    most = 3e8 + 2.5 * (1 << 22)
    check_reading(path, most, {})
    with pytest.raises(InputError, match="or read a part of it with bbox="):
        check_reading(path, most - 1, {})
    check_reading(path, most - 1, {"bbox": (0, 0, 9, 9)})


def test_a_night_says_that_there_is_no_sun(city, tmp_path):
    night = {"date": "2026-*-31", "start": "00:00", "end": "02:00", "every": "1h"}
    swapped = {"latitude": 4.4, "longitude": 52.0}
    made = umbra.city_study(
        city, swapped, out=tmp_path / "a", tiles=300, cell=4.0, extent=HERE, **night
    )
    said = " ".join(made.notes)
    assert "the sun is below the horizon" in said
    assert "left out are February, April" in said
    assert "km from 52.0" in said
    assert float(made.dataset.shadow_hours.max()) == 0
    day = umbra.city_study(city, out=tmp_path / "b", tiles=300, cell=4.0, extent=HERE, **DAY)
    assert not any("below the horizon" in note for note in day.notes)


def test_an_output_folder_that_is_not_writable_is_named(city, tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    out = tmp_path / "out"
    out.mkdir()
    monkeypatch.setattr(type(out), "open", refuse)
    with pytest.raises(umbra.InputError, match=r"cannot write into .*permission denied") as caught:
        umbra.city_study(city, out=out, tiles=100, **GIVEN)
    assert caught.value.option == "out"


def test_tiles_of_a_few_cells_are_refused(city, tmp_path):
    for receivers in ("ground", "surfaces"):
        options = {
            **DAY,
            "receivers": receivers,
            "spacing" if receivers == "surfaces" else "cell": 2.0,
        }
        with pytest.raises(umbra.InputError, match="are too small: 8 cells of") as caught:
            umbra.city_study(city, out=tmp_path / receivers, tiles=7, **options)
        assert write_for_shell(str(caught.value)).startswith("--tiles 7m are too small")


@pytest.mark.parametrize("receivers", ["ground", "top", "surfaces"])
def test_64_tiles_on_two_workers_write_the_bytes_of_one_process(city, tmp_path, receivers):
    pytest.importorskip("distributed")
    options = {**DAY, "receivers": receivers}
    options |= {"spacing": 2.0} if receivers == "surfaces" else {"cell": 2.0, "extent": HERE}
    tiles = 120 if receivers == "surfaces" else 58
    count = partial(umbra.city_study, city, tiles=tiles, **options)
    one = count(out=tmp_path / "one")
    assert len(one.job.tiles()) >= 60
    count(out=tmp_path / "two", workers=2)
    assert read_store(tmp_path / "two") == read_store(tmp_path / "one")


def test_a_building_wound_inward_across_tiles_is_sampled_outward(tmp_path):
    vertices, faces = box((0, 0, 0), (30, 30, 10))
    place = np.asarray(vertices, float) + [85000, 447000, 0]
    found = []
    for name, wound in (("out", faces), ("in", np.asarray(faces)[:, ::-1])):
        lines = [f"v {x} {y} {z}" for x, y, z in place]
        lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in wound]
        file = tmp_path / f"{name}.obj"
        file.write_text("\n".join(lines))
        made = umbra.city_study(
            file, {"latitude": 52.0, "longitude": 4.4, "zone": "Europe/Amsterdam"},
            out=tmp_path / name, tiles=10, receivers="surfaces", spacing=2.0,
            reading={"up": "z"}, **DAY,
        )  # fmt: skip
        found.append(made.dataset.load())
    for data in found:
        outward = data.position.values - data.position.values.mean(0)
        assert ((outward * data.normal.values).sum(1) > 0).all()
    assert float(found[0].sun_hours.sum()) == pytest.approx(float(found[1].sun_hours.sum()))
    assert len(found[0].sample) == len(found[1].sample) > 300
