"""Trees in files: the same answers, and nothing but the caster's own tree."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import SCENES, city, terrain

from umbra.cpu.frame import FrameCounter
from umbra.errors import InputError
from umbra.scene import Mesh, Part, make_scene
from umbra.volume import silhouette
from umbra.volume.adjacency import make_caster
from umbra.volume.dual_tree import make_dual_tree
from umbra.volume.silhouette import find_silhouettes, prepare_tree
from umbra.volume.tree_file import open_tree, read_tree, write_tree

SUN = np.array([[0.3, 0.2, 0.5, 0]])


def find(caster, method):
    ((_, found),) = find_silhouettes(caster, SUN, method)
    return np.sort(found.codes[: found.starts[1]])


@pytest.mark.parametrize("name", ["house and fence", "jumble", "one box"])
def test_a_stored_tree_answers_as_the_one_it_was(tmp_path, name):
    caster = make_caster(*SCENES[name]())
    tree = make_dual_tree(caster)
    write_tree(tmp_path / "a.npz", caster, tree)
    assert [path.name for path in tmp_path.iterdir()] == ["a.npz"]
    again = make_caster(*SCENES[name]())  # as another process would make it
    read = read_tree(tmp_path / "a.npz", again)
    np.testing.assert_array_equal(read.find(again, SUN[0]), tree.find(caster, SUN[0]))
    assert prepare_tree(again, read) is read
    np.testing.assert_array_equal(find(again, "tree"), find(again, "brute"))


def test_an_opened_caster_has_the_same_tree(tmp_path):
    caster = make_caster(*city(2))
    write_tree(tmp_path / "a.npz", caster, make_dual_tree(caster))
    opened = caster.opened(np.ones(4, bool))
    found = read_tree(tmp_path / "a.npz", opened).find(opened, SUN[0])
    np.testing.assert_array_equal(found, find(opened, "brute"))


def test_the_tree_of_another_caster_is_refused(tmp_path):
    caster = make_caster(*city(2))
    write_tree(tmp_path / "a.npz", caster, make_dual_tree(caster))
    moved = caster.planes.copy()
    moved[3, 5] += 1e-9
    for other in (make_caster(*city(2, seed=1)), replace(caster, planes=moved)):
        with pytest.raises(InputError, match="the tree of another model"):
            read_tree(tmp_path / "a.npz", other)


def test_what_is_no_tree_is_refused(tmp_path):
    caster = make_caster(*terrain(n=20))
    path = tmp_path / "a.npz"
    with pytest.raises(InputError, match="cannot read a tree"):
        read_tree(path, caster)
    path.write_bytes(b"")
    with pytest.raises(InputError, match="cannot read a tree"):
        read_tree(path, caster)
    np.savez(path, a=np.zeros(3))
    with pytest.raises(InputError, match="holds no tree"):
        read_tree(path, caster)
    np.save(tmp_path / "b.npy", np.zeros(3))
    with pytest.raises(InputError, match="no tree"):
        read_tree(tmp_path / "b.npy", caster)
    write_tree(path, caster, make_dual_tree(caster))
    whole = path.read_bytes()
    for cut in (100, len(whole) // 2, len(whole) - 10):
        path.write_bytes(whole[:cut])
        with pytest.raises(InputError, match="cannot read a tree"):
            read_tree(path, caster)
    damaged = bytearray(whole)
    damaged[len(whole) // 2] ^= 0xFF
    path.write_bytes(damaged)
    with pytest.raises(InputError, match="cannot read a tree"):
        read_tree(path, caster)
    write_tree(path, caster, make_dual_tree(caster))  # replaces it
    read_tree(path, caster)


def make_counter(seed=0):
    scene = make_scene([Part("town", "house", Mesh(*city(4, seed=seed)))])
    return FrameCounter(scene)


def test_a_scene_finds_its_tree_again(tmp_path, monkeypatch):
    path, told = tmp_path / "town.tree.npz", []
    first = open_tree(path, make_counter().caster, say=told.append)
    assert "there is no such file; built" in told[-1]
    counter = make_counter()
    monkeypatch.setattr(silhouette, "make_dual_tree", None)  # nothing can be built any more
    tree = open_tree(path, counter.caster, say=told.append)
    assert "read the tree of 288 edges" in told[-1]
    np.testing.assert_array_equal(tree.boxes, first.boxes)
    assert prepare_tree(counter.caster) is tree
    np.testing.assert_array_equal(find(counter.caster, "tree"), find(counter.caster, "brute"))


def test_a_scene_that_changed_has_its_tree_built_anew(tmp_path):
    path, told = tmp_path / "town.tree.npz", []
    open_tree(path, make_counter().caster)
    changed = make_counter(seed=1).caster
    tree = open_tree(path, changed, say=told.append)
    assert "of this one before it changed; built" in told[-1]
    np.testing.assert_array_equal(
        read_tree(path, changed).find(changed, SUN[0]), find(changed, "brute")
    )
    assert prepare_tree(changed) is tree


def test_trees_of_other_versions_are_replaced_and_other_files_are_not(tmp_path):
    path, told, caster = tmp_path / "a.npz", [], make_counter().caster
    np.savez(path, format="umbra tree 1")
    with pytest.raises(InputError, match="another version of umbra; remove the file"):
        read_tree(path, caster)
    open_tree(path, caster, say=told.append)
    assert "another version of umbra; built" in told[-1]
    read_tree(path, caster)
    np.savez(path, hours=np.zeros(3))
    before = path.read_bytes()
    with pytest.raises(InputError, match="holds no tree; name another file"):
        open_tree(path, caster)
    assert path.read_bytes() == before
    with pytest.raises(OSError, match="No such file"):
        open_tree(tmp_path / "nowhere" / "a.npz", caster)
