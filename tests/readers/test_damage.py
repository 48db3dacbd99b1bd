"""Files cut and bent at random: an InputError in one line, or a scene; nothing else."""

import json
from functools import cache

import numpy as np
import pyproj.database
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.small_files import BYTES, cityjson, geojson
from support.sweeps import reduce_count

import umbra
from umbra import InputError

pytestmark = pytest.mark.usefixtures("children")  # a library may end its process


def read_or_refuse(folder, name, data):
    path = folder / name
    path.write_bytes(data)
    try:
        scene = umbra.read(path)
    except InputError as error:
        message = str(error)
        assert "\n" not in message
        assert str(path) in message
        assert len(message) < 600
        return None
    assert np.isfinite(scene.bounds()).all()
    return scene


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("damage")


@pytest.fixture(scope="module", autouse=True)
def _remember_zones():
    # Listing the UTM zones of a datum takes 50 ms, and files in degrees are read a thousand times.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            pyproj.database, "query_utm_crs_info", cache(pyproj.database.query_utm_crs_info)
        )
        yield


@pytest.mark.parametrize("name", BYTES)
def test_whole_files_are_read(folder, name):
    assert read_or_refuse(folder, name, BYTES[name]) is not None


@pytest.mark.parametrize("name", BYTES)
def test_files_cut_anywhere(folder, name):
    data = BYTES[name]
    cuts = reduce_count(20 if name.endswith(".tif") else 150, 3)  # each tif is read in a child
    for end in range(0, len(data), max(1, len(data) // cuts)):
        read_or_refuse(folder, name, data[:end])


@pytest.mark.parametrize("name", BYTES)
def test_files_with_changed_bytes(folder, name):
    @given(data=st.data())
    @settings(deadline=None, max_examples=reduce_count(30 if name.endswith(".tif") else 100, 3))
    def change(data):
        read_or_refuse(folder, name, change_bytes(BYTES[name], data))

    change()


def change_bytes(whole, data):
    changed = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(changed) - 1))
        new = data.draw(
            st.sampled_from(b'0123456789-.e,:[]{}"\\/ \n#\x00\xffnaN') | st.integers(0, 255)
        )
        how = data.draw(st.sampled_from(["put", "insert", "drop"]))
        if how == "put":
            changed[place] = new
        elif how == "insert":
            changed.insert(place, new)
        else:
            del changed[place]
    return bytes(changed)


def places_in(tree, path=()):
    yield path
    items = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in items if isinstance(tree, dict | list) else ():
        if isinstance(value, dict | list):
            yield from places_in(value, (*path, key))
        else:
            yield (*path, key)


ODD = [None, True, -1, 0, 7, 10**12, 1.5, 1e308, "", "a", [], {}, [[]], [[0]], {"type": "Solid"}]
TREES = {
    "a.json": cityjson(),
    "a.gltf": json.loads(BYTES["a.glb"][20:].split(b"BIN\0")[0][:-4]),
    "f.geojson": geojson(),
}


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("odd", range(len(ODD)))
def test_json_with_an_odd_value_anywhere(folder, name, odd):
    buffer = BYTES["a.glb"][BYTES["a.glb"].index(b"BIN\0") + 4 :]
    (folder / "a.bin").write_bytes(buffer)
    text = json.dumps(TREES[name])
    # Every other place: the next value goes where this one does not.
    for path in list(places_in(TREES[name]))[1 + odd % 2 :: 2]:
        tree = json.loads(text)
        if name == "a.gltf" and path[:1] != ("buffers",):
            tree["buffers"][0]["uri"] = "a.bin"
        inner = tree
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = ODD[odd]
        read_or_refuse(folder, name, json.dumps(tree).encode())
