"""Things that stand high above the ground that a study takes."""

from pathlib import Path

import pytest
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene
from umbra.study.floating import Floating, find_floating

DATA = Path(__file__).parents[2] / "../shared/data"


def houses(feet):
    return [
        Part(f"house {k}", "", Mesh(*box((20 * k, 0, z), (20 * k + 8, 9, z + 6))))
        for k, z in enumerate(feet)
    ]


def test_houses_on_a_slope_float_and_on_a_plain_do_not():
    slope = make_scene(houses([100, 104, 109, 115, 121]))
    assert find_floating(slope, 100.0) == Floating(4, 5, 109.0)
    assert find_floating(slope, 110.0) is None
    assert find_floating(make_scene(houses([100, 101, 102, 103, 130])), 100.0) is None


def test_what_stands_on_another_thing_does_not_float():
    made = houses([0])
    for floor in range(1, 12):
        made.append(
            Part(f"floor {floor}", "", Mesh(*box((0, 0, 6 * floor), (8, 9, 6 * floor + 6))))
        )
        made.append(
            Part(f"balcony {floor}", "", Mesh(*box((8, 3, 6 * floor), (9, 5, 6 * floor + 1))))
        )
    assert find_floating(make_scene(made), 0.0) is None


@pytest.mark.parametrize(
    ("name", "is_told"),
    [
        ("zurich_lod2.city.json", True),
        ("vienna_lod2.city.jsonl", True),
        ("delft.city.json", False),
        ("urban_block.obj", False),
    ],
)
def test_a_city_on_a_hill_is_told_and_one_on_a_plain_is_not(name, is_told):
    if not (DATA / name).exists():
        pytest.skip(f"the real model {name} is not in ../shared/data")
    scene = umbra.read(DATA / name)
    found = find_floating(scene, float(scene.bounds()[0, 2]))
    assert (found is not None) == is_told
    if found is not None:
        assert found.count > 0.8 * found.of
