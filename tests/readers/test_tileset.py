"""3D Tiles: levels, refinement, external and implicit sets, the frame on the earth, boxes."""

import json
import struct

import numpy as np
import pytest
from pyproj import Transformer
from support.gltf_files import Document

import umbra
from umbra import InputError

TO_EARTH = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
LON, LAT = 4.36, 52.01


def glb(width=1.0, height=1.0, centre=None):
    """A wall of the width in the tile's x and the height in its z; in glTF y is up."""
    document = Document()
    points = np.array([[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]], "<f4")
    corners = document.accessor(np.array([0, 1, 2, 0, 2, 3], "<u2"))
    mesh = document.mesh(
        {"attributes": {"POSITION": document.accessor(points)}, "indices": corners}
    )
    document.node(mesh=mesh, name="wall")
    data = document.glb()
    if centre is None:
        return data
    table = json.dumps({"BATCH_LENGTH": 0, "RTC_CENTER": centre}).encode()
    table += b" " * (-len(table) % 8)
    return (
        struct.pack("<4s6I", b"b3dm", 1, 28 + len(table) + len(data), len(table), 0, 0, 0)
        + table
        + data
    )


def tile(uri=None, error=0.0, children=(), size=1.0, **more):
    volume = {"box": [0, 0, 0, size, 0, 0, 0, size, 0, 0, 0, size]}
    content = {"content": {"uri": uri}} if uri else {}
    return {"boundingVolume": volume, "geometricError": error, "children": list(children),
            **content, **more}  # fmt: skip


def place(lon, lat, height=0.0):
    """A tile's transform: east, north, up at a place on the earth, by columns."""
    a, b = np.radians([lon, lat])
    matrix = np.eye(4)
    matrix[:3, 0] = -np.sin(a), np.cos(a), 0
    matrix[:3, 1] = -np.sin(b) * np.cos(a), -np.sin(b) * np.sin(a), np.cos(b)
    matrix[:3, 2] = np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)
    matrix[:3, 3] = TO_EARTH.transform(lon, lat, height)
    return matrix.T.ravel().tolist()


def i3dm(content, tree, *arrays, is_within=True):
    """Instances of a glTF, whose properties lie one after the other in the binary body."""
    body = b"".join(np.asarray(one).tobytes() for one in arrays)
    table = json.dumps(tree).encode()
    table += b" " * (-len(table) % 8)
    head = (1, 32 + len(table) + len(body) + len(content), len(table), len(body), 0, 0, is_within)
    return struct.pack("<4s7I", b"i3dm", *head) + table + body + content


@pytest.fixture
def write(tmp_path):
    def save(root, files, version="1.1", name="tileset.json"):
        for word, data in files.items():
            (tmp_path / word).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / word).write_bytes(data)
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        tree = {"asset": {"version": version}, "geometricError": 100, "root": root}
        path.write_text(json.dumps(tree))
        return path

    return save


def widths(scene):
    return sorted(round(float(np.ptp(part.bounds[:, 0])), 3) for part in scene.parts)


@pytest.mark.parametrize(
    ("refine", "error", "expected"),
    [
        ("REPLACE", None, [3, 4]), ("REPLACE", 1, [2, 3]), ("REPLACE", 5, [1]),
        ("ADD", None, [1, 2, 3, 4]), ("ADD", 1, [1, 2, 3]), ("ADD", 5, [1]),
    ],
)  # fmt: skip
def test_tiles_are_refined_as_they_say_until_they_are_fine_enough(write, refine, error, expected):
    root = tile("1.glb", 5, [tile("2.glb", 1, [tile("4.glb")]), tile("3.glb")], refine=refine)
    path = write(root, {f"{n}.glb": glb(n) for n in (1, 2, 3, 4)})
    scene = umbra.read(path, geometric_error=error)
    assert widths(scene) == expected
    assert scene.sources[0].format == "3D Tiles 1.1"
    assert {part.name for part in scene.parts} == {f"{n}/wall" for n in expected}


def test_tiles_keep_their_place_and_z_is_up(write):
    up = np.eye(4)
    up[:3, 3] = 10, 20, 30
    turned = tile("1.glb", transform=up.T.ravel().tolist())
    scene = umbra.read(write(tile(error=9, children=[turned]), {"1.glb": glb(2, 5)}))
    np.testing.assert_allclose(scene.bounds(), [[10, 20, 30], [12, 20, 35]])
    moved = umbra.read(write(tile("1.b3dm"), {"1.b3dm": glb(2, 5, [1, 2, 3])}, "1.0"))
    np.testing.assert_allclose(moved.bounds(), [[1, 2, 3], [3, 2, 8]])


def test_a_set_on_the_earth_is_read_east_north_and_up(write):
    scene = umbra.read(write(tile("1.glb", transform=place(LON, LAT, 40)), {"1.glb": glb(8, 20)}))
    np.testing.assert_allclose(scene.bounds(), [[0, 0, 40], [8, 0, 60]], atol=1e-6)
    assert scene.latitude == pytest.approx(LAT, abs=1e-4)
    assert scene.longitude == pytest.approx(LON, abs=1e-3)
    assert scene.true_north == pytest.approx(0, abs=1e-3)
    assert any("heights above the ellipsoid" in note for note in scene.notes)


def test_a_box_in_degrees_reads_only_tiles_that_meet_it(write, tmp_path):
    """The second and third tile lie 70 m and 700 m east; the third's file is damaged."""
    east = [tile(f"{n}.glb", transform=place(LON + step, LAT), size=10)
            for n, step in enumerate((0, 0.001, 0.01))]  # fmt: skip
    degrees = [*np.radians([LON - 0.1, LAT - 0.1, LON + 0.1, LAT + 0.1]).tolist(), 0, 50]
    root = tile(error=9, children=east)
    root["boundingVolume"] = {"region": degrees}
    path = write(root, {"0.glb": glb(5), "1.glb": glb(5), "2.glb": b"broken"})
    scene = umbra.read(path, bbox=(LON - 1e-4, LAT - 1e-4, LON + 1e-4, LAT + 1e-4))
    assert [part.name for part in scene.parts] == ["0/wall"]
    assert scene.latitude == pytest.approx(LAT, abs=1e-4)
    assert any("left out: 2" in note for note in scene.notes)
    with pytest.raises(InputError, match=r"2\.glb"):
        umbra.read(path)


def test_sets_in_sets_are_read_relative_to_themselves(write):
    inner = {"asset": {"version": "1.0"}, "root": tile("wall%201.glb")}
    scene = umbra.read(
        write(
            tile("city/inner.json", 1),
            {"city/inner.json": json.dumps(inner).encode(), "city/wall 1.glb": glb(7)},
        )
    )
    assert widths(scene) == [7]
    loop = {"asset": {"version": "1.0"}, "root": tile("loop.json")}
    with pytest.raises(InputError, match="leads back to itself"):
        umbra.read(write(tile("loop.json"), {"loop.json": json.dumps(loop).encode()}))


@pytest.mark.parametrize("uri", ["../secret.glb", "/etc/passwd", "a/../../secret.glb"])
def test_files_elsewhere_are_not_opened(write, tmp_path, uri):
    (tmp_path / "secret.glb").write_bytes(glb())
    (tmp_path / "set").mkdir()
    path = write(tile(uri), {}, name="set/tileset.json")
    with pytest.raises(InputError, match="outside the model's folder"):
        umbra.read(path)


def test_the_net_points_and_instances_are_left_out_and_counted(write):
    root = tile(children=[tile("1.glb"), tile("https://a.example/2.glb"), tile("3.pnts")])
    scene = umbra.read(write(root, {"1.glb": glb(), "3.pnts": b"pnts" + bytes(30)}))
    assert len(scene.parts) == 1
    said = " ".join(scene.notes)
    assert "lie on the net: 1 (first: 'https://a.example/2.glb')" in said
    assert "point clouds (pnts) left out: 1 (first: '3.pnts')" in said


PLACES = np.array([[10, 20, 30], [-5, 0, 65535]], "<f4")


@pytest.mark.parametrize(
    ("tree", "arrays", "expected"),
    [
        ({}, [], [[10, 20, 30, 12, 20, 33], [-5, 0, 65535, -3, 0, 65538]]),
        ({"RTC_CENTER": [1, 2, 0], "SCALE": {"byteOffset": 24}}, [np.array([1, 3], "<f4")],
         [[11, 22, 30, 13, 22, 33], [-4, 2, 65535, 2, 2, 65544]]),
        ({"NORMAL_UP": {"byteOffset": 24}, "NORMAL_RIGHT": {"byteOffset": 48}},
         [np.array([[0, 1, 0], [1, 0, 0]], "<f4"), np.array([[1, 0, 0], [0, -1, 0]], "<f4")],
         [[10, 20, 30, 12, 20, 33], [-5, -2, 65535, -5, 0, 65538]]),
        ({"NORMAL_UP_OCT32P": {"byteOffset": 24}, "NORMAL_RIGHT_OCT32P": {"byteOffset": 32}},
         [np.array([[32768, 65535], [65535, 32768]], "<u2"),
          np.array([[65535, 32768], [32768, 0]], "<u2")],
         [[10, 20, 30, 12, 20, 33], [-5, -2, 65535, -5, 0, 65538]]),
        ({"SCALE_NON_UNIFORM": {"byteOffset": 24}}, [np.array([[1, 1, 1], [2, 1, 5]], "<f4")],
         [[10, 20, 30, 12, 20, 33], [-5, 0, 65535, -1, 0, 65550]]),
    ],
)  # fmt: skip
def test_instances_stand_where_their_table_says_and_share_a_mesh(write, tree, arrays, expected):
    """A wall 2 m wide along x and 3 m high, without thickness."""
    table = {"INSTANCES_LENGTH": 2, "POSITION": {"byteOffset": 0}, **tree}
    data = i3dm(glb(2, 3), table, PLACES, *arrays)
    scene = umbra.read(write(tile("1.i3dm"), {"1.i3dm": data}, "1.0"))
    assert [part.name for part in scene.parts] == ["1/wall 1", "1/wall 2"]
    np.testing.assert_allclose([p.bounds.ravel() for p in scene.parts], expected, atol=1e-3)
    assert scene.parts[0].mesh is scene.parts[1].mesh
    assert scene.parts[1].matches("wall")


def test_instances_may_be_quantised_and_name_their_model(write, tmp_path):
    table = {"INSTANCES_LENGTH": 1, "QUANTIZED_VOLUME_OFFSET": [1, 2, 3],
             "QUANTIZED_VOLUME_SCALE": [10, 20, 40], "POSITION_QUANTIZED": {}}  # fmt: skip
    table["POSITION_QUANTIZED"]["byteOffset"] = 0
    data = i3dm(b"m/wall.glb  ", table, np.array([65535, 0, 65535], "<u2"), is_within=False)
    scene = umbra.read(write(tile("1.i3dm"), {"1.i3dm": data, "m/wall.glb": glb()}, "1.0"))
    np.testing.assert_allclose(scene.bounds(), [[11, 2, 43], [12, 2, 44]])
    np.testing.assert_allclose(umbra.read(tmp_path / "1.i3dm").bounds(), scene.bounds())
    (tmp_path / "m/wall.glb").unlink()
    with pytest.raises(InputError, match=r"'m/wall\.glb' is not beside the file"):
        umbra.read(tmp_path / "1.i3dm")


def test_instances_on_the_earth_stand_upright(write):
    height = np.array(TO_EARTH.transform(LON, LAT, 40))
    table = {"INSTANCES_LENGTH": 1, "EAST_NORTH_UP": True, "POSITION": [0, 0, 0],
             "RTC_CENTER": height.tolist()}  # fmt: skip
    root = tile("1.i3dm")
    root["boundingVolume"] = {"sphere": [*height.tolist(), 50.0]}
    scene = umbra.read(write(root, {"1.i3dm": i3dm(glb(8, 20), table)}, "1.0"))
    np.testing.assert_allclose(scene.bounds(), [[0, 0, 40], [8, 0, 60]], atol=1e-6)


@pytest.mark.parametrize(
    ("tree", "match"),
    [
        ({"INSTANCES_LENGTH": 9, "POSITION": {"byteOffset": 0}}, "is damaged"),
        ({"INSTANCES_LENGTH": 2, "POSITION": {"byteOffset": -1}}, "is damaged"),
        ({"POSITION": {"byteOffset": 0}}, "INSTANCES_LENGTH.* is missing"),
        ({"INSTANCES_LENGTH": 1, "POSITION": [1e308] * 3, "RTC_CENTER": [1e308] * 3}, "not finite"),
    ],
)
def test_damaged_instances_are_named(tmp_path, tree, match):
    path = tmp_path / "1.i3dm"
    path.write_bytes(i3dm(glb(), tree, PLACES))
    with pytest.raises(InputError, match=match):
        umbra.read(path)


def subtree(tiles, contents, children):
    bits = [
        np.packbits(np.array(one, bool), bitorder="little").tobytes() for one in (tiles, contents)
    ]
    views, binary = [], b""
    for one in bits:
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(one)})
        binary += one + bytes(-len(one) % 8)
    tree = {"buffers": [{"byteLength": len(binary)}], "bufferViews": views,
            "tileAvailability": {"bitstream": 0}, "contentAvailability": [{"bitstream": 1}],
            "childSubtreeAvailability": {"constant": children}}  # fmt: skip
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 8)
    return b"subt" + struct.pack("<IQQ", 1, len(text), len(binary)) + text + binary


def test_implicit_tiles_are_read_where_they_are_available(write):
    """A quadtree of two levels: the root, and of its children that at (1, 0)."""
    root = tile("{level}_{x}_{y}.glb", 8, refine="REPLACE")
    root["implicitTiling"] = {
        "subdivisionScheme": "QUADTREE", "subtreeLevels": 2, "availableLevels": 2,
        "subtrees": {"uri": "{level}.{x}.{y}.subtree"},
    }  # fmt: skip
    files = {"0.0.0.subtree": subtree([1, 0, 1, 0, 0], [1, 0, 1, 0, 0], 0), "0_0_0.glb": glb(9),
             "1_1_0.glb": glb(2), "1_0_1.glb": glb(3)}  # fmt: skip
    path = write(root, files)
    assert {part.name for part in umbra.read(path).parts} == {"1_1_0/wall"}
    assert widths(umbra.read(path, geometric_error=8)) == [9]


def test_tiles_without_end_are_refused(write, monkeypatch):
    monkeypatch.setattr("umbra.readers.budget.ITEM", 500_000)  # 100 times sooner
    root = tile("a.glb", 8)
    root["implicitTiling"] = {
        "subdivisionScheme": "OCTREE", "subtreeLevels": 10, "availableLevels": 30,
        "subtrees": {"uri": "0.subtree"},
    }  # fmt: skip
    ones = {"tileAvailability": {"constant": 1}, "contentAvailability": [{"constant": 1}],
            "childSubtreeAvailability": {"constant": 1}}  # fmt: skip
    text = json.dumps(ones).encode()
    data = b"subt" + struct.pack("<IQQ", 1, len(text), 0) + text
    with pytest.raises(InputError, match="memory"):
        umbra.read(write(root, {"0.subtree": data, "a.glb": glb()}))
    with pytest.raises(InputError, match="geometric_error"):
        umbra.read(write(root, {}), geometric_error=-1)


def test_the_cache_sees_that_a_tile_has_changed(write, tmp_path, monkeypatch):
    monkeypatch.setenv("UMBRA_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("umbra.readers.kept.LEAST", 1)
    path = write(tile("a/1.glb"), {"a/1.glb": glb(2)})
    assert widths(umbra.read(path, cache=True)) == [2]
    monkeypatch.setattr("umbra.readers._read_one", lambda *_: pytest.fail("was read again"))
    assert widths(umbra.read(path, cache=True)) == [2]
    monkeypatch.undo()
    monkeypatch.setenv("UMBRA_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("umbra.readers.kept.LEAST", 1)
    (tmp_path / "a/1.glb").write_bytes(glb(7))
    assert widths(umbra.read(path, cache=True)) == [7]
