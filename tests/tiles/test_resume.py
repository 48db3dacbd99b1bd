"""Runs that end early go on; what is damaged or changed is counted again, or named."""

import json
import os
import signal
import time

import numpy as np
import pytest
from support.cities import DAY, make_houses, read_store, write_city
from support.forks import start_python
from support.sweeps import reduce_count

import umbra
from umbra.errors import UmbraError
from umbra.tiles import run as runs
from umbra.tiles.count import count_tile
from umbra.tiles.run import lock_run

OPTIONS = {**DAY, "receivers": "ground", "cell": 2.0, "extent": (84950, 446950, 85520, 447290)}
TILES = 60


@pytest.fixture(scope="module")
def whole(city, tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    study = umbra.city_study(city, out=folder, tiles=TILES, **OPTIONS)
    assert len(study.job.tiles()) == 10 * 6
    return read_store(folder)


RUN = """
import json, sys, umbra
files, out, options = json.loads(sys.argv[1])
umbra.city_study(files, out=out, tiles=60, **options)
print("done")
"""


@pytest.mark.parametrize("receivers", ["ground", "surfaces"])
def test_killed_runs_end_in_the_same_bytes(city, tmp_path, whole, receivers):
    options = dict(OPTIONS)
    if receivers == "surfaces":
        options = {**DAY, "receivers": receivers, "spacing": 2.0}
        umbra.city_study(city, out=tmp_path / "whole", tiles=TILES, **options)
        whole = read_store(tmp_path / "whole")
    given = json.dumps([[str(path) for path in city], str(tmp_path / "killed"), options])
    enough = reduce_count(4, 2)
    marks, kills = tmp_path / "killed" / "tiles", 0
    rng = np.random.default_rng(5)
    done = ""
    while "done" not in done:
        child = start_python("-c", RUN, given)
        if kills < enough:
            before = len(list(marks.glob("*.json")))
            while child.poll() is None and len(list(marks.glob("*.json"))) < before + 12:
                time.sleep(0.005)
            time.sleep(rng.uniform(0, 0.05))
            child.send_signal(signal.SIGKILL)
            kills += 1
        done, _ = child.communicate()
    assert kills == enough
    assert read_store(tmp_path / "killed") == whole


def test_a_full_disk_is_told_with_the_remedy(city, tmp_path):
    (tmp_path / "full").symlink_to("/dev/full")

    def fill(_done, _of):
        np.zeros(4096).tofile(tmp_path / "full")

    with pytest.raises(UmbraError, match=r"no space left on device.*free some space"):
        umbra.city_study(city, out=tmp_path, tiles=TILES, **OPTIONS, progress=fill)


def test_a_tile_that_fails_leaves_the_others_and_is_counted_again(
    city, tmp_path, monkeypatch, whole
):
    def fail(job, tile):
        if tile.number in {7, 50}:
            msg = "no luck"
            raise ValueError(msg)
        return count_tile(job, tile)

    monkeypatch.setattr(runs, "count_tile", fail)
    with pytest.raises(umbra.UmbraError, match=r"2 of 60 tiles failed .*tile 7, ValueError: no l"):
        umbra.city_study(city, out=tmp_path, tiles=TILES, **OPTIONS)
    failed = json.loads((tmp_path / "failed.json").read_text())
    assert [one["tile"] for one in failed] == [7, 50]
    assert len(list((tmp_path / "tiles").glob("*.json"))) == 58
    monkeypatch.undo()
    umbra.city_study(city, out=tmp_path, tiles=TILES, **OPTIONS)
    assert not (tmp_path / "failed.json").exists()
    assert read_store(tmp_path) == whole


def test_a_damaged_mark_and_a_damaged_catalogue_are_made_again(city, tmp_path, whole):
    umbra.city_study(city, out=tmp_path, tiles=TILES, **OPTIONS)
    (tmp_path / "tiles" / "000003.json").write_bytes(b'{"num')
    vertices = tmp_path / "catalogue" / "000001" / "vertices.npy"
    damaged = bytearray(vertices.read_bytes())
    damaged[-5] ^= 1
    vertices.write_bytes(damaged)
    (tmp_path / "catalogue" / "000002" / "entry.json").write_bytes(b"{")
    chunk = tmp_path / "study.zarr" / "shadow_hours" / "c" / "0" / "5"
    chunk.write_bytes(chunk.read_bytes()[:-3])
    (chunk.parent / "6.0f3a.partial").write_bytes(b"")  # as a killed run leaves it
    counted = []

    def see(job, tiles):
        counted.extend(tile.number for tile in tiles)
        return runs.count_serially(job, tiles)

    umbra.city_study(city, out=tmp_path, tiles=TILES, engine=see, **OPTIONS)
    assert counted == [3, 5]
    assert read_store(tmp_path) == whole


def test_another_study_and_changed_files_are_named(city, tmp_path):
    houses = make_houses(4, 5, (85000, 447000), (85050, 447050))
    file = write_city(tmp_path / "one.city.json", houses)
    out = tmp_path / "out"
    options = {**DAY, "cell": 5.0}
    umbra.city_study(file, out=out, **options)
    with pytest.raises(umbra.InputError, match=r"holds a study with another cell= \(5.0, now 4"):
        umbra.city_study(file, out=out, **{**options, "cell": 4.0})
    changed = r"another date= \(2026-\d\d-\d\d, now 2026-09-01,2026-09-02\)"
    with pytest.raises(umbra.InputError, match=changed):
        umbra.city_study(file, out=out, **{**options, "date": ["2026-09-01", "2026-09-02"]})
    with pytest.raises(umbra.InputError, match="holds a study with other tiles or cells"):
        umbra.city_study(file, out=out, tiles="50m", **options)
    os.utime(file, (1, 1))  # another time, the same bytes
    umbra.city_study(file, out=out, **options)
    write_city(file, [*houses[:-1], ("other", 85000, 447000, 0, 9, 9, 9, 0)])
    with pytest.raises(umbra.InputError, match=r"other files .*one.city.json, changed or new"):
        umbra.city_study(file, out=out, **options)


def test_a_folder_is_held_by_one_run(city, tmp_path):
    with (
        lock_run(tmp_path),
        pytest.raises(umbra.InputError, match=r"run \(process \d+\) writes into"),
    ):
        umbra.city_study(city, out=tmp_path, tiles=TILES, **OPTIONS)
