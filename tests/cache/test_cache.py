"""A scene from the cache is the scene that was read, or it is read again."""

import os
import time
from dataclasses import fields
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.gltf_files import Document
from support.model_files import save_city, save_glb, save_obj
from support.shapes import box, moved

import umbra
from umbra import cache as cache_folder
from umbra import readers
from umbra.cache import _PLACE, _WIDTHS, _sum, keep_scene, load_scene, measure_cache
from umbra.calls.doctor import examine
from umbra.errors import InputError
from umbra.readers import kept as readers_cache
from umbra.scene import Material, Mesh, Part, Scene, Source, make_scene

HOUSES = {f"house {n}": moved(box((0, 0, 0), (4, 4, 9 + n)), (9 * n, 0, 0)) for n in range(5)}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A cache of the test's own, for files of any size."""
    path = tmp_path / "cache"
    monkeypatch.setenv("UMBRA_CACHE", str(path))
    monkeypatch.setattr(readers_cache, "LEAST", 1)
    return path


@pytest.fixture
def reads(monkeypatch):
    """Count the files that are parsed."""
    counted = SimpleNamespace(files=[])
    read_one = readers._read_one

    def count(content, *rest):
        counted.files.append(content.path.name)
        return read_one(content, *rest)

    monkeypatch.setattr(readers, "_read_one", count)
    return counted


def check_same(one, two):
    for name in ("crs", "site_doubt", "sources", "notes", "lights", *_PLACE):
        assert getattr(one, name) == getattr(two, name), name
    np.testing.assert_array_equal(one.origin, two.origin)
    for a, b in zip(one.parts, two.parts, strict=True):
        assert (a.name, a.kind, a.layer, a.tags) == (b.name, b.kind, b.layer, b.tags)
        assert (a.transform is None) == (b.transform is None)
        if a.transform is not None:
            np.testing.assert_array_equal(a.transform, b.transform)
        for field in fields(Material):
            assert getattr(a.material, field.name) == getattr(b.material, field.name)
        for name in _WIDTHS:
            x, y = getattr(a.mesh, name), getattr(b.mesh, name)
            assert (x is None) == (y is None), name
            if x is not None:
                assert x.dtype == y.dtype
                np.testing.assert_array_equal(x, y)
    x, y = one.triangles(), two.triangles()
    for name in ("vertices", "faces", "part"):
        np.testing.assert_array_equal(getattr(x, name), getattr(y, name))


def test_nothing_of_a_scene_is_forgotten():
    """A field that is new must be kept, too: teach `umbra.cache` and add it here."""
    names = {"parts", "origin", "crs", "site_doubt", "sources", "notes", "lights", *_PLACE}
    # No reader replaces parts; a study leaves them out of what was read.
    assert {field.name for field in fields(Scene)} == names | {"replaced"}
    names = {"name", "kind", "mesh", "transform", "material", "binding", "layer", "tags"}
    assert {field.name for field in fields(Part)} == names
    assert {field.name for field in fields(Mesh)} == set(_WIDTHS)
    names = {"name", "sha256", "format", "is_companion", "path", "layer", "frame", "ground"}
    names.add("moved")
    assert {field.name for field in fields(Source)} == names
    assert all(
        isinstance(getattr(Material(), field.name), (str, bool, float, tuple, type(None)))
        for field in fields(Material)
    )


def test_a_scene_comes_back_as_it_was():
    rng = np.random.default_rng(7)
    vertices, faces = box((0, 0, 0), (4, 4, 9))
    n = len(vertices)
    widths = (3, 2, 3, 4)  # of normals, uv, colours and tangents
    full = Mesh(vertices, faces, *(rng.normal(size=(n, width)) for width in widths))
    turn = np.eye(4)
    turn[:3, 3] = 1 / 3, 20, 0
    red = Material((0.9, 0.1, 1 / 3), opacity=0.3, emission=(0, 2.5, 0), alpha_mode="blend")
    parts = [
        Part("one", "wall", full, material=red, layer="existing", tags=("brick", "größer")),
        Part("two", "wall", full, transform=turn, material=red),
        Part("three", "", full.moved(vertices + 30.1)),
    ]
    facts = {"latitude": 48.1, "longitude": 1 / 3, "elevation": 170.5, "ground": -0.0}
    facts["is_ellipsoidal"] = True
    scene = make_scene(
        parts,
        crs="EPSG:31256",
        notes=("a note",),
        sources=(Source("a", "b", "OBJ", True),),
        **facts,
    )
    keep_scene("key", scene)
    again = load_scene("key")
    check_same(scene, again)
    assert again.parts[0].mesh is again.parts[1].mesh
    assert again.parts[0].material is again.parts[1].material
    assert again.parts[0].mesh.faces is again.parts[2].mesh.faces
    assert load_scene("other") is None


@pytest.mark.parametrize("save", [save_city, save_obj])
def test_files_are_read_once(tmp_path, reads, save):
    path = save(tmp_path / f"town.{'obj' if save is save_obj else 'city.json'}", HOUSES)
    first = umbra.read(path, cache=True)
    second = umbra.read(path, cache=True)
    assert reads.files == [path.name]
    check_same(first, second)
    check_same(first, umbra.read(path))
    assert reads.files == [path.name] * 2


def test_what_changes_is_read_again(tmp_path, reads):
    path = save_obj(tmp_path / "town.obj", HOUSES)
    shed = save_obj(tmp_path / "shed.obj", {"shed": box((0, 0, 0), (1, 1, 1))})
    ways = [
        {"paths": [path]},
        {"paths": [path], "up": "y"},
        {"paths": [path, shed]},
        {"paths": [shed, path]},
        {"paths": [f"proposed={path}", shed]},
    ]
    scenes = [umbra.read(*way.pop("paths"), **way, cache=True) for way in [dict(w) for w in ways]]
    assert len(reads.files) == 8
    for way, scene in zip(ways, scenes, strict=True):
        check_same(scene, umbra.read(*way.pop("paths"), **way, cache=True))
    assert len(reads.files) == 8

    # As long as before and as old as before, but another file.
    status, data = path.stat(), path.read_bytes()
    path.write_bytes(data.replace(b"v 4", b"v 5", 1))
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert path.stat().st_size == status.st_size
    changed = umbra.read(path, cache=True)
    assert len(reads.files) == 9
    assert changed.sources[0].sha256 != scenes[0].sources[0].sha256


def test_material_libraries_are_part_of_the_key(tmp_path, reads):
    path = save_obj(tmp_path / "town.obj", HOUSES)
    path.write_bytes(b"mtllib town.mtl\nusemtl red\n" + path.read_bytes())
    colors = []
    for text in (None, "newmtl red\nKd 1 0 0\n", "newmtl red\nKd 0.5 0 0\n"):
        if text:
            (tmp_path / "town.mtl").write_text(text)
        colors.append([umbra.read(path, cache=True).parts[0].color[0] for _ in range(2)])
    assert len(reads.files) == 3
    assert [pair[0] == pair[1] for pair in colors] == [True] * 3
    assert [pair[0] for pair in colors[1:]] == [1.0, 0.5]
    (tmp_path / "town.mtl").write_text("newmtl red\nmap_Kd brick.png\n")
    for _ in range(2):
        scene = umbra.read(path, cache=True)
    assert len(reads.files) == 4
    assert scene.notes == ("town.obj: missing textures left out: 1",)
    (tmp_path / "brick.png").write_bytes(b"there now")
    umbra.read(path, cache=True)
    assert len(reads.files) == 5


def test_buffers_beside_a_file_count(tmp_path, reads):
    """The file itself is the same to the byte; a folder of the same name is another place."""
    vertices, faces = box((0, 0, 0), (4, 4, 9))
    heights = []
    for height, folder in ((9, "a"), (12, "a"), (None, "a"), (7, "a"), (8, "b")):
        (tmp_path / folder).mkdir(exist_ok=True)
        beside = tmp_path / folder / "town.bin"
        beside.unlink(missing_ok=True)
        document = Document()
        corners = (vertices * (1, 1, (height or 9) / 9)).astype("f4")
        attributes = {"POSITION": document.accessor(corners)}
        indices = document.accessor(faces.ravel().astype("u4"))
        document.node(mesh=document.mesh({"attributes": attributes, "indices": indices}))
        text, data = document.gltf("town.bin"), document.bytes
        path = tmp_path / folder / "town.json"
        path.write_text(text)
        if height is None:
            with pytest.raises(InputError, match=r"town\.bin"):
                umbra.read(path, cache=True, up="z")
            continue
        beside.write_bytes(data)
        found = [umbra.read(path, cache=True, up="z") for _ in range(2)]
        check_same(*found)
        heights.append(float(np.ptp(found[1].bounds()[:, 2])))
        assert found[1].sources[1].sha256 == sha256(data).hexdigest()
    assert heights == [9, 12, 7, 8]
    assert reads.files == ["town.json"] * 5


def test_another_version_of_the_readers_reads_again(tmp_path, reads, monkeypatch):
    path = save_obj(tmp_path / "town.obj", HOUSES)
    umbra.read(path, cache=True)
    monkeypatch.setattr("importlib.metadata.version", lambda _: "99.0")
    umbra.read(path, cache=True)
    assert len(reads.files) == 2


def test_what_reads_quickly_is_not_kept(tmp_path, folder, monkeypatch):
    umbra.read(save_glb(tmp_path / "town.glb", HOUSES), cache=True)
    monkeypatch.setattr(readers_cache, "LEAST", 200_000)
    umbra.read(save_obj(tmp_path / "town.obj", HOUSES), cache=True)
    assert not folder.exists()


def flip(data, at):
    return data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :]


@pytest.mark.parametrize(
    "damage",
    [
        lambda _: b"",
        lambda data: data[: len(data) // 2],
        lambda data: data[:-1],
        lambda data: b"\x93NUMPY" + data[6:],
        lambda data: flip(data, len(data) // 2),
        lambda data: flip(data, len(data) // 3),
    ],
)
def test_damage_is_read_around_and_mended(tmp_path, folder, reads, damage):
    path = save_obj(tmp_path / "town.obj", HOUSES)
    scene = umbra.read(path, cache=True)
    (file,) = folder.iterdir()
    whole = file.read_bytes()
    file.write_bytes(damage(whole))
    check_same(scene, umbra.read(path, cache=True))
    assert len(reads.files) == 2
    check_same(scene, umbra.read(path, cache=True))
    assert len(reads.files) == 2


class Trap:
    """A pickle that makes a folder where it is read."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def test_arrays_that_make_no_scene_are_read_around(tmp_path, folder, reads):
    path = save_obj(tmp_path / "town.obj", HOUSES)
    scene = umbra.read(path, cache=True)
    (file,) = folder.iterdir()
    with np.load(file) as found:
        arrays = dict(found)
    pickled = {**arrays, "faces": np.array([Trap(tmp_path / "sprung")], object)}
    wrong = {**arrays, "faces": arrays["faces"] + 1000}
    moved_a_little = {**arrays, "vertices": arrays["vertices"] + 1e-3}
    bad = [pickled, wrong, moved_a_little, {"words": arrays["words"]}]
    # As from a hand that knows the sum: no number may count beyond its array.
    bad += [
        summed({**arrays, name: change(arrays[name].copy())})
        for name, change in (
            ("faces", lambda a: a - 1),
            ("faces", lambda a: a + 1000),
            ("parts", lambda a: a - 2),
            ("parts", lambda a: a + [0, 0, 1]),
            ("parts", lambda a: a + [0, 100, 0]),
            ("meshes", lambda a: a - 1),
            ("meshes", lambda a: a + [0, 0, 0, 1, 0, 0, 0, 0]),
            ("vertices_length", lambda a: a * [2, 0, *[1] * (len(a) - 2)]),
            ("vertices_length", lambda a: a * -1),
            ("vertices", lambda a: a * np.nan),
            ("vertices", lambda a: a.astype(np.float32)),
            ("origin", lambda a: a[:2]),
            ("parts", lambda a: a[:, :2]),
            ("faces", lambda a: a[:, :2]),
        )
    ]
    for number, one in enumerate(bad, 2):
        np.savez(file, **one)
        check_same(scene, umbra.read(path, cache=True))
        assert len(reads.files) == number, f"served as scene {number - 2}"
    assert not (tmp_path / "sprung").exists()


def summed(arrays):
    arrays.pop("sum")
    return {**arrays, "sum": _sum(arrays)}


def test_the_oldest_go_first(folder, monkeypatch):
    for number in range(4):
        cache_folder.keep(str(number), {"a": np.zeros(1000)})
        os.utime(folder / f"{number}.npz", (number, number))
    assert measure_cache()[0] == 4
    assert cache_folder.load("0") is not None  # now it is the youngest
    monkeypatch.setattr(cache_folder, "LIMIT", 2.5 * measure_cache()[1] // 4)
    cache_folder.keep("4", {"a": np.zeros(10)})
    assert sorted(path.stem for path in folder.iterdir()) == ["0", "3", "4"]
    monkeypatch.setattr(cache_folder, "LIMIT", 10_000)
    cache_folder.keep("5", {"a": np.zeros(1000)})
    assert "5" not in {path.stem for path in folder.iterdir()}


def test_killed_runs_are_swept_up_and_live_ones_left(folder):
    folder.mkdir()
    for name, age in (("old", 7200), ("new", 10)):
        (folder / f"{name}.unfinished").write_bytes(b"half")
        os.utime(folder / f"{name}.unfinished", (time.time() - age,) * 2)
    cache_folder.keep("a", {"a": np.zeros(10)})
    assert sorted(path.name for path in folder.iterdir()) == ["a.npz", "new.unfinished"]


def test_without_room_nothing_is_kept(folder, monkeypatch):
    monkeypatch.setattr(
        cache_folder.shutil, "disk_usage", lambda _: SimpleNamespace(free=cache_folder.LIMIT)
    )
    cache_folder.keep("a", {"a": np.zeros(10)})
    assert not list(folder.iterdir())


def test_a_folder_that_cannot_be_is_no_cache(tmp_path, reads, monkeypatch):
    path = save_obj(tmp_path / "town.obj", HOUSES)
    monkeypatch.setenv("UMBRA_CACHE", str(path / "deeper"))
    scene = umbra.read(path, cache=True)
    check_same(scene, umbra.read(path, cache=True))
    assert len(reads.files) == 2
    assert measure_cache() == (0, 0)


def test_a_user_without_a_home_has_no_cache(tmp_path, monkeypatch):
    monkeypatch.setattr(cache_folder, "find_folder", lambda: Path("~/.cache/umbra"))
    monkeypatch.chdir(tmp_path)
    cache_folder.keep("a", {"a": np.zeros(10)})
    assert not list(tmp_path.iterdir())


def test_an_interrupt_leaves_no_half_file(folder, monkeypatch):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez", stop)
    with pytest.raises(KeyboardInterrupt):
        cache_folder.keep("a", {"a": np.zeros(10)})
    assert not list(folder.iterdir())


def test_the_users_folder_is_the_default(monkeypatch):
    monkeypatch.delenv("UMBRA_CACHE")
    assert cache_folder.find_folder().name.lower() in {"umbra", "cache"}
    assert Path.home() in cache_folder.find_folder().parents


@pytest.mark.skipif(os.name != "posix", reason="Windows keeps each user's folder in their profile")
@pytest.mark.parametrize("mode", [0o770, 0o702, 0o777, 0o1777])
def test_a_folder_that_others_may_write_to_is_not_used(tmp_path, folder, reads, mode):
    path = save_city(tmp_path / "town.city.json", HOUSES)
    plain = umbra.read(path, cache=True)
    umbra.read(path, cache=True)
    assert reads.files == ["town.city.json"]
    folder.chmod(mode)
    assert measure_cache()[0] == 1
    check_same(umbra.read(path, cache=True), plain)
    umbra.read(save_city(tmp_path / "other.city.json", {"one": HOUSES["house 1"]}), cache=True)
    assert reads.files == ["town.city.json", "town.city.json", "other.city.json"]
    assert measure_cache()[0] == 1
    folder.chmod(0o755)
    umbra.read(path, cache=True)
    assert len(reads.files) == 3


@pytest.mark.skipif(os.name != "posix", reason="Windows keeps each user's folder in their profile")
def test_another_users_folder_is_not_used_and_doctor_says_so(tmp_path, folder, reads, monkeypatch):
    path = save_city(tmp_path / "town.city.json", HOUSES)
    umbra.read(path, cache=True)
    owner = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
    umbra.read(path, cache=True)
    umbra.read(path, cache=True)
    assert reads.files == ["town.city.json"] * 3
    monkeypatch.setattr("umbra.calls.doctor.probe", lambda _: {"reason": "not asked"})
    assert any(str(folder) in one and "another user" in one for one in examine()["advice"])
    monkeypatch.undo()


def test_a_link_to_a_folder_that_others_may_write_to_is_not_used(tmp_path, folder, reads):
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    folder.symlink_to(tmp_path / "open")
    path = save_city(tmp_path / "town.city.json", HOUSES)
    umbra.read(path, cache=True)
    umbra.read(path, cache=True)
    assert reads.files == ["town.city.json"] * 2
    assert list((tmp_path / "open").iterdir()) == []
