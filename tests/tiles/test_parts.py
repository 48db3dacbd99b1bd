"""Reach, units, lattices and neighbourhoods, each alone."""

import numpy as np
import pytest
from support.cities import DAY, FACES, make_houses, write_city

import umbra
from umbra.scene.grid import Grid
from umbra.tiles.city_catalogue import make_catalogue
from umbra.tiles.city_lattice import Lattice, find_side
from umbra.tiles.city_options import CityOptions
from umbra.tiles.file_geometry import find_units
from umbra.tiles.neighbourhood import find_reaching
from umbra.tiles.surface_results import turn_outward


def test_reach_is_that_of_every_pair_of_points():
    rng = np.random.default_rng(2)
    suns = rng.normal(size=(7, 3))
    suns[:, 2] = np.abs(suns[:, 2]) * 0.2 + 0.01
    suns /= np.linalg.norm(suns, axis=1)[:, None]
    target = np.array([[0.0, 0, 0], [10, 10, 5]])
    low = rng.uniform((-200, -200, -10), (200, 200, 30), (4000, 3))
    boxes = np.stack([low, low + rng.uniform(1, 10, (4000, 3))], axis=1)
    found = find_reaching(boxes, target, suns)
    # Casters at a height h above a receiver are h / sun_z times the sun away from it.
    hit = np.zeros(len(boxes), bool)
    for sun in suns:
        steps = np.linspace(0, 300, 3001)[:, None] * sun / np.hypot(*sun[:2])
        for k, box in enumerate(boxes):
            inside = (box[1] - steps >= target[0]).all(1) & (box[0] - steps <= target[1]).all(1)
            hit[k] |= inside.any()
    assert 100 < hit.sum() < 1000
    assert not (hit & ~found).any()
    assert (found & ~hit).sum() < 40  # between two steps


def test_a_tower_casts_a_shadow_as_far_as_it_reaches(tmp_path):
    """At half a degree of altitude 100 m of tower cast 11 km of shadow."""
    tower = ("tower", 85000.0, 447000.0, 0.0, 30.0, 30.0, 100.0, 0.0)
    lone = ("lone", 96000.0, 447010.0, 0.0, 5.0, 5.0, 5.0, 0.0)
    files = [
        write_city(tmp_path / "a.city.json", [tower]),
        write_city(tmp_path / "b.city.json", [lone]),
    ]
    site = umbra.Site(0.0, 0.0, "UTC")
    options = {
        "date": "2026-03-20", "start": "18:00", "end": "18:30", "every": "1min", "ground": 0.0,
        "refraction": "none", "receivers": "ground", "cell": 5.0,
        "extent": (95000, 446900, 95600, 447150),
    }  # fmt: skip
    far = umbra.city_study(files, site, out=tmp_path / "far", tiles=100, **options).dataset.load()
    scene = umbra.read(*files)
    whole = umbra.shadow_study(scene, site, **options).dataset
    np.testing.assert_array_equal(far.shadow_hours, whole.shadow_hours)
    assert 0 < float((whole.shadow_hours > 0).mean()) < 1
    cut = umbra.city_study(
        files, site, out=tmp_path / "cut", tiles=100, min_altitude=1.0, **options
    )
    assert cut.facts["min_altitude_deg"] == 1.0
    assert cut.dataset.attrs["min_altitude_deg"] == 1.0
    assert not cut.dataset.shadow_hours.values.any()
    assert float(cut.dataset.sun_hours.max()) < float(far.sun_hours.max())


def test_units_keep_closed_components_whole_and_cut_open_ones():
    cube = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float)
    triangles = np.array([[f[0], f[i], f[i + 1]] for f in FACES for i in (1, 2)])
    side = 80
    x, y = np.meshgrid(np.arange(side + 1.0), np.arange(side + 1.0))
    land = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    sheet = np.concatenate(
        [np.stack([corner, corner + 1, corner + side + 2], 1),
         np.stack([corner, corner + side + 2, corner + side + 1], 1)]
    )  # fmt: skip
    vertices = np.concatenate([cube + (200, 0, 0), land, cube + (300, 0, 0)])
    faces = np.concatenate([triangles, sheet + 8, triangles + 8 + len(land)]).astype(np.int32)
    group = np.repeat([0, 1], [12 + len(sheet), 12]).astype(np.int32)
    unit = find_units(vertices, faces, group)
    assert len(set(unit[:12])) == 1
    assert len(set(unit[-12:])) == 1
    assert len(set(unit)) == 2 + -(-len(sheet) // 1024)
    assert not set(unit[:12]) & set(unit[12:])


@pytest.mark.parametrize(("side", "block"), [(7, 10), (3, 4), (100, 16)])
def test_windows_cover_each_cell_once_and_cross_no_block(side, block):
    lattice = Lattice(Grid(0.5, 0.5, 1.0, 1.0, 33, 21), side, block)
    seen = np.zeros((21, 33), int)
    tiles = list(lattice.tiles())
    assert [tile.number for tile in tiles] == list(range(len(lattice)))
    for tile in tiles:
        for rows, cols in lattice.cut(tile, 5):
            seen[rows, cols] += 1
            assert rows.start // block == (rows.stop - 1) // block
            assert max(rows.stop - rows.start, cols.stop - cols.start) <= 5
            grid = lattice.find_window(rows, cols)
            # Numbered from the corner of the block, which no tile moves.
            assert (grid.row, grid.col) == (rows.start % block, cols.start % block)
            assert grid.x0 == lattice.grid.x[cols.start // block * block]
            assert np.array_equal(grid.x, lattice.grid.x[cols])
    assert (seen == 1).all()


def test_tiles_are_cut_to_equal_parts_that_fit_in_a_chunk():
    assert find_side(1000.0, 1.0) == 1000
    assert find_side(5000.0, 1.0) == 1667
    assert find_side(0.1, 1.0) == 1


def test_each_object_is_wound_outward_as_if_it_stood_alone():
    cube = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float)
    out = np.array([[f[0], f[i], f[i + 1]] for f in FACES for i in (1, 2)], np.int32)
    vertices = np.concatenate([cube, cube + (1, 0, 0)])  # they share a wall
    faces = np.concatenate([out, out[:, ::-1] + 8]).astype(np.int32)
    turned = turn_outward(vertices, faces, np.repeat([0, 1], 12).astype(np.int32))
    assert np.array_equal(turned, np.concatenate([out, out + 8]))


def test_files_in_other_systems_are_named(tmp_path):
    one = write_city(
        tmp_path / "one.city.json", make_houses(1, 2, (85000, 447000), (85050, 447050))
    )
    two = write_city(
        tmp_path / "two.city.json", make_houses(2, 2, (85000, 447000), (85050, 447050)), crs=31256
    )
    with pytest.raises(umbra.InputError, match=r"one.city.json is in .* but .*two.city.json is in"):
        make_catalogue([one, two], tmp_path / "catalogue")


def test_folders_and_patterns_name_files(tmp_path):
    houses = make_houses(1, 2, (85000, 447000), (85050, 447050))
    folder = tmp_path / "city"
    folder.mkdir()
    for name in ("b", "a"):
        write_city(folder / f"{name}.city.json", houses)
    (folder / "notes.txt").write_text("not a model")
    found = make_catalogue([folder], tmp_path / "catalogue")
    assert [one.layer for one in found.files] == ["a", "b"]
    again = make_catalogue([str(folder / "*.json")], tmp_path / "catalogue")
    assert again == found
    with pytest.raises(umbra.InputError, match="no file has such a name"):
        make_catalogue([str(folder / "*.gml")], tmp_path / "catalogue")
    (tmp_path / "empty").mkdir()
    with pytest.raises(umbra.InputError, match="the folder holds no model"):
        make_catalogue([tmp_path / "empty"], tmp_path / "catalogue")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"tiles": "1 mile"}, r"tiles= is a length, such as '1km'"),
        ({"tiles": 0}, "tiles= is a length"),
        ({"tiles": "1km", "memory": "much"}, "memory= is a size"),
        ({"tiles": "1km", "memory": "10MB"}, "is too little"),
        ({"tiles": "1km", "memory": "900TB"}, "more than there is"),
        ({"tiles": "1km", "min_altitude": 95}, "angle of 0 to 90"),
        ({"memory": "4GB"}, "memory= is for a study in tiles"),
    ],
)
def test_wrong_options_are_named(given, words):
    with pytest.raises(umbra.InputError, match=words):
        CityOptions(**given)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"receivers": "north"}, "are not counted in tiles"),
        ({"proposed": "no*"}, "proposed='no\\*' matches no part of 3 files"),
        (
            {"masks": True, "every": "10s", "tiles": "2km", "cell": 0.5, "memory": "1GB"},
            "a cell, and",
        ),
        ({"cast": "tree*"}, "cast='tree\\*' matches no part of 3 files"),
        ({"no_cast": "*"}, "no part is left to cast"),
        ({"ground": float("nan")}, "must be a finite number"),
    ],
)
def test_what_is_not_counted_in_tiles_is_named(city, tmp_path, more, words):
    with pytest.raises(umbra.InputError, match=words):
        umbra.city_study(city, out=tmp_path, **{**DAY, **more})


def test_a_city_without_sun_or_casters_is_counted(city, tmp_path):
    night = {**DAY, "start": "22:00", "end": "23:00", "receivers": "ground", "cell": 20.0}
    found = umbra.city_study(city, out=tmp_path / "night", tiles=200, **night).dataset
    assert not found.shadow_hours.values.any()
    assert not found.sun_hours.values.any()
    options = {**DAY, "receivers": "top", "cell": 2.0, "no_cast": "west*"}
    far = (85000, 447000, 85060, 447060)
    bare = umbra.city_study(
        city[:1], out=tmp_path / "bare", tiles=30, **{**options, "extent": far}
    ).dataset
    scene = umbra.read(city[0])
    whole = umbra.shadow_study(scene, umbra.find_site(scene), **{**options, "extent": far}).dataset
    np.testing.assert_array_equal(bare.shadow_hours, whole.shadow_hours)
    np.testing.assert_array_equal(bare.receiver_z, whole.receiver_z)
    assert np.ptp(whole.receiver_z.values) > 5  # roofs are seen, and cast nothing
