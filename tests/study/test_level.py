"""The ground that no one names: where things stand, and what is said of it."""

import numpy as np
import pytest
from support.model_files import DATA
from support.shapes import box, sheet

import umbra
from umbra.ground.level import has_terrain, measure_bases, settle_level
from umbra.receivers import find_kind
from umbra.scene import Mesh, Part, make_scene

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-03-21", "every": "2h", "cell": 1.0}


def houses(feet, size=8):
    return [
        Part(f"house {k}", "", Mesh(*box((20 * k, 0, z), (20 * k + size, 9, z + 6))))
        for k, z in enumerate(feet)
    ]


def lay(name, kind, corners):
    return Part(name, kind, Mesh(*sheet(corners)))


def find_level(scene):
    return settle_level(measure_bases(scene))


def test_the_ground_of_a_hill_is_where_the_middle_house_stands():
    level = find_level(make_scene(houses([100, 104, 109, 115, 121])))
    assert (level.middle, level.low, level.high, level.things) == (109, 100, 121, 5)


def test_a_large_house_weighs_more():
    parts = [*houses([10, 11, 12]), Part("hall", "", Mesh(*box((0, 50, 3), (90, 90, 20))))]
    assert find_level(make_scene(parts)).middle == 3


@pytest.mark.parametrize("is_own", [True, False])
def test_one_bad_polygon_far_below_moves_nothing(is_own):
    bad = lay(
        "bad" if is_own else "house 0", "", [(10, 1, -15), (11, 1, -15), (11, 2, -15), (10, 2, -15)]
    )
    parts = houses([0, 0, 0.5, 1])
    level = find_level(make_scene([*parts, bad]))
    assert level == find_level(make_scene(parts))
    assert level.low == 0
    study = umbra.shadow_study(make_scene([*parts, bad]), VIENNA, **DAY, receivers="top")
    assert study.attrs["ground_z"] == 0


def test_a_round_thing_stands_on_its_lowest_point():
    # No gap, no mistake: few triangles of a cone's tip lie low.
    tip, rim = [(0, 0, 0)], [(np.cos(a), np.sin(a), 40) for a in np.arange(60) * np.pi / 30]
    faces = [(0, 1 + k, 1 + (k + 1) % 60) for k in range(60)]
    scene = make_scene(np.array(tip + rim), np.array(faces))
    assert find_level(scene).middle == 0


def test_ground_surfaces_tell_better_than_walls():
    floor = lay("house 0", "GroundSurface", [(0, 0, 2), (8, 0, 2), (8, 9, 2), (0, 9, 2)])
    level = find_level(make_scene([*houses([0]), floor]))
    assert level.middle == 2


def test_what_stands_on_another_thing_is_not_asked():
    made = houses([0])
    for floor in range(1, 12):
        made.append(Part(f"f{floor}", "", Mesh(*box((0, 0, 6 * floor), (8, 9, 6 * floor + 6)))))
        made.append(Part(f"b{floor}", "", Mesh(*box((8, 3, 6 * floor), (9, 5, 6 * floor + 1)))))
    level = find_level(make_scene(made))
    assert (level.middle, level.high) == (0, 0)


def garden(r=40.0):
    return lay("garden", "LandUse", [(-r, -r, 1), (r, -r, 3), (r, r, 3), (-r, r, 1)])


@pytest.mark.parametrize(
    ("more", "receivers"), [([], "ground"), ([garden()], "top"), ([garden(2.0)], "ground")]
)
def test_receivers_are_what_the_model_is(more, receivers):
    scene = make_scene([*houses([2, 2]), *more])
    assert find_kind("auto", scene).name == receivers
    assert find_kind("auto", scene, 2.0).name == "ground"
    study = umbra.shadow_study(scene, VIENNA, **DAY)
    assert study.attrs["receivers"] == receivers


def test_beside_its_own_ground_nothing_receives():
    scene = make_scene([*houses([2]), garden()])
    extent = (-50, -50, 50, 50)
    study = umbra.shadow_study(scene, VIENNA, **DAY, extent=extent)
    outside = (abs(study.x) > 40) | (abs(study.y) > 40)
    assert np.isnan(study.shadow_hours.where(outside, 0)).sum() == outside.sum() > 0
    assert np.isfinite(study.shadow_hours.where(~outside, 0)).all()
    given = umbra.shadow_study(scene, VIENNA, **DAY, extent=extent, receivers="top", ground=0)
    assert np.isfinite(given.shadow_hours).all()


def test_a_plane_under_a_ground_of_its_own_is_told():
    scene = make_scene([*houses([2]), garden()])
    told = umbra.shadow_study(scene, VIENNA, **DAY, receivers="ground").attrs["assumption"]
    assert "brings ground of its own" in told
    assert "receivers='top'" in told
    assert "assumption" not in umbra.shadow_study(scene, VIENNA, **DAY).attrs


@pytest.mark.parametrize(
    ("name", "receivers", "is_hilly"),
    [
        ("zurich_lod2.city.json", "ground", True),
        ("vienna_lod2.city.jsonl", "ground", True),
        ("delft.city.json", "top", False),
        ("urban_block.obj", "ground", False),
        ("fzk_haus.ifc", "ground", False),
    ],
)
def test_real_models_choose_and_tell(name, receivers, is_hilly):
    if not (DATA / name).exists():
        pytest.skip(f"the real model {name} is not in ../shared/data")
    scene = umbra.read(DATA / name)
    assert find_kind("auto", scene).name == receivers
    if receivers == "ground" and scene.ground is None:
        level = find_level(scene)
        assert (level.high - level.low > 3) == is_hilly
        assert scene.bounds()[0, 2] - 0.01 <= level.low <= level.middle <= level.high
    assert has_terrain(scene) == (receivers == "top" or scene.ground is not None)
