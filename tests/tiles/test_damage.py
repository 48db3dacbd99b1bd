"""Each file of a finished city is flipped, cut and removed; a run again ends in the same bytes."""

import pickle
import shutil
import zlib
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from support.cities import DAY, SITE, make_houses, write_city
from support.shapes import box
from support.sweeps import sample_cases

import umbra
from umbra.tiles.store import CityStore
from umbra.writers.city import write_city_files

PLAN = {"receivers": "ground", "cell": 4.0, "extent": (84980, 446980, 85060, 447060), "tiles": 40}
KINDS = {"plan": {**PLAN, "proposed": "w 1"}, "surfaces": {"receivers": "surfaces", "spacing": 8.0}}


def read_folder(folder):
    """Return the bytes of a run's files, but for marks, which tell how long each tile took."""
    return {
        path.relative_to(folder): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.parent.name != "tiles"
    }


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Return, for each kind of receivers, a finished folder and what runs the study again."""
    folder = tmp_path_factory.mktemp("small")
    houses = make_houses(1, 3, (85000, 447000), (85030, 447030), "w")
    file = write_city(folder / "a.city.json", houses)
    site = umbra.Site(SITE["latitude"], SITE["longitude"], SITE["zone"])
    found = {}
    for kind, options in KINDS.items():
        count = partial(umbra.city_study, file, site, **{**DAY, "every": "3h"}, **options)
        count(out=folder / kind)
        found[kind] = folder / kind, count
    return found


def flip(path):
    data = bytearray(path.read_bytes())
    if data:
        data[zlib.crc32(str(path.name).encode()) % len(data)] ^= 4
        path.write_bytes(data)


def cut(path):
    path.write_bytes(path.read_bytes()[:-1])


@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("damage", [flip, cut, Path.unlink])
def test_each_damaged_file_is_made_again_or_named(runs, kind, tmp_path, damage):
    out, count = runs[kind]
    whole, again = read_folder(out), tmp_path / "again"
    shutil.copytree(out, again)
    files = sorted(path for path in again.rglob("*") if path.is_file())
    files = files[[flip, cut, Path.unlink].index(damage) :: 3]  # neighbours are of one sort
    files = sample_cases(files, 5)
    told, refused = set(), set()
    for path in files:
        good = path.read_bytes()
        damage(path)
        try:
            notes = count(out=again).notes
        except umbra.InputError as error:  # which names the folder, and leaves it as it is
            refused.add(path.name)
            assert str(again) in str(error), path  # noqa: PT017
            path.write_bytes(good)
            continue
        if any("damaged" in note for note in notes):
            told.add(path)
        assert read_folder(again) == whole, path
    assert not refused
    # What is always written anew needs no word: the index of files, and surfaces put together.
    unsaid = {path for path in files if path not in told and damage is not Path.unlink}
    own = {"index.json", "outside.json"}
    assert all(
        path.name in own or "neighbour" in str(path) or kind == "surfaces" for path in unsaid
    ), unsaid
    assert len(told) > (len(files) // 4 if kind == "plan" or damage is not Path.unlink else 0)


@pytest.mark.parametrize(("kind", "name"), [("plan", "geotiff"), ("surfaces", "3dtiles")])
@pytest.mark.parametrize("damage", [flip, cut, Path.unlink])
def test_damaged_files_of_tiles_are_written_again(runs, kind, name, tmp_path, damage):
    pytest.importorskip("rasterio")
    _, count = runs[kind]
    again = tmp_path / "again"
    shutil.copytree(runs[kind][0], again)
    write_city_files(again, [name])
    files = [path for path in (again / name).glob("*") if path.suffix in {".tif", ".glb"}]
    whole = {path: path.read_bytes() for path in files}
    assert files
    for path in files:
        damage(path)  # newer than what it was made of
    count(out=again)
    write_city_files(again, [name])
    assert {path: path.read_bytes() for path in files} == whole


@pytest.mark.parametrize("name", ["catalogue", "tiles", "study.zarr", "study.zarr/x", "city.json"])
def test_links_in_the_folder_are_not_written_through(runs, tmp_path, name):
    out, count = runs["plan"]
    again, aside = tmp_path / "again", tmp_path / "aside"
    shutil.copytree(out, again)
    shutil.move(again / name, aside)
    (again / name).symlink_to(aside)
    before = read_folder(aside) if aside.is_dir() else aside.read_bytes()
    with pytest.raises(umbra.InputError, match="holds 1 links") as caught:
        count(out=again)
    assert caught.value.option == "out"
    assert before == (read_folder(aside) if aside.is_dir() else aside.read_bytes())


class Command:
    """Writes a file when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def test_a_store_of_version_2_whose_codec_runs_code_is_never_opened(runs, tmp_path, monkeypatch):
    import numcodecs.pickles  # noqa: PLC0415
    import zarr  # noqa: PLC0415

    out, count = runs["plan"]
    again, proof = tmp_path / "again", tmp_path / "proof"
    shutil.copytree(out, again)
    # A caller may have given numcodecs leave to unpickle.
    monkeypatch.setattr(numcodecs.pickles, "ALLOW_UNSAFE_PICKLE_DECODE", True)
    shutil.rmtree(again / "study.zarr")
    group = zarr.create_group(str(again / "study.zarr"), zarr_format=2)
    for name in ("shadow_hours", "x"):
        group.create_array(name, shape=(1,), dtype="float64", filters=None)
        place = again / "study.zarr" / name
        text = (place / ".zarray").read_text()
        text = text.replace('"filters": null', '"filters": [{"id": "pickle"}]')
        assert '"pickle"' in text
        (place / ".zarray").write_text(text.replace('"dtype": "<f8"', '"dtype": "|O"'))
        (place / "0").write_bytes(pickle.dumps(Command(proof)))
    with pytest.raises(umbra.InputError, match="holds no study in tiles"):
        write_city_files(again, ["map"])
    made = count(out=again)
    assert np.isfinite(made.dataset.shadow_hours.values).all()
    assert read_folder(again) == read_folder(out)
    assert not proof.exists()


def test_files_of_a_damaged_store_are_refused_in_a_line(runs, tmp_path):
    out, _ = runs["plan"]
    for name in ("zarr.json", "x/c/0", "shadow_hours/c/0/0"):
        again = tmp_path / name.replace("/", "_")
        shutil.copytree(out, again)
        cut(again / "study.zarr" / name)
        with pytest.raises(umbra.InputError, match="is damaged; run the same study again"):
            write_city_files(again, ["map"])


def test_a_run_and_a_study_of_one_scene_do_not_share_a_folder(runs, tmp_path):
    _, count = runs["plan"]
    study = umbra.shadow_study(
        umbra.make_scene(*box((0, 0, 0), (5, 5, 5)), name="a"),
        umbra.Site(52.0, 4.4, "Europe/Amsterdam"), date="2026-12-21", every="3h",
        receivers="ground", cell=2.0,
    )  # fmt: skip
    from umbra.folders.atomic import replace_results  # noqa: PLC0415

    def write_too(_job, _tiles):
        with pytest.raises(umbra.InputError, match=r"another run \(process"):
            study.write(tmp_path / "both")
        return iter(())

    count(out=tmp_path / "both", engine=write_too)
    with (
        replace_results(tmp_path / "other"),
        pytest.raises(umbra.InputError, match=r"another run \(process"),
    ):
        count(out=tmp_path / "other")


def test_a_store_has_the_map_and_the_labels_of_a_file(runs, recwarn):
    import xarray as xr  # noqa: PLC0415
    import zarr  # noqa: PLC0415

    for kind, (out, _) in runs.items():
        store = out / "study.zarr"
        group = zarr.open(str(store), mode="r")
        labels = {name for name, array in group.arrays() if str(array.metadata.data_type) and
                  array.metadata.to_dict()["data_type"] == "string"}  # fmt: skip
        assert "xyz" in labels
        assert ("neighbour" if kind == "plan" else "part") in labels
        for _, array in group.arrays():
            assert array[...] is not None
            codecs = [codec["name"] for codec in array.metadata.to_dict()["codecs"]]
            assert set(codecs) <= {"bytes", "vlen-utf8", "blosc", "zstd", "crc32c"}
        with xr.open_zarr(str(store)) as data:
            data.load()
            assert data.spatial_ref.attrs["crs_wkt"].startswith(("COMPOUNDCRS", "COMPD_CS"))
            if kind == "plan":
                assert data.shadow_hours.attrs["grid_mapping"] == "spatial_ref"
                assert "spatial_ref" in data.shadow_hours.coords
                assert data.x.attrs["standard_name"] == "projection_x_coordinate"
    assert not [one for one in recwarn if "zarr" in str(one.filename).lower()]
    assert not [one for one in recwarn if "xarray" in str(one.filename).lower()]
    assert CityStore(runs["plan"][0] / "study.zarr").find_done()
