"""Every file of a finished city is flipped, cut and removed; a run again ends in the same bytes."""

import shutil
from functools import partial

import pytest
from support.cities import DAY, make_houses, write_city

import umbra

PLAN = {"receivers": "top", "cell": 4.0, "extent": (84980, 446980, 85090, 447090)}
KINDS = {
    "plan": {**PLAN, "tiles": 60, "proposed": "east 3", "date": ["2026-12-21", "2026-03-20"]},
    "surfaces": {"receivers": "surfaces", "spacing": 6.0, "tiles": 60},
}


def read_folder(folder):
    """Return the bytes of a run's files, but for what tells who runs and how long it took."""
    files = {
        path.relative_to(folder): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    return {path: data for path, data in files.items() if path.parts[0] != "tiles"}


@pytest.fixture(scope="module", params=list(KINDS))
def finished(request, tmp_path_factory):
    """Return a finished run's folder, its bytes, and what runs it again."""
    folder = tmp_path_factory.mktemp("small")
    files = [
        write_city(
            folder / "a.city.json", make_houses(1, 4, (85000, 447000), (85030, 447060), "w")
        ),
        write_city(
            folder / "b.city.json", make_houses(2, 4, (85035, 447000), (85070, 447060), "east")
        ),
    ]
    options = {**DAY, "every": "3h", **KINDS[request.param]}
    count = partial(umbra.city_study, files, **options)
    out = folder / "out"
    count(out=out)
    return out, read_folder(out), count


def flip(path):
    data = bytearray(path.read_bytes())
    for at in {0, len(data) // 3, len(data) // 2, len(data) - 1} if data else ():
        damaged = bytearray(data)
        damaged[at] ^= 1
        path.write_bytes(damaged)
        yield f"byte {at}"


def cut(path):
    path.write_bytes(path.read_bytes()[:-1])
    yield "cut"
    path.write_bytes(b"")
    yield "empty"


def remove(path):
    path.unlink()
    yield "removed"


@pytest.mark.parametrize("damage", [flip, cut, remove])
def test_each_damaged_file_is_made_again_or_named(finished, tmp_path, damage):
    out, whole, count = finished
    again = tmp_path / "again"
    shutil.copytree(out, again)
    told = refused = 0
    for path in sorted(path for path in again.rglob("*") if path.is_file()):
        good = path.read_bytes()
        for what in damage(path):
            try:
                made = count(out=again)
            except umbra.InputError as error:
                refused += 1
                assert str(again) in str(error), (path, what)
                path.write_bytes(good)
                continue
            told += any("damaged" in note for note in made.notes)
            assert read_folder(again) == whole, (path, what)
            path.write_bytes(good) if damage is flip else None
            if damage is not flip:
                assert path.read_bytes() == good or "tiles" in path.parts, (path, what)
    assert told > 10 or damage is remove
    assert refused < 5
