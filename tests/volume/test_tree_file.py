"""Trees in files: the same answers, and nothing but the caster's own tree."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import SCENES, city, terrain

from umbra.errors import InputError
from umbra.volume.adjacency import make_caster
from umbra.volume.dual_tree import make_dual_tree
from umbra.volume.hextree import make_hextree
from umbra.volume.silhouette import find_silhouettes, prepare_tree
from umbra.volume.tree_file import read_tree, write_tree

MAKERS = {"tree": make_dual_tree, "hextree": make_hextree}
SUN = np.array([[0.3, 0.2, 0.5, 0]])


def find(caster, method):
    ((_, found),) = find_silhouettes(caster, SUN, method)
    return np.sort(found.codes[: found.starts[1]])


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("name", ["house and fence", "jumble", "one box"])
def test_a_stored_tree_answers_as_the_one_it_was(tmp_path, name, kind):
    caster = make_caster(*SCENES[name]())
    tree = MAKERS[kind](caster)
    write_tree(tmp_path / "a.npz", caster, tree)
    assert [path.name for path in tmp_path.iterdir()] == ["a.npz"]
    again = make_caster(*SCENES[name]())  # as another process would make it
    read = read_tree(tmp_path / "a.npz", again)
    assert type(read) is type(tree)
    np.testing.assert_array_equal(read.find(again, SUN[0]), tree.find(caster, SUN[0]))
    assert prepare_tree(again, kind, read) is read
    np.testing.assert_array_equal(find(again, kind), find(again, "brute"))


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
    with pytest.raises(InputError, match="holds no tree of this version"):
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
