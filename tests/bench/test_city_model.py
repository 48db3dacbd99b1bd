"""The made-up city: every object in one tile and one file, closed, and the same each time."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import umbra
from umbra.volume.inspection import inspect_scene
from umbra_benchmarks import city_files
from umbra_benchmarks.city import REGIONS, Constants, work_out
from umbra_benchmarks.city_model import City
from umbra_benchmarks.city_shapes import SHAPES
from umbra_benchmarks.command import command


@pytest.fixture(scope="module")
def tiles():
    return list(City(9, seed=4).tiles())


def test_every_object_lies_in_the_tile_of_its_centre_and_in_no_other(tiles):
    seen = [name for tile in tiles for some in (*tile.buildings, tile.trees) for name in some.names]
    assert len(seen) == len(set(seen)) > 5000
    across = 0
    for tile in tiles:
        low = 1000.0 * np.array(tile.corner)
        for some in tile.buildings:
            plan = some.vertices[..., :2]
            middle = (plan.min(1) + plan.max(1)) / 2
            assert ((middle >= low - 1e-6) & (middle < low + 1000 + 1e-6)).all()
            across += ((plan < low) | (plan > low + 1000)).any((1, 2)).sum()
    assert across > 100  # buildings that reach over a border


def test_no_object_of_a_block_is_lost_between_tiles():
    """Of 16 blocks' rows, which lie on many borders, all 16 houses are somewhere."""
    houses = {}
    for tile in City(25, seed=4).tiles():
        for some in tile.buildings:
            for name in some.names:
                if name.startswith("h"):
                    houses.setdefault(name[:11], set()).add(name[11:])
    numbers = np.array([len(found) for found in houses.values()])
    is_whole = numbers == 16
    # Only blocks at the city's own edge are cut.
    assert is_whole.mean() > 0.8
    assert len(houses) > 100


def test_terrains_of_neighbours_share_their_border():
    city = City(3)
    west, east = city.make_tile((690, 5335)), city.make_tile((691, 5335))
    assert np.array_equal(west.terrain[:, -1], east.terrain[:, 0])
    assert np.ptp(west.terrain[..., 2]) > 5


def test_density_is_what_was_asked_for_and_towers_are_tall():
    city = City(310)
    some = [city.make_tile(corner) for corner in city.corners[::8]]
    mean = np.mean([tile.building_count for tile in some])
    assert mean * 310 == pytest.approx(180_000, rel=0.04)
    shafts = [
        o.vertices[:, 12, 2] - o.vertices[:, 0, 2]
        for tile in some for o in tile.buildings if o.shape.name == "tower"
    ]  # fmt: skip
    assert 150 < np.concatenate(shafts).max() <= 250


@pytest.mark.parametrize("name", [*SHAPES])
def test_shapes_are_closed_and_face_outward(name, tiles):
    shape = SHAPES[name]
    some = next(o for t in tiles for o in (*t.buildings, t.trees) if o.shape is shape)
    corners = some.vertices[0]
    for part in shape.parts:
        volume, edges = 0.0, []
        for _, rings in part:
            for ring in rings:
                edges += list(zip(ring, (*ring[1:], ring[0])))
                p = corners[list(ring)] - corners.mean(0)
                volume += float(np.cross(p[1:-1], p[2:]).sum(0) @ p[0]) / 6
        assert sorted(edges) == sorted((b, a) for a, b in edges)
        assert volume > 20


def test_both_formats_hold_the_same_city(tmp_path):
    pytest.importorskip("lxml")
    city = City(2, seed=5, trees=0.1)
    scenes = []
    for name, ending in city_files.ENDINGS.items():
        written = city_files.write_city(city, tmp_path / name, name)
        files = sorted((tmp_path / name).glob(f"*{ending}"))
        assert len(files) == written.files == 2
        assert sum(file.stat().st_size for file in files) == written.bytes
        scene = umbra.read(*files)
        assert sum(len(part.mesh.faces) for part in scene.parts) == written.triangles
        scenes.append(scene)
    one, two = scenes
    names, others = ([part.name for part in scene.parts] for scene in scenes)
    assert [name.removesuffix("_tin") for name in names] == others
    np.testing.assert_allclose(one.bounds(), two.bounds(), atol=1.1e-3)
    kinds = {part.kind for part in one.parts}
    assert {"RoofSurface", "WallSurface", "SolitaryVegetationObject", "TINRelief"} <= kinds
    buildings = [part for part in one.parts if "Surface" in part.kind]
    assert len({part.name for part in buildings}) >= 2 * 200
    is_open = [report.name for report in inspect_scene(one).parts if not report.closed]
    assert all(name.startswith("dtm") for name in is_open)
    assert len(is_open) == 2


def test_the_same_seed_makes_the_same_bytes_and_another_seed_others(tmp_path):
    city = City(2, seed=7)
    city_files.write_city(city, tmp_path / "a")
    city_files.write_city(City(2, seed=7), tmp_path / "b")
    city_files.write_city(City(2, seed=8), tmp_path / "c")
    for file in sorted((tmp_path / "a").iterdir()):
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()
        assert file.read_bytes() != (tmp_path / "c" / file.name).read_bytes()


def test_one_large_file_ends_soon_after_its_size(tmp_path):
    path = tmp_path / "city.gml"
    written = city_files.write_one(City(20), path, 8_000_000)
    assert 8_000_000 <= path.stat().st_size == written.bytes < 16_000_000
    assert path.read_text().endswith("</core:CityModel>\n")


@pytest.mark.parametrize(
    ("options", "told"),
    [({"area": 0}, "1 km²"), ({"trees": 1.5}, "0 to 1"), ({"buildings": 9000}, "room for")],
)
def test_impossible_cities_are_refused(options, told):
    with pytest.raises(umbra.InputError, match=told):
        City(**options)


def test_costs_are_measured_and_worked_out():
    pytest.importorskip("distributed")
    result = CliRunner().invoke(command, ["city", "--quick", "--json"])
    assert result.exception is None, result.output
    found = json.loads(result.stdout)
    assert found["files"]["buildings"] > 10
    for kind in ("ground", "top"):
        constants = Constants(**found["constants"][kind])
        assert min(vars(constants).values()) >= 0
        assert constants.written > 0
        hours = found["core_hours"]["Munich"][kind]["day_hours"]
        assert hours == pytest.approx(work_out(constants, REGIONS[0], 33) / 3600)
    assert found["efficiency"]["wall"] > 0


def test_costs_add_up():
    one = Constants(1e-9, 1e-6, 1e-10, 1e-8, 2.0, 3.0)
    seconds = one.find_seconds(1e6, 1e4, 33)
    assert seconds == pytest.approx(1e-3 + 2e4 * 1e-6 + 33 * (1e-4 + 2e4 * 1e-8))
