"""Which format a file is, what is said of a bad one, and what is imported."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

import umbra
from umbra import InputError

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def save(tmp_path):
    def write(content, name):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_source_has_the_files_hash(save):
    scene = umbra.read(str(save(TRIANGLE, "a.obj")))
    (source,) = scene.sources
    assert source.name == "a.obj"
    assert source.sha256 == hashlib.sha256(TRIANGLE.encode()).hexdigest()


@pytest.mark.parametrize(
    ("width", "height", "is_told"),
    [(9, 900, 0), (90, 1100, 1), (30000, 1400, 0), (500_000, 15_000, 1)],
)
def test_a_model_as_high_as_no_building_is_told(save, width, height, is_told):
    scene = umbra.read(save(f"v 0 0 0\nv {width} 0 {height}\nv 0 1 0\nf 1 2 3\n", "a.obj"))
    assert sum("in millimetres or feet" in note for note in scene.notes) == is_told


@pytest.mark.skipif(os.name != "posix", reason="needs a pipe with a name")
@pytest.mark.parametrize("start", ["", "# made by hand\r\nmtllib a.mtl\no one\n", "\ufeff"])
def test_an_obj_comes_from_a_pipe(start):
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb"):
        with os.fdopen(writing, "wb") as file:
            file.write((start + "\n" + TRIANGLE.replace(" 0 0\n", " 0. -0e0\n", 1)).encode())
        scene = umbra.read(f"/dev/fd/{reading}")
    assert scene.sources[0].format == "OBJ"
    assert scene.parts[0].triangles == 1


def test_a_dash_is_no_file_and_the_pipe_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="no such file; to read from a pipe, name /dev/stdin"):
        umbra.read("-")


def test_words_with_a_v_are_no_obj(save):
    with pytest.raises(InputError, match="format is unknown"):
        umbra.read(save("a table\nv is the speed, v 1 2\n", "notes"))


def test_several_files_become_one_scene(save):
    one, two = save(TRIANGLE, "a.obj"), save(TRIANGLE.replace("1", "3", 1), "b.OBJ")
    scene = umbra.read(one, two)
    assert [p.name for p in scene.parts] == ["a", "b"]
    assert [s.name for s in scene.sources] == ["a.obj", "b.OBJ"]
    assert len(scene.triangles().faces) == 2


def test_content_goes_before_the_ending(save):
    ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    ply += "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
    ply += "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    assert umbra.read(save(ply, "mesh.dat")).sources[0].format == "PLY"
    assert umbra.read(save(ply, "mesh.obj")).sources[0].format == "PLY"


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.obj", "", "is empty"),
        ("a.json", " \n ", "is empty"),
        ("a.xyz", "hello", "its format is unknown"),
        ("noending", b"\x00\x01\x02", "its format is unknown"),
        ("a.ifc", "ISO-10303-21;\nHEADER;", "is IFC that ends too early"),
        ("a.gml", "<?xml version='1.0'?><CityModel/>", "XML is not read"),
        ("a.json.gz", b"\x1f\x8b\x08\x00", "gzip"),
        ("a.zip", b"PK\x03\x04", "ZIP"),
        ("a.json", '{"type": "FeatureCollection", "features": []}', "has no polygons"),
        ("a.geojson", '{"type": "Feature"}', "has no polygons"),
        ("a.json", '{"a": 1}', "neither CityJSON, GeoJSON nor glTF (it has no type)"),
        ("a.json", '{"type": "Brick"}', "its type is 'Brick'"),
        ("a.json", "[1, 2]", "holds a list"),
        ("a.json", '{"type": "CityJSON"', "ends too early at line 1, column 20, byte 19 of 19"),
        ("a.json", '{"type":\n "CityJSON",\n é }', "is broken JSON at line 3, column 2, byte 23"),
        ("a.json", '{"type": "CityJSON", "vertices": [[NaN]]}', "is broken JSON at line 1"),
    ],
)
def test_bad_files_are_told_in_one_line(save, name, content, said):
    path = save(content, name)
    with pytest.raises(InputError) as caught:
        umbra.read(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert said in message
    assert "\n" not in message


def test_unread_format_lists_those_that_are(save, refuse):
    said = refuse(umbra.read, save("hello", "a.xyz"), facts={"ending": ".xyz"})
    assert "OBJ, PLY, STL, OFF" in said


def test_sequence_names_the_broken_line(save, refuse):
    head = '{"type":"CityJSON","version":"2.0","CityObjects":{},"vertices":[]}'
    feature = '{"type":"CityJSONFeature","CityObjects":{},"vertices":[]}'
    text = f"{head}\n{feature}\n{feature[:30]}\n"
    for name in ("a.jsonl", "a.city.jsonl", "a.json"):
        said = refuse(umbra.read, save(text, name), facts={"line": 3, "byte": 30})
        assert "ends too early at line 3, column" in said
    path = save(f"{head}\n{feature}\n[1]\n", "b.jsonl")
    assert "line 3: holds no CityObjects" in refuse(umbra.read, path, facts={"line": 3})


def test_missing_file_folder_and_nothing(tmp_path):
    with pytest.raises(InputError, match=r"lost\.obj: no such file"):
        umbra.read(tmp_path / "lost.obj")
    with pytest.raises(InputError, match="is a folder"):
        umbra.read(tmp_path)
    with pytest.raises(InputError, match="no file given"):
        umbra.read()
    with pytest.raises(InputError, match="cannot be read"):
        umbra.read("a\0b.obj")


def test_garbage_collection_is_left_as_it_was(save):
    import gc  # noqa: PLC0415

    path = save("", "a.obj")
    for was_on in (True, False):
        (gc.enable if was_on else gc.disable)()
        try:
            with pytest.raises(InputError):
                umbra.read(path)
            assert gc.isenabled() == was_on
        finally:
            gc.enable()


def test_reading_imports_no_more_than_it_needs(save):
    path = save(TRIANGLE, "a.obj")
    code = (
        "import sys, umbra; umbra.read(sys.argv[1]); "
        "print([m for m in ('trimesh', 'pyproj', 'orjson', 'numba', 'matplotlib', 'xarray') "
        "if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
    assert done.stderr == ""


def test_far_model_without_crs_keeps_its_digits(save):
    text = "v 2677116.375 1241839.025 400\nv 2677117 1241839 400\nv 2677117 1241840 400\nf 1 2 3\n"
    scene = umbra.read(save(text, "far.obj"))
    assert scene.origin.tolist() == [2677116.0, 1241839.0, 0.0]
    assert scene.bounds()[0].tolist() == [2677116.375, 1241839.0, 400.0]
    assert np.abs(scene.parts[0].mesh.vertices[:, :2]).max() < 2
