"""Small files that ask for much memory or time: refused in one line, or read, within limits."""

import sys

import numpy as np
import pytest
from fuzz.bombs import BOMBS, MOST_MEMORY, are_there, read_alone, save_view
from support.model_files import save_obj
from support.shapes import box

import umbra
from umbra import InputError
from umbra.readers.budget import Budget

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="limits are those of Linux")


@on_linux
@pytest.mark.parametrize("what", BOMBS)
def test_a_bomb_takes_little_and_is_refused_in_one_line(what, tmp_path):
    make, packages, word = BOMBS[what]
    if not are_there(packages):
        pytest.skip(f"{packages[0]} is not installed")
    assert read_alone(make(tmp_path)).find_fault(word) == ""


def test_a_view_is_refused_and_not_run(tmp_path):
    pytest.importorskip("pyogrio")
    view = "CREATE VIEW towers AS SELECT fid, geom, height FROM houses"
    with pytest.raises(InputError) as caught:
        umbra.read(save_view(tmp_path / "plain.gpkg", view))
    assert caught.value.views == ["towers"]


@pytest.mark.parametrize("name", ["words", "shapes"])
def test_more_memory_is_a_choice(tmp_path, name):
    pytest.importorskip("pyarrow")
    pytest.importorskip("shapely")
    make, *_ = BOMBS[
        "a dictionary of one text" if name == "words" else "a dictionary of one polygon"
    ]
    with pytest.raises(InputError) as caught:
        umbra.read(make(tmp_path), max_memory=2)
    assert caught.value.option == "max_memory"
    assert caught.value.limit == 2e9


@pytest.mark.parametrize("most", [0, -1, float("nan")])
def test_memory_that_is_none_is_refused(tmp_path, most):
    with pytest.raises(InputError) as caught:
        umbra.read(tmp_path, max_memory=most)
    assert caught.value.option == "max_memory"


def test_a_file_grows_the_budget_once():
    budget = Budget()
    for _ in range(9):
        budget.grow("town.glb", 10_000_000)
    assert budget.size == 10_000_000
    before = budget.limit
    budget.grow("land.tif", 5_000_000)
    assert budget.limit > before


def test_all_files_of_a_reading_have_one_budget():
    budget = Budget(1000.0)
    budget.spend(600, "one")
    with pytest.raises(InputError) as caught:
        budget.spend(600, "another")
    assert (caught.value.needed, caught.value.limit) == (1200, 1000)


@on_linux
def test_what_a_bomb_takes_is_not_what_its_tests_took(tmp_path):
    np.ones(int(MOST_MEMORY) // 8 + 10_000_000)  # this process reaches more, for a moment
    house = save_obj(tmp_path / "house.obj", {"house": box((0, 0, 0), (3, 3, 3))})
    assert read_alone(house).find_fault("") == ""
